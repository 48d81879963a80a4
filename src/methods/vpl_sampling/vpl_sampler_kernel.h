// Method      Lights surfaces by virtual point lights: chooses one light (uniformly, by power, by a walk down the
//             substitute tree) or draws one from a substitute, and says what it sends to the viewer by way of a surface.
// Paper       W. Tatzgern et al., "Stochastic Substitute Trees for Real-Time Global Illumination", I3D 2020: section 4;
//             A. Keller, "Instant Radiosity", SIGGRAPH 1997, for the lights.
// Symbols     I -> VplPoint::intensity -> radiant intensity along the light's normal (W/sr), divided by the probability
//             G_max -> VplSampler::clamp -> most of cos(theta_v) / d^2, 1/m^2
//             P_d -> diffuse_walk_probability -> of lighting the diffuse lobe rather than gloss
// Equations   L = I min(cos(theta_v) / d^2, G_max) f cos(theta_x) / P -> vpl_light
// Departures  Lengths in units of the scene. A light's offset from its surface is its own; a substitute's is
//             `substitute_offset`, skipped along the shadow ray. Three Gaussian numbers, as the paper, not two.
//             `correction` mixes substitutes with leaves: with probability q the sample is S + (L - S) / q instead of S.
// Estimator   To leaves: unbiased for the sum over all lights under the same clamp. To substitutes: biased, because a
//             substitute's lights are not where its Gaussian is; unbiased again with correction > 0, because then the
//             mean of S leaves the sum.
// In -> Out   surfaces, random numbers -> shadow ray from the light to the surface, radiance if it is unoccluded
// Oracle      VplChoice::kOne over every light in turn (selection "all"), tests/indirect_lighting_test.cpp
#pragma once

#include "lights/alias_table.h"
#include "lights/lit_lanes.h"
#include "methods/substitute_tree/substitute_draw_kernel.h"
#include "trace/ray.h"

namespace lumigrove {

enum class VplChoice : std::uint8_t { kUniform, kPower, kTree, kOne };

struct VplSampler {
  VplView lights;
  VplChoice choice = VplChoice::kUniform;
  AliasView alias;             // kPower: over the Y of the intensities
  SubstituteWalk walk;         // kTree
  std::uint32_t one = 0;       // kOne
  float clamp = kInfinity;     // G_max, 1/m^2
  float substitute_offset = 0; // metres of a shadow ray that are skipped at a substitute
  float correction = 0;        // q
  bool gloss = true;           // light gloss lobes too,
  float mirror_roughness = 0;  // but not of surfaces at most this rough
};

enum class Lobes : std::uint8_t { kDiffuse, kGloss, kBoth };

// A light, or one drawn from a substitute. intensity: W/sr, divided by the probability of the choice.
struct VplPoint {
  vec3 position, normal, intensity;
  float offset = 0;  // from its surface along the normal, metres
  float skip = 0;    // first part of its shadow ray, metres
};

LUMI_HD inline VplPoint exact_vpl(const Vpl& vpl, float scale) {
  return {vpl.position, vpl.normal, vpl.intensity * scale, vpl.epsilon, 0};
}

// Radiance that leaves the surface towards its viewer if nothing is between it and the light.
LUMI_HD inline vec3 vpl_light(const Surface& surface, const VplPoint& light, float clamp, Lobes lobes) {
  const vec3 to_light = light.position - surface.position;
  const float d2 = length_squared(to_light);
  if (!(d2 > 0)) return vec3(0);
  const vec3 wi = to_light * (1 / glm::sqrt(d2));
  const float cos_light = -glm::dot(wi, light.normal), cos_surface = glm::dot(wi, surface.normal);
  if (!(cos_light > 0) || !(cos_surface > 0)) return vec3(0);
  const vec3 f = lobes == Lobes::kDiffuse ? bsdf_eval_diffuse(surface, wi)
                 : lobes == Lobes::kGloss ? bsdf_eval_gloss(surface, wi)
                                          : bsdf_eval(surface, wi);
  const vec3 result = light.intensity * f * (glm::min(cos_light / d2, clamp) * cos_surface);
  return is_finite(result) ? result : vec3(0);  // negative where a sample is corrected
}

// From the light to the surface: rays from one light to many pixels stay close to each other.
LUMI_HD inline Ray vpl_shadow_ray(const Surface& surface, const VplPoint& light) {
  Ray ray;
  const vec3 target = surface.position + surface.geometric_normal * surface.epsilon;
  ray.origin = light.position + light.normal * light.offset;
  ray.direction = target - ray.origin;
  const float distance = glm::length(ray.direction);
  ray.tmin = distance > 0 ? glm::min(0.5f, light.skip / distance) : 0.0f;
  ray.tmax = 1;
  return ray;
}

LUMI_HD inline bool lights_gloss(const VplSampler& sampler, const Surface& s) {
  return vpls_light_gloss(sampler.gloss, sampler.mirror_roughness, s);
}

// Probability of lighting the diffuse lobe when the two are lit one at a time.
LUMI_HD inline float diffuse_walk_probability(const VplSampler& sampler, const Surface& s) {
  if (!lights_gloss(sampler, s)) return 1;
  const float diffuse = glm::max(0.01f, luminance(s.diffuse));
  return diffuse / (diffuse + luminance(s.specular));
}

// One light by index and its probability: kUniform, kPower, kOne.
struct ChosenVpl {
  std::uint32_t index;
  float pdf;
};
LUMI_HD inline ChosenVpl choose_vpl(const VplSampler& sampler, vec2 u) {
  const auto n = static_cast<std::uint32_t>(sampler.lights.vpls.size());
  switch (sampler.choice) {
    case VplChoice::kPower: {
      const std::uint32_t i = sample_alias(sampler.alias, u.x, u.y);
      return {i, sampler.alias.pdf(luminance(sampler.lights.vpls[i].intensity))};
    }
    case VplChoice::kOne:
      return {sampler.one, 1};
    default: {
      const auto i = static_cast<std::uint32_t>(static_cast<double>(u.x) * n);
      return {i < n ? i : n - 1, 1 / static_cast<float>(n)};
    }
  }
}

// What a walk ended at, drawn if it is a substitute.
LUMI_HD inline VplPoint vpl_of_walk(const VplSampler& sampler, const WalkResult& result, vec4 u) {
  const SubstituteTreeView& tree = sampler.walk.tree;
  const float scale = 1 / result.pdf;
  if (result.end == WalkEnd::kLeaf) return exact_vpl(tree.leaf(result.node), scale);
  const Distribution& d = tree.distributions[result.node];
  return {sample_distribution(d, result.box, u), d.normal, d.intensity * scale, 0, sampler.substitute_offset};
}

// --- many at once ------------------------------------------------------------------------------------------

// vpl_light and vpl_shadow_ray for the diffuse lobes of a group of surfaces.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LitLanes<L> light_diffuse_lobes(const VplSampler& sampler,
                                                           const SubstituteWalkPoints& points, int first,
                                                           const LightLanes<L>& light) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-30f);
  const LaneVec3<L> x = load_vec3<L>(points.position, first), n = load_vec3<L>(points.normal, first),
                    geometric = load_vec3<L>(points.geometric_normal, first),
                    albedo = load_vec3<L>(points.diffuse, first);
  const LaneVec3<L> to_light{light.position.x - x.x, light.position.y - x.y, light.position.z - x.z};
  const Lanes<L> d2 = dot<L>(to_light, to_light), inverse = inverse_sqrt<L>(max_lanes<L>(d2, tiny));
  const Lanes<L> inverse2 = inverse * inverse;
  const Lanes<L> cos_light = dot<L>(to_light, light.normal) * (zero - inverse);
  const Lanes<L> cos_surface = dot<L>(to_light, n) * inverse, cos_geometric = dot<L>(to_light, geometric);
  // All must be positive; a light at the very place of the surface sends nothing.
  const Lanes<L> least = min_lanes<L>(min_lanes<L>(cos_light, cos_surface),
                                      min_lanes<L>(cos_geometric, min_lanes<L>(light.alive, d2 - tiny)));
  const Lanes<L> bounded = min_lanes<L>(cos_light * inverse2, broadcast<L>(glm::min(sampler.clamp, 3e38f)));
  const Lanes<L> geometry = choose_where_greater<L>(least, zero, bounded * cos_surface * kInvPi, zero);
  LitLanes<L> lit;
  lit.radiance = {light.intensity.x * albedo.x * geometry, light.intensity.y * albedo.y * geometry,
                  light.intensity.z * albedo.z * geometry};

  const Lanes<L> epsilon = load_lanes<L>(points.epsilon + first);
  lit.origin = {multiply_add<L>(light.normal.x, light.epsilon, light.position.x),
                multiply_add<L>(light.normal.y, light.epsilon, light.position.y),
                multiply_add<L>(light.normal.z, light.epsilon, light.position.z)};
  lit.direction = {multiply_add<L>(geometric.x, epsilon, x.x) - lit.origin.x,
                   multiply_add<L>(geometric.y, epsilon, x.y) - lit.origin.y,
                   multiply_add<L>(geometric.z, epsilon, x.z) - lit.origin.z};
  const Lanes<L> length2 = dot<L>(lit.direction, lit.direction);
  const Lanes<L> skip = light.substitute * (sampler.substitute_offset * inverse_sqrt<L>(max_lanes<L>(length2, tiny)));
  lit.tmin = min_lanes<L>(skip, broadcast<L>(0.5f));
  // Corrected samples may be negative.
  const Lanes<L> strength = lit.radiance.x * lit.radiance.x + lit.radiance.y * lit.radiance.y +
                            lit.radiance.z * lit.radiance.z;
  lit.tmax = choose_where_greater<L>(strength, zero, one, zero - one);
  return lit;
}

}  // namespace lumigrove
