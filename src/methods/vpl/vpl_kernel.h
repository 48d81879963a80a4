// Method      Virtual point lights: paths start at the lights and leave, wherever they meet a surface, a small light
//             that sends on what the surface reflects diffusely. Shaded by all of them, a point receives its
//             indirect light of 1 to `bounces` bounces.
// Paper       A. Keller, "Instant Radiosity", SIGGRAPH 1997; as traced every frame by W. Tatzgern, B. Mayr,
//             B. Kerbl, M. Steinberger, "Stochastic Substitute Trees for Real-Time Global Illumination", I3D 2020.
//             Russian roulette: J. Arvo, D. Kirk, "Particle Transport and Image Synthesis", SIGGRAPH 1990.
//             Shading normals: E. Veach, "Robust Monte Carlo Methods for Light Transport Simulation", PhD thesis,
//             Stanford 1997, section 5.3.
// Symbols     N -> paths -> started over all lights together
//             P_l -> source_flux -> Y, W, of light l; cumulative[l] = P_0 + ... + P_l
//             Phi -> VplPath::flux -> RGB, W, carried by a path; a light's paths carry its flux together
//             rho -> Surface::diffuse -> diffuse albedo
//             c = rho Phi / pi -> Vpl::intensity -> W/sr along the normal; the light's intensity is c cos(theta)
//             q -> survival_probability -> largest channel of rho, at most 1
// Equations   Phi_0 = emitted / (N P_l / sum P) -> VplEmitKernel; emitted light / density -> lights/emission.h
//             Phi_k+1 = rho Phi_k (n_s w)/(n_g w) -> VplBounceKernel, w to where the light comes from
//             (n_s w)/(n_g w), the adjoint of a diffuse BSDF with shading normals -> adjoint_cosine_ratio
// Departures  Lights get their paths by systematic sampling, one random offset for all: path j starts where
//             (j + offset) / N falls in the cumulative flux, so each light starts floor or ceil of its share; the
//             demo of the second paper drops the remainders.
//             Point lights carry 4 pi I (the demo: pi^2 I); spot lights have their cones, KHR_lights_punctual ranges
//             are kept, directional lights and the environment start on the box of the scene.
//             Lights have geometric normals, and paths continue about them; the demo's have shading normals and leave
//             the cosine ratio out. The ratio is clamped to 4 at grazing light: without a bound single lights shine
//             arbitrarily bright.
//             Light arrives on both sides of a surface, as in the path tracer. Roulette divides by q at once.
// Estimator   unbiased for the diffuse light of 1 to `bounces` bounces, except where the cosine ratio is clamped, or
//             the shading normal had to be bent towards the light. Shading with the lights is the reader's affair,
//             and his clamps are his bias.
// In -> Out   lights, path numbers -> rays and their flux; hits -> lights (intensity 0: the path left none) and next
//             rays (tmax < tmin: the path has ended)
// Oracle      tests/vpl_test.cpp: flux of every bounce in closed boxes, flux of every kind of light against closed
//             forms, irradiance by counting lights on a plane, one bounce by quadrature.
#pragma once

#include <span>

#include "base/rng.h"
#include "base/sampling.h"
#include "lights/emission.h"
#include "lights/vpl.h"
#include "scene/surface_kernel.h"
#include "trace/ray.h"

namespace lumigrove {

struct VplPath {
  vec3 flux;             // RGB, W
  float range = 0;       // of the light, until the first hit
  std::uint32_t number;  // key of its random numbers
};

// Dimensions: 8 for the emission, then 4 for every bounce from 1.
inline constexpr std::uint32_t kDimVplBounce = kDimVpl + 4;

// First i with cumulative[i] > target: never a light of no flux. There must be one.
LUMI_HD inline std::uint32_t find_light(std::span<const double> cumulative, double target) {
  std::size_t lo = 0, hi = cumulative.size() - 1;
  while (lo < hi) {
    const std::size_t middle = (lo + hi) / 2;
    if (cumulative[middle] > target)
      hi = middle;
    else
      lo = middle + 1;
  }
  return static_cast<std::uint32_t>(lo);
}

// Paths number `first` and following: where they start and what they carry.
struct VplEmitKernel {
  LightSources sources;
  std::span<const double> cumulative;  // of source_flux; the last one is positive
  Rng rng;
  double offset;  // [0,1), the same for all paths
  int paths, first;
  std::span<Ray> rays;
  std::span<VplPath> out;

  LUMI_HD void operator()(int index) const {
    const auto i = static_cast<std::size_t>(index);
    const auto number = static_cast<std::uint32_t>(first + index);
    const Rng path_rng{rng.seed, rng.frame, number};
    const vec4 u = path_rng.uniform4(kDimVpl);
    const std::uint32_t light = light_of(number);
    const EmittedRay emitted = emit(sources, light, u, path_rng.uniform4(kDimVpl + 4).x);
    const double share = static_cast<double>(source_flux(sources, light)) / cumulative[cumulative.size() - 1];
    out[i] = {emitted.flux * static_cast<float>(1 / (paths * share)), emitted.range, number};
    rays[i] = Ray{};
    if (!(max_component(out[i].flux) > 0) || !is_finite(out[i].flux)) {
      out[i].flux = vec3(0);
      return;
    }
    rays[i].origin = emitted.origin;
    rays[i].direction = emitted.direction;
    rays[i].tmax = kInfinity;
  }

 private:
  LUMI_HD std::uint32_t light_of(std::uint32_t number) const {
    const double total = cumulative[cumulative.size() - 1];
    const double target = (number + offset) / paths * total;
    return find_light(cumulative, glm::min(target, total * (1 - 0x1p-53)));  // below the total, whatever the rounding
  }
};

// Light arrives within the solid angle of the geometric cosine, but is reflected by the shading one.
LUMI_HD inline float adjoint_cosine_ratio(const Surface& surface) {
  constexpr float kMost = 4;
  const float shading = glm::dot(surface.normal, surface.wo);
  const float geometric = glm::dot(surface.geometric_normal, surface.wo);
  return shading < kMost * geometric ? glm::max(shading, 0.0f) / geometric : kMost;
}

LUMI_HD inline float survival_probability(const Surface& surface) {
  return glm::min(max_component(surface.diffuse), 1.0f);
}

// Bounce number `bounce` (from 1) of every path whose ray was answered: the light that it leaves, and its next ray in
// place of the last.
struct VplBounceKernel {
  SceneView scene;
  Rng rng;
  int bounce, bounces, roulette_start;
  bool force_diffuse;
  std::span<const Hit> hits;
  std::span<Ray> rays;
  std::span<VplPath> paths;
  std::span<Vpl> vpls;

  LUMI_HD void operator()(int index) const {
    const auto i = static_cast<std::size_t>(index);
    prefetch_surfaces(scene, hits, i);
    const Ray arriving = rays[i];
    rays[i].tmax = -1;
    vpls[i].intensity = vec3(0);
    if (hits[i].instance == kNoId) return;
    const Surface surface = make_surface(scene, arriving, hits[i], force_diffuse);
    VplPath& path = paths[i];
    path.flux *= range_window(surface.t * surface.t, path.range);
    path.range = 0;
    path.flux *= surface.diffuse * adjoint_cosine_ratio(surface);
    if (!(max_component(path.flux) > 0) || !is_finite(path.flux)) return;
    vpls[i] = {surface.position, surface.epsilon, surface.geometric_normal, path.flux * kInvPi};
    if (bounce < bounces) scatter(surface, path, rays[i]);
  }

 private:
  LUMI_HD void scatter(const Surface& surface, VplPath& path, Ray& ray) const {
    const Rng path_rng{rng.seed, rng.frame, path.number};
    const vec4 u = path_rng.uniform4(kDimVplBounce + 4 * static_cast<std::uint32_t>(bounce));
    if (bounce >= roulette_start) {
      const float q = survival_probability(surface);
      if (u.z >= q) return;
      path.flux /= q;
    }
    ray.origin = surface.position + surface.geometric_normal * surface.epsilon;
    ray.direction = make_frame(surface.geometric_normal).to_world(sample_cosine_hemisphere(vec2(u)));
    ray.tmin = 0;
    ray.tmax = kInfinity;
  }
};

}  // namespace lumigrove
