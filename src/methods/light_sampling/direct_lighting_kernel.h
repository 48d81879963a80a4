// Kernels of direct light: one light sample for each surface, and its addition once the shadow rays are
// answered. The estimator and its header block are in light_sampler_kernel.h.
#pragma once

#include <span>

#include "base/rng.h"
#include "methods/light_sampling/light_sampler_kernel.h"
#include "scene/bsdf.h"

namespace lumigrove {

// surfaces[i] -> shadow[i], contribution[i] (radiance towards wo if unoccluded). Rays that carry nothing are
// marked untraced. Surfaces take their random numbers from `dimension`.
struct DirectLightKernel {
  LightSampler sampler;
  Rng rng;
  std::uint32_t dimension;
  float scale;  // 1 / samples
  bool mis;
  std::span<const Surface> surfaces;
  std::span<const std::uint32_t> pixels;
  std::span<Ray> shadow;
  std::span<vec3> contribution;

  LUMI_HD void operator()(int index) const {
    const std::size_t i = static_cast<std::size_t>(index);
    shadow[i].tmax = -1;
    contribution[i] = vec3(0);
    const Surface& surface = surfaces[i];
    if (surface.instance == kNone) return;
    Rng pixel_rng = rng;
    pixel_rng.pixel = pixels[i];
    const LightSample sample = sample_light(sampler, surface, pixel_rng.uniform4(dimension));
    if (!(max_component(sample.weight) > 0)) return;
    const float cosine = glm::dot(surface.normal, sample.wi);
    if (!(cosine > 0)) return;
    vec3 light = bsdf_eval(surface, sample.wi) * sample.weight * (cosine * scale);
    if (mis && sample.pdf > 0) light *= sample.pdf / (sample.pdf + bsdf_pdf(surface, sample.wi));
    if (!(max_component(light) > 0) || !is_finite(light)) return;
    contribution[i] = light;
    shadow[i] = shadow_ray(surface, sample, sampler.lights.diagonal);
  }
};

struct AddUnoccludedKernel {
  std::span<const vec3> contribution;
  std::span<const std::uint8_t> occluded;
  std::span<vec3> sum;

  LUMI_HD void operator()(int i) const {
    const std::size_t k = static_cast<std::size_t>(i);
    if (!occluded[k]) sum[k] += contribution[k];
  }
};

}  // namespace lumigrove
