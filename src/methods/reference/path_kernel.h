// Method      Unidirectional path tracing: continues every path by BSDF sampling, samples lights at every
//             vertex, and combines both ways of finding a light. Everyone's reference.
// Paper       J. T. Kajiya, "The Rendering Equation", SIGGRAPH 1986; E. Veach, L. J. Guibas, "Optimally
//             Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995, sections 3.2 and 5;
//             J. Arvo, D. Kirk, "Particle Transport and Image Synthesis", SIGGRAPH 1990, for roulette.
// Symbols     T_k -> PathState::throughput -> product of f cos / p over the vertices before ray k; no unit
//             p_b -> PathState::pdf, bsdf_pdf -> density of the BSDF sample, per steradian at the vertex
//             it left
//             n p_l -> pdf_of_hit, pdf_of_escape -> density of light sampling in that direction, likewise, times
//             the number of light samples; below a cut or a split set the sum over its nodes, each sampled n times
//             w_b = p_b / (p_b + n p_l) -> balance_weight -> weight of the BSDF sample; no unit
// Equations   Veach & Guibas (9), balance heuristic -> balance_weight, and DirectLightKernel for light
//             samples: the two weights of one direction sum to 1
// Departures  A wavefront: one ray of every path at a time, so that rays are traced in batches. Roulette
//             survives with probability min(1, largest component of the throughput).
// Estimator   unbiased up to the number of bounces asked for. Path k = 0 is the visible surface; light that
//             reaches it straight from an emitter is direct, what takes 1 to max_bounces detours indirect.
// In -> Out   first surfaces (no hit: no path), random keys -> radiance added to `direct` (only what BSDF
//             sampling finds; light sampling at the first surface is its caller's) and to `indirect`
// Oracle      PathTracing::bsdf_only: no light sampling at all; tests/path_test.cpp compares light
//             sampling, BSDF sampling and both, and checks furnaces and closed forms.
#pragma once

#include <span>

#include "base/rng.h"
#include "methods/light_sampling/direct_lighting_kernel.h"
#include "scene/bsdf.h"
#include "scene/surface_kernel.h"
#include "trace/ray.h"

namespace lumigrove {

// A path under way: what its next ray will carry.
struct PathState {
  vec3 throughput;
  float pdf;           // of the ray under way; 0: the path has ended
  std::uint32_t slot;  // of its first surface
};

LUMI_HD inline float balance_weight(float pdf, float other) { return pdf > 0 ? 1 / (1 + other / pdf) : 0.0f; }

// First surfaces -> paths; kept[i] is the index of the first surface of path i.
struct PathStartKernel {
  std::span<const Surface> first;
  std::span<const std::uint32_t> kept;
  std::span<Surface> surfaces;
  std::span<PathState> paths;

  LUMI_HD void operator()(int index) const {
    const auto i = static_cast<std::size_t>(index);
    surfaces[i] = first[kept[i]];
    paths[i] = {vec3(1), 0, kept[i]};
  }
};

// Samples the BSDF at every path's surface: throughput, pdf and the next ray. Bounces from `roulette_start`
// on may end the path (`ray_number` 1 leaves the first surface). Ended paths have pdf 0 and an untraced ray.
struct PathScatterKernel {
  std::span<const Surface> surfaces;
  std::span<const std::uint32_t> pixels;  // by slot
  Rng rng;
  int ray_number, roulette_start;
  std::span<PathState> paths;
  std::span<Ray> rays;

  LUMI_HD void operator()(int index) const {
    const auto i = static_cast<std::size_t>(index);
    const Surface& surface = surfaces[i];
    PathState& path = paths[i];
    Rng pixel_rng = rng;
    pixel_rng.pixel = pixels[path.slot];
    const auto vertex = static_cast<std::uint32_t>(ray_number - 1);
    const vec4 u = pixel_rng.uniform4(kDimBsdf + vertex * kDimensionsPerVertex);
    const BsdfSample sample = bsdf_sample(surface, vec3(u));
    rays[i] = Ray{};
    path.pdf = 0;
    path.throughput *= sample.weight;
    const float strength = max_component(path.throughput);
    if (!(strength > 0) || !is_finite(strength)) return;
    if (ray_number >= roulette_start && strength < 1) {
      if (u.w >= strength) return;
      path.throughput /= strength;
    }
    path.pdf = sample.pdf;
    rays[i].origin = surface.position + surface.geometric_normal * surface.epsilon;
    rays[i].direction = sample.wi;
    rays[i].tmax = kInfinity;
  }
};

// How light sampling would have found what a BSDF sample found.
struct LightDensity {
  LightSampler sampler;
  bool all = false;   // every light is sampled, not one
  bool none = false;  // there is no light sampling
  float samples = 1;  // n, of each light or of one; with cuts their passes
  CutSamples cuts = {};  // of the first surfaces, by slot
  SplitSamples split = {};

  // Of point `y` on the emissive triangle `emitter`, per steradian at `from`, times n. 0 if it is not in the
  // light set.
  LUMI_HD float pdf_of_hit(const Surface& from, std::uint32_t slot, std::uint32_t emitter, vec3 y) const {
    if (none || emitter == kNoEmitter) return 0;
    if (cuts.cuts.empty() && split.counts.empty() && !all) return samples * pdf_light(sampler, from, emitter, y);
    const float of_point = pdf_emitter_point(sampler.lights, emitter, from.position, y);
    if (all) return samples * of_point;
    if (!cuts.cuts.empty()) return pdf_below_cut(sampler, cuts, from, slot, emitter) * of_point;
    return samples * pdf_below_split(sampler, split, from, slot, emitter) * of_point;
  }
  LUMI_HD float pdf_of_escape(const Surface& from, vec3 wi) const {
    if (none) return 0;
    if (all) return samples * pdf_environment(sampler.lights.environment, from.normal, wi);
    return samples * (split.counts.empty() ? pdf_light_environment(sampler, from, wi)
                                           : pdf_environment_beside_local(sampler, from, wi));
  }
};

// Rays that left the scene see the environment.
struct PathEscapeKernel {
  LightDensity density;
  std::span<const Surface> surfaces;  // where the rays started
  std::span<const PathState> paths;
  std::span<const Ray> rays;
  std::span<const Hit> hits;
  std::span<vec3> sum;  // by slot

  LUMI_HD void operator()(int index) const {
    const auto i = static_cast<std::size_t>(index);
    const PathState& path = paths[i];
    if (!(path.pdf > 0) || hits[i].instance != kNoId) return;
    const vec3 wi = rays[i].direction;
    const vec3 radiance = environment_radiance(density.sampler.scene, density.sampler.lights.environment, wi);
    const float weight = balance_weight(path.pdf, density.pdf_of_escape(surfaces[i], wi));
    sum[path.slot] += path.throughput * radiance * weight;
  }
};

// Rays that hit something make the next vertices, packed: path kept[j] becomes path j.
struct PathArriveKernel {
  SceneView scene;
  LightView lights;
  float light_scale;  // the light set's, for Surface::emission
  bool force_diffuse;
  std::span<const std::uint32_t> kept;
  std::span<const PathState> paths;
  std::span<const Ray> rays;
  std::span<const Hit> hits;
  std::span<Surface> next_surfaces;
  std::span<PathState> next_paths;

  LUMI_HD void operator()(int index) const {
    const auto j = static_cast<std::size_t>(index);
    const std::size_t i = kept[j];
    next_paths[j] = paths[i];
    Surface surface = make_surface(scene, rays[i], hits[i], force_diffuse);
    surface.emission *= light_scale;
    if (max_component(surface.emission) > 0)
      surface.emitter = emitter_of_triangle(lights, hits[i].instance, hits[i].triangle);
    next_surfaces[j] = surface;
  }
};

// Emission of the surfaces that rays arrived at.
struct PathEmissionKernel {
  LightDensity density;
  std::span<const std::uint32_t> kept;
  std::span<const Surface> surfaces;       // where the rays started, by kept[j]
  std::span<const Surface> next_surfaces;  // where they arrived
  std::span<const PathState> next_paths;
  std::span<vec3> sum;  // by slot

  LUMI_HD void operator()(int index) const {
    const auto j = static_cast<std::size_t>(index);
    const Surface& hit = next_surfaces[j];
    if (!(max_component(hit.emission) > 0)) return;
    const PathState& path = next_paths[j];
    const float pdf_light = density.pdf_of_hit(surfaces[kept[j]], path.slot, hit.emitter, hit.position);
    sum[path.slot] += path.throughput * hit.emission * balance_weight(path.pdf, pdf_light);
  }
};

// Keys of the paths' random numbers, for light sampling.
struct PathPixelsKernel {
  std::span<const PathState> paths;
  std::span<const std::uint32_t> pixels;  // by slot
  std::span<std::uint32_t> out;

  LUMI_HD void operator()(int i) const {
    out[static_cast<std::size_t>(i)] = pixels[paths[static_cast<std::size_t>(i)].slot];
  }
};

// Light sampled at the vertices, carried back to the first surfaces.
struct PathLightKernel {
  std::span<const PathState> paths;
  std::span<const vec3> light;  // radiance leaving each vertex along its path
  std::span<vec3> sum;          // by slot

  LUMI_HD void operator()(int index) const {
    const auto i = static_cast<std::size_t>(index);
    sum[paths[i].slot] += paths[i].throughput * light[i];
  }
};

}  // namespace lumigrove
