// Method      Chooses one light for a surface point, a point on it, and says with what probability: uniformly, by
//             power, or by a walk down the light tree or a light BVH; directional lights and the environment beside the
//             local ones.
// Paper       none of its own; P. Shirley, C. Wang, K. Zimmerman, "Monte Carlo Techniques for Direct Lighting
//             Calculations", ACM TOG 15(1), 1996 for the choice by power.
// Symbols     p(group) -> group_probabilities -> local emitters, directional lights or environment, given the surface
//             p(light | group) -> AliasView::pdf, 1/n, pdf_light_tree, pdf_mesh_trees or pdf_light_bvh
//             p(y | light) -> EmitterPoint::area_to_solid / A -> per solid angle at the surface
// Equations   contribution = f * cos * incident / (p(group) p(light | group) p(y | light))
// Departures  none
// Estimator   unbiased: a group or light that can contribute has positive probability.
// In -> Out   Surface, four uniform numbers -> LightSample; weight 0 where the draw carries no light.
// Oracle      LightSampler::Kind::kOne over every light in turn (selection "all"): the exhaustive sum.
#pragma once

#include "base/lanes.h"
#include "base/rng.h"
#include "lights/emitter.h"
#include "lights/environment.h"
#include "lights/alias_table.h"
#include "methods/light_bvh/light_bvh_kernel.h"
#include "methods/light_tree/light_tree_kernel.h"
#include "methods/light_tree/two_level_tree_kernel.h"
#include "scene/bsdf.h"
#include "scene/surface.h"
#include "trace/ray.h"

namespace lumigrove {

// One light's answer to a surface. The contribution is bsdf * cos * weight, if `shadow` is free.
struct LightSample {
  vec3 wi = vec3(0);                   // unit, towards the light
  float pdf = 0;                       // per solid angle, selection included; 0 for lights without area
  vec3 weight = vec3(0);               // radiance / pdf, or irradiance / selection probability without area
  std::uint32_t emitter = kNoEmitter;  // local emitter, kNoEmitter for lights at infinity
  float distance = 0;                  // metres; infinite for lights at infinity
  bool from_vpl = false;               // the emitter is a virtual point light,
  bool gloss = true;                   // which may be wanted for the diffuse lobe only;
  vec3 clear = vec3(0);                // where shadow rays to it end, clear of its own surface
};

enum class LightChoice : std::uint8_t { kUniform, kPower, kTree, kOne, kBvh };

struct LightSampler {
  SceneView scene;
  LightView lights;
  LightChoice choice = LightChoice::kUniform;
  AliasView alias;        // kPower: over emitter_flux
  LightTreeView tree;     // kTree
  LightBvhView bvh;       // kBvh
  std::uint32_t one = 0;  // kOne: emitters, then directional lights, then the environment
  MeshTreesView mesh_trees = {};  // kTree: where present, `tree` is the top level over these
  // Virtual point lights among the emitters light gloss lobes too, but not of surfaces at most this rough.
  bool vpl_gloss = true;
  float vpl_mirror_roughness = 0;
};

struct GroupProbabilities {
  float local = 0, directional = 0, environment = 0;
};

// Half by the flux of the groups that can reach this side of the surface, half evenly among them, so that a
// mistaken estimate costs at most a factor.
LUMI_HD inline GroupProbabilities group_probabilities(const LightSampler& sampler, const Surface& surface) {
  const LightView& lights = sampler.lights;
  const bool local = lights.local_flux > 0;
  if (lights.directional.empty() && !lights.environment.present()) return {local ? 1.0f : 0.0f, 0, 0};
  float directional_flux = 0;
  for (const DirectionalView& light : lights.directional)
    if (glm::dot(light.direction, surface.normal) < 0)
      directional_flux += luminance(light.irradiance) * lights.scene_disc;
  const float environment_flux = lights.environment.present() ? lights.environment_flux : 0.0f;
  const float local_flux = local ? lights.local_flux : 0.0f;
  const float total = local_flux + directional_flux + environment_flux;
  if (!(total > 0)) return {};
  const float groups = (local_flux > 0 ? 1.0f : 0.0f) + (directional_flux > 0 ? 1.0f : 0.0f) +
                       (environment_flux > 0 ? 1.0f : 0.0f);
  const auto share = [&](float flux) { return flux > 0 ? 0.5f * flux / total + 0.5f / groups : 0.0f; };
  return {share(local_flux), share(directional_flux), share(environment_flux)};
}

// Walks down `start` for the first `count` points.
LUMI_HD inline void sample_trees(const LightTreeView& tree, Subtree start, const WalkPoints& points, int count,
                                 TreeSample* samples) {
  if (tree.count == 0) {
    for (int i = 0; i < count; ++i) samples[i] = {};
    return;
  }
  with_width(tree.width, [&](auto w) { sample_light_tree<w>(tree, start, points, count, samples); });
}

// Emitters below `start`, through the trees of meshes where there are any.
LUMI_HD inline void sample_emitters(const LightSampler& sampler, const TreeStart& start, const WalkPoints& points,
                                    int count, TreeSample* samples) {
  if (start.instance != kNoId) {
    sample_one_mesh(sampler.mesh_trees, start, points, count, samples);
    return;
  }
  sample_trees(sampler.tree, start.subtree, points, count, samples);
  if (sampler.mesh_trees.present()) sample_mesh_trees(sampler.mesh_trees, points, count, samples);
}

LUMI_HD inline TreeSample sample_tree(const LightTreeView& tree, vec3 x, vec3 n, vec2 u) {
  WalkPoints points;
  points.set(0, x, n, u);
  TreeSample sample;
  sample_trees(tree, whole_tree(tree), points, 1, &sample);
  return sample;
}

LUMI_HD inline float pdf_tree(const LightTreeView& tree, Subtree start, vec3 x, vec3 n, std::uint32_t emitter) {
  if (tree.count == 0) return 0;
  return with_width(tree.width, [&](auto w) { return pdf_light_tree<w>(tree, start, x, n, emitter); });
}

LUMI_HD inline float pdf_two_level_tree(const LightSampler& sampler, const TreeStart& start, vec3 x, vec3 n,
                                        std::uint32_t emitter) {
  if (sampler.tree.count == 0) return 0;
  return with_width(sampler.tree.width, [&](auto w) {
    return pdf_mesh_trees<w>(sampler.tree, sampler.mesh_trees, sampler.lights, start, x, n, emitter);
  });
}

// Probability with which walks from `start` return `emitter`; 0 if it is not below. kTree and kBvh.
LUMI_HD inline float pdf_emitter_below(const LightSampler& sampler, const TreeStart& start, vec3 x, vec3 n,
                                       std::uint32_t emitter) {
  if (sampler.choice == LightChoice::kBvh)
    return pdf_light_bvh(sampler.bvh, entry_of_subtree(start.subtree), x, n, emitter);
  if (sampler.mesh_trees.present()) return pdf_two_level_tree(sampler, start, x, n, emitter);
  return pdf_tree(sampler.tree, start.subtree, x, n, emitter);
}

// One local emitter; pdf 0 when there is none to choose. u.x, u.y are used up.
LUMI_HD inline TreeSample choose_emitter(const LightSampler& sampler, const Surface& surface, vec2 u) {
  const std::uint32_t n = static_cast<std::uint32_t>(sampler.lights.emitters.size());
  switch (sampler.choice) {
    case LightChoice::kUniform: {
      const std::uint32_t i = static_cast<std::uint32_t>(static_cast<double>(u.x) * n);
      return {i < n ? i : n - 1, 1.0f / static_cast<float>(n)};
    }
    case LightChoice::kPower: {
      const std::uint32_t i = sample_alias(sampler.alias, u.x, u.y);
      return {i, sampler.alias.pdf(emitter_flux(sampler.lights, i))};
    }
    case LightChoice::kTree: {
      WalkPoints points;
      points.set(0, surface.position, surface.normal, u);
      TreeSample sample;
      sample_emitters(sampler, {whole_tree(sampler.tree)}, points, 1, &sample);
      return sample;
    }
    case LightChoice::kBvh:
      return sample_light_bvh(sampler.bvh, kBvhRoot, surface.position, surface.normal, u);
    case LightChoice::kOne:
      break;
  }
  return {sampler.one, 1};
}

// Probability with which choose_emitter returns `emitter` here.
LUMI_HD inline float pdf_choose_emitter(const LightSampler& sampler, const Surface& surface,
                                        std::uint32_t emitter) {
  switch (sampler.choice) {
    case LightChoice::kUniform:
      return 1.0f / static_cast<float>(sampler.lights.emitters.size());
    case LightChoice::kPower:
      return sampler.alias.pdf(emitter_flux(sampler.lights, emitter));
    case LightChoice::kTree:
      return pdf_emitter_below(sampler, {whole_tree(sampler.tree)}, surface.position, surface.normal, emitter);
    case LightChoice::kBvh:
      return pdf_light_bvh(sampler.bvh, kBvhRoot, surface.position, surface.normal, emitter);
    case LightChoice::kOne:
      break;
  }
  return sampler.one == emitter ? 1.0f : 0.0f;
}

// Inlined, as the light's point is: handed over in memory, its parts would be read before they are all written.
LUMI_HD LUMI_ALWAYS_INLINE LightSample local_sample(const LightSampler& sampler, const Surface& surface,
                                        TreeSample chosen, vec2 u) {
  LightSample sample;
  if (!(chosen.pdf > 0)) return sample;
  const EmitterPoint point =
      sample_emitter_point(sampler.scene, sampler.lights, chosen.emitter, surface.position, u);
  if (!(max_component(point.incident) > 0)) return sample;
  sample.wi = point.wi;
  sample.distance = point.distance;
  sample.emitter = chosen.emitter;
  const Emitter& emitter = sampler.lights.emitters[chosen.emitter];
  if (!emitter.triangle()) {
    sample.weight = point.incident / chosen.pdf;
    if (emitter.vpl()) {
      sample.from_vpl = true;
      sample.gloss = vpls_light_gloss(sampler.vpl_gloss, sampler.vpl_mirror_roughness, surface);
      sample.clear = point.clear;
    }
  } else {
    sample.pdf = chosen.pdf * point.area_to_solid / triangle_area(emitter);
    sample.weight = point.incident / sample.pdf;
  }
  return sample;
}

LUMI_HD inline LightSample directional_sample(const DirectionalView& light, float probability) {
  LightSample sample;
  sample.wi = -light.direction;
  sample.distance = kInfinity;
  sample.weight = light.irradiance / probability;
  return sample;
}

LUMI_HD inline LightSample environment_sample(const LightSampler& sampler, const Surface& surface,
                                              float probability, vec2 u) {
  LightSample sample;
  const EnvironmentSample drawn = sample_environment(sampler.lights.environment, surface.normal, u);
  if (!(drawn.pdf > 0)) return sample;
  sample.wi = drawn.wi;
  sample.distance = kInfinity;
  sample.pdf = drawn.pdf * probability;
  sample.weight = environment_radiance(sampler.scene, sampler.lights.environment, drawn.wi) / sample.pdf;
  return sample;
}

// Light number `one` of the exhaustive sum: every light once, a random point on it.
LUMI_HD inline LightSample one_sample(const LightSampler& sampler, const Surface& surface, vec2 u) {
  const std::uint32_t local = static_cast<std::uint32_t>(sampler.lights.emitters.size());
  if (sampler.one < local) return local_sample(sampler, surface, {sampler.one, 1}, u);
  const std::uint32_t at_infinity = sampler.one - local;
  if (at_infinity < sampler.lights.directional.size())
    return directional_sample(sampler.lights.directional[at_infinity], 1);
  return environment_sample(sampler, surface, 1, u);
}

enum class LightGroup : std::uint8_t { kDark, kLocal, kDirectional, kEnvironment };

struct ChosenGroup {
  LightGroup group = LightGroup::kDark;
  float probability = 0;
  float r = 0;  // uniform in [0,1) for the choice within the group
};

LUMI_HD inline ChosenGroup choose_group(const LightSampler& sampler, const Surface& surface, float r) {
  const GroupProbabilities p = group_probabilities(sampler, surface);
  const auto choose = [&](LightGroup group, float probability) {
    return ChosenGroup{group, probability, glm::min(r / probability, 0x1.fffffep-1f)};
  };
  if (r < p.local) return choose(LightGroup::kLocal, p.local);
  r -= p.local;
  if (r < p.directional) return choose(LightGroup::kDirectional, p.directional);
  r -= p.directional;
  if (p.environment > 0) return choose(LightGroup::kEnvironment, p.environment);
  return {};
}

// The same where local lights are sampled besides.
LUMI_HD inline ChosenGroup choose_group_at_infinity(const LightSampler& sampler, const Surface& surface, float r) {
  const GroupProbabilities p = group_probabilities(sampler, surface);
  const float both = p.directional + p.environment;
  if (!(both > 0)) return {};
  const float share = p.directional / both;
  if (!(p.environment > 0) || r < share) return {LightGroup::kDirectional, share, glm::min(r / share, 0x1.fffffep-1f)};
  return {LightGroup::kEnvironment, 1 - share, 0};
}

LUMI_HD inline float directional_weight(const DirectionalView& light, const Surface& surface) {
  return luminance(light.irradiance) * glm::max(0.0f, -glm::dot(light.direction, surface.normal));
}
LUMI_HD inline float sum_of_directional_weights(const LightSampler& sampler, const Surface& surface) {
  float total = 0;
  for (const DirectionalView& light : sampler.lights.directional) total += directional_weight(light, surface);
  return total;
}

// One of the directional lights in front of the surface, by irradiance times cosine; kNoEmitter if there is none.
LUMI_HD inline std::uint32_t choose_directional(const LightSampler& sampler, const Surface& surface, float r) {
  float rest = r * sum_of_directional_weights(sampler, surface);
  std::uint32_t chosen = kNoEmitter;
  for (std::uint32_t i = 0; i < sampler.lights.directional.size(); ++i) {
    const float weight = directional_weight(sampler.lights.directional[i], surface);
    if (!(weight > 0)) continue;
    chosen = i;
    if (rest < weight) break;
    rest -= weight;
  }
  return chosen;
}

// Probability with which choose_directional returns light number `index`.
LUMI_HD inline float pdf_directional(const LightSampler& sampler, const Surface& surface, std::uint32_t index) {
  const float total = sum_of_directional_weights(sampler, surface);
  return total > 0 ? directional_weight(sampler.lights.directional[index], surface) / total : 0.0f;
}

LUMI_HD inline LightSample sample_directional(const LightSampler& sampler, const Surface& surface,
                                              const ChosenGroup& group) {
  const std::uint32_t chosen = choose_directional(sampler, surface, group.r);
  if (chosen == kNoEmitter) return {};
  return directional_sample(sampler.lights.directional[chosen],
                            group.probability * pdf_directional(sampler, surface, chosen));
}

// The light of a group. `chosen` is choose_emitter's answer for group.r, used by local lights only.
LUMI_HD LUMI_ALWAYS_INLINE LightSample light_in_group(const LightSampler& sampler, const Surface& surface,
                                          const ChosenGroup& group, TreeSample chosen, vec2 u_point) {
  switch (group.group) {
    case LightGroup::kLocal:
      chosen.pdf *= group.probability;
      return local_sample(sampler, surface, chosen, u_point);
    case LightGroup::kDirectional:
      return sample_directional(sampler, surface, group);
    case LightGroup::kEnvironment:
      return environment_sample(sampler, surface, group.probability, u_point);
    case LightGroup::kDark:
      break;
  }
  return {};
}

// Draws a light and a point on it. u.x: group and light, u.y and u.z: point, u.w: light (second number).
LUMI_HD inline LightSample sample_light(const LightSampler& sampler, const Surface& surface, vec4 u) {
  const vec2 u_point(u.y, u.z);
  if (sampler.choice == LightChoice::kOne) return one_sample(sampler, surface, u_point);
  const ChosenGroup group = choose_group(sampler, surface, u.x);
  TreeSample chosen;
  if (group.group == LightGroup::kLocal) chosen = choose_emitter(sampler, surface, vec2(group.r, u.w));
  return light_in_group(sampler, surface, group, chosen, u_point);
}

// Density per solid angle with which sample_light finds point `y` of `emitter` from `surface`.
LUMI_HD inline float pdf_light(const LightSampler& sampler, const Surface& surface, std::uint32_t emitter,
                               vec3 y) {
  const float p = group_probabilities(sampler, surface).local;
  if (!(p > 0)) return 0;
  return p * pdf_choose_emitter(sampler, surface, emitter) *
         pdf_emitter_point(sampler.lights, emitter, surface.position, y);
}

// The same for the environment in direction `wi`.
LUMI_HD inline float pdf_light_environment(const LightSampler& sampler, const Surface& surface, vec3 wi) {
  const float p = group_probabilities(sampler, surface).environment;
  return p > 0 ? p * pdf_environment(sampler.lights.environment, surface.normal, wi) : 0.0f;
}

// And where one of the lights at infinity is drawn beside the local ones.
LUMI_HD inline float pdf_environment_beside_local(const LightSampler& sampler, const Surface& surface, vec3 wi) {
  const GroupProbabilities p = group_probabilities(sampler, surface);
  if (!(p.environment > 0)) return 0;
  const float directional_share = p.directional / (p.directional + p.environment);
  return (1 - directional_share) * pdf_environment(sampler.lights.environment, surface.normal, wi);
}

// Radiance that a light sample sends towards wo if nothing is in between.
LUMI_HD LUMI_ALWAYS_INLINE vec3 unoccluded_light(const Surface& surface, const LightSample& sample) {
  if (!(max_component(sample.weight) > 0)) return vec3(0);
  const float cosine = glm::dot(surface.normal, sample.wi);
  if (!(cosine > 0)) return vec3(0);
  return (sample.gloss ? bsdf_eval(surface, sample.wi) : bsdf_eval_diffuse(surface, sample.wi)) * sample.weight * cosine;
}

// Segment from the surface to the light sample; it stops short of the light by the same relative margin
// everywhere.
LUMI_HD inline Ray shadow_ray(const Surface& surface, const LightSample& sample, float diagonal) {
  Ray ray;
  const float side = glm::dot(sample.wi, surface.geometric_normal) >= 0 ? 1.0f : -1.0f;
  ray.origin = surface.position + surface.geometric_normal * (side * surface.epsilon);
  ray.tmin = 0;
  if (sample.distance == kInfinity) {
    ray.direction = sample.wi * (2 * diagonal);
    ray.tmax = 1;
    return ray;
  }
  if (sample.from_vpl) {
    ray.direction = sample.clear - ray.origin;
    ray.tmax = 1;
    return ray;
  }
  // Aim at the light from the moved origin, or a point at grazing angles would see past its own occluder.
  ray.direction = surface.position + sample.wi * sample.distance - ray.origin;
  ray.tmax = 1 - glm::min(0.5f, 1e-4f + surface.epsilon / sample.distance);
  return ray;
}

}  // namespace lumigrove
