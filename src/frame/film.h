// The film: running means of what every pixel received, and the layers of the image they become.
#pragma once

#include <span>
#include <vector>

#include "lights/emitter.h"
#include "lumigrove/image.h"
#include "methods/vpl_sampling/indirect_lighting_kernel.h"
#include "scene/surface.h"
#include "trace/ray.h"

namespace lumigrove {

// 104 bytes. Light and colours are means over the samples so far; position, depth and identifiers are those
// of the pixel's first sample, because a mean of them names no place.
struct FilmPixel {
  vec3 direct, indirect, emission;  // radiance; emission: emitters and environment seen directly
  vec3 moment2;                     // sum of squared deviations of the total from its mean (Welford 1962)
  vec3 albedo, normal;              // diffuse + specular reflectance; shading normal, world
  float alpha;                      // share of samples that hit something
  vec3 position;                    // world, metres
  float depth;                      // metres along the view direction, infinite where nothing was hit
  std::uint32_t emitter, instance;  // stable id of the emitter hit, index of the mesh instance; kNoId
};

// Light of one camera sample for every entry of a batch.
struct SampleLight {
  std::span<const vec3> direct, indirect, emission;
};

// Adds camera sample number `sample` (from 0) of each surface to its pixel.
struct FilmKernel {
  int sample;
  LightView lights;
  vec3 eye, forward;
  std::span<const Surface> surfaces;
  std::span<const std::uint32_t> pixels;
  SampleLight light;
  std::span<FilmPixel> film;

  LUMI_HD void operator()(int index) const {
    const std::size_t i = static_cast<std::size_t>(index);
    const Surface& surface = surfaces[i];
    FilmPixel& pixel = film[pixels[i]];
    const bool hit = surface.instance != kNoId;
    if (sample == 0) {
      pixel = FilmPixel{};
      pixel.position = hit ? surface.position : vec3(0);
      pixel.depth = hit ? glm::dot(surface.position - eye, forward) : kInfinity;
      pixel.instance = surface.instance;
      pixel.emitter = surface.emitter == kNoId ? kNoId : stable_id(lights, surface.emitter);
    }
    const float weight = 1 / static_cast<float>(sample + 1);
    const vec3 old_mean = pixel.direct + pixel.indirect + pixel.emission;
    pixel.direct += (light.direct[i] - pixel.direct) * weight;
    pixel.indirect += (light.indirect[i] - pixel.indirect) * weight;
    pixel.emission += (light.emission[i] - pixel.emission) * weight;
    const vec3 total = light.direct[i] + light.indirect[i] + light.emission[i];
    const vec3 mean = pixel.direct + pixel.indirect + pixel.emission;
    pixel.moment2 += (total - old_mean) * (total - mean);
    pixel.alpha += ((hit ? 1.0f : 0.0f) - pixel.alpha) * weight;
    pixel.albedo += ((hit ? surface.diffuse + surface.specular : vec3(0)) - pixel.albedo) * weight;
    pixel.normal += ((hit ? surface.normal : vec3(0)) - pixel.normal) * weight;
  }
};

// What the walks for a pixel did, means over its samples (indirect.show).
struct WalkPixel {
  float steps, size, substitute, boxed, clamped;
};

struct WalkFilmKernel {
  int sample;
  std::span<const VplTrace> traces;
  std::span<const std::uint32_t> pixels;
  std::span<WalkPixel> film;

  LUMI_HD void operator()(int index) const {
    const std::size_t i = static_cast<std::size_t>(index);
    const VplTrace& trace = traces[i];
    WalkPixel& pixel = film[pixels[i]];
    const float weight = 1 / static_cast<float>(sample + 1);
    const auto add = [&](float& mean, float value) { mean += (value - mean) * weight; };
    add(pixel.steps, trace.steps);
    add(pixel.size, trace.size);
    add(pixel.substitute, trace.substitute ? 1.0f : 0.0f);
    add(pixel.boxed, trace.boxed ? 1.0f : 0.0f);
    add(pixel.clamped, trace.clamped ? 1.0f : 0.0f);
  }
};

struct Film {
  int width = 0, height = 0;
  std::vector<FilmPixel> pixels;  // row by row from the top; outside the crop window all zero
  std::vector<WalkPixel> walks;   // empty unless they are shown

  Film(int film_width, int film_height, bool shows_walks = false);
};

// All layers; `samples` is how many went into every pixel. Variance needs two.
Image develop(const Film& film, int samples);

}  // namespace lumigrove
