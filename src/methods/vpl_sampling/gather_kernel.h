// Method      One more ray from a surface, whose arrival is lit instead: for near-mirrors, whose gloss no light of a tree
//             fits, and for what the clamp of virtual point lights takes away.
// Paper       W. Tatzgern et al., "Stochastic Substitute Trees", I3D 2020, section 7: mirrors, the authors' own remedy;
//             T. Kollig, A. Keller, "Illumination in the Presence of Weak Singularities", MCQMC 2004: compensation.
// Symbols     T -> GatherState::throughput -> f cos / p of the ray, for the clamp times the share that it takes away
//             G_max -> GatherScatterKernel::clamp -> most of cos(theta_v) / d^2, 1/m^2
// Equations   share taken away = max(0, 1 - G_max d^2 / cos(theta_v)) -> lost_to_clamp; rays longer than 1/sqrt(G_max)
//             find nothing and end there
// Departures  Kollig and Keller go on recursively. Here the light at the arrival is that of the emitters and of all
//             virtual point lights, clamped: one bounce more than the lights have is counted where two surfaces are
//             near, and the clamp's loss at the arrival itself remains.
// Estimator   mirrors: unbiased for the gloss of surfaces lit as above. Compensation: biased, by what is said there.
// In -> Out   surfaces -> rays; hits -> packed surfaces to be lit -> light carried back
// Oracle      tests/gather_test.cpp: path tracing of the same bounces
#pragma once

#include <span>

#include "base/rng.h"
#include "scene/bsdf.h"
#include "scene/surface_kernel.h"
#include "trace/ray.h"

namespace lumigrove {

enum class GatherKind : std::uint8_t { kMirror, kClamp };

struct GatherState {
  vec3 throughput;     // 0: no ray
  std::uint32_t slot;  // of the surface that the ray left
};

// Is the gloss of this surface followed by a ray?
LUMI_HD inline bool follows_mirror(const Surface& s, float mirror_roughness) {
  return mirror_roughness > 0 && s.roughness <= mirror_roughness && has_gloss(s);
}

// surfaces[i] -> rays[i], states[i].
struct GatherScatterKernel {
  GatherKind kind;
  float mirror_roughness;  // gloss of surfaces at most this rough is kMirror's
  float clamp;             // kClamp
  bool gloss;              // kClamp: of gloss lobes too
  Rng rng;
  std::uint32_t dimension;
  std::span<const Surface> surfaces;
  std::span<const std::uint32_t> pixels;
  std::span<Ray> rays;
  std::span<GatherState> states;

  LUMI_HD void operator()(int index) const {
    const auto i = static_cast<std::size_t>(index);
    const Surface& s = surfaces[i];
    rays[i] = Ray{};
    states[i] = {vec3(0), static_cast<std::uint32_t>(i)};
    if (s.instance == kNoId) return;
    const bool mirror = follows_mirror(s, mirror_roughness);
    if (kind == GatherKind::kMirror && !mirror) return;
    const vec3 u(Rng{rng.seed, rng.frame, pixels[i]}.uniform4(dimension));
    const BsdfSample sample = kind == GatherKind::kMirror ? bsdf_sample_gloss(s, vec2(u.y, u.z))
                              : gloss && !mirror          ? bsdf_sample(s, u)
                                                          : bsdf_sample_diffuse(s, vec2(u.y, u.z));
    if (!(sample.pdf > 0) || !(max_component(sample.weight) > 0) || !is_finite(sample.weight)) return;
    states[i].throughput = sample.weight;
    rays[i].origin = s.position + s.geometric_normal * s.epsilon;
    rays[i].direction = sample.wi;
    rays[i].tmax = kind == GatherKind::kMirror ? kInfinity : 1 / glm::sqrt(clamp);
  }
};

// Share of a light's contribution that the clamp takes away, for a light on surface `y` seen from `distance` along y.wo.
LUMI_HD inline float lost_to_clamp(const Surface& y, float distance, float clamp) {
  const float cos_light = glm::dot(y.geometric_normal, y.wo);
  return cos_light > 0 ? glm::max(0.0f, 1 - clamp * distance * distance / cos_light) : 0.0f;
}

// Rays that hit something give the surfaces to be lit: ray kept[j] becomes surface j.
struct GatherArriveKernel {
  GatherKind kind;
  float clamp;
  SceneView scene;
  bool force_diffuse;
  std::span<const std::uint32_t> kept;
  std::span<const std::uint32_t> pixels;
  std::span<const Ray> rays;
  std::span<const Hit> hits;
  std::span<const GatherState> states;
  std::span<Surface> next_surfaces;
  std::span<std::uint32_t> next_pixels;
  std::span<GatherState> next_states;

  LUMI_HD void operator()(int index) const {
    const auto j = static_cast<std::size_t>(index);
    const std::size_t i = kept[j];
    Surface& y = next_surfaces[j];
    write_surface(scene, rays[i], hits[i], force_diffuse, y);
    next_pixels[j] = pixels[i];
    next_states[j] = states[i];
    if (kind == GatherKind::kMirror) return;
    const float lost = lost_to_clamp(y, y.t, clamp);
    next_states[j].throughput *= lost;
    if (!(lost > 0)) y.instance = kNoId;  // nothing to be lit
  }
};

// Light of the arrivals, carried back.
struct GatherCarryKernel {
  std::span<const GatherState> states;
  std::span<const vec3> light;
  std::span<vec3> sum;  // by slot

  LUMI_HD void operator()(int index) const {
    const auto j = static_cast<std::size_t>(index);
    sum[states[j].slot] += states[j].throughput * light[j];
  }
};

}  // namespace lumigrove
