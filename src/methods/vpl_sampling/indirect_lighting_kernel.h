// Kernels of light from virtual point lights: one sample for each surface. Its addition once the shadow rays are
// answered is AddUnoccludedKernel. The estimator and its header block are in vpl_sampler_kernel.h.
#pragma once

#include <span>

#include "base/rng.h"
#include "methods/vpl_sampling/vpl_sampler_kernel.h"

namespace lumigrove {

// What a sample did, for those who look at the method itself.
struct VplTrace {
  float steps = 0;         // of the walk
  float size = 0;          // diagonal of the box of the substitute, metres; 0 for a leaf
  bool substitute = false;
  bool boxed = false;      // the substitute's point was moved to the box
  bool clamped = false;    // cos / d^2 was above G_max
};

// Numbers of a sample, from the first dimension on: lobe and walk; Gaussian; correction.
inline constexpr std::uint32_t kDimensionsPerVplSample = 12;

// Which half of a corrected sample is drawn (VplSampler::correction).
enum class CorrectionPart : std::uint8_t { kSubstitute, kLeaf };

// surfaces[i] -> shadow[i], contribution[i] (radiance towards wo if unoccluded). Rays that carry nothing are marked
// untraced. One call does kSubstituteWalks surfaces, so that their walks down the tree go together.
struct IndirectLightKernel {
  VplSampler sampler;
  Rng rng;
  std::uint32_t dimension;
  float scale;  // 1 / samples
  CorrectionPart part;
  std::span<const Surface> surfaces;
  std::span<const std::uint32_t> pixels;
  std::span<Ray> shadow;
  std::span<vec3> contribution;
  std::span<std::uint8_t> corrected;  // set by part kSubstitute for part kLeaf; empty without correction
  std::span<VplTrace> traces;         // empty: not wanted

  LUMI_HD void operator()(int batch) const {
    const std::size_t first = static_cast<std::size_t>(batch) * kSubstituteWalks;
    const int count = static_cast<int>(glm::min<std::size_t>(kSubstituteWalks, surfaces.size() - first));
    if (sampler.choice == VplChoice::kTree) {
      light_by_walks(first, count);
      return;
    }
    for (int k = 0; k < count; ++k) {
      const std::size_t i = first + static_cast<std::size_t>(k);
      if (!lights_up(i)) continue;
      const vec4 u = random_numbers(i, 0);
      const ChosenVpl chosen = choose_vpl(sampler, vec2(u.x, u.y));
      if (!(chosen.pdf > 0)) continue;
      write(i, exact_vpl(sampler.lights.vpls[chosen.index], scale / chosen.pdf),
            lights_gloss(sampler, surfaces[i]) ? Lobes::kBoth : Lobes::kDiffuse);
    }
  }

 private:
  LUMI_HD vec4 random_numbers(std::size_t i, std::uint32_t block) const {
    return Rng{rng.seed, rng.frame, pixels[i]}.uniform4(dimension + 4 * block);
  }

  // Marks the outputs as carrying nothing; is there a surface to light?
  LUMI_HD bool lights_up(std::size_t i) const {
    shadow[i].tmax = -1;
    contribution[i] = vec3(0);
    if (part == CorrectionPart::kLeaf && !corrected[i]) return false;
    return surfaces[i].instance != kNone;
  }

  // One lobe is lit a surface; the walks of each lobe go together.
  LUMI_HD void light_by_walks(std::size_t first, int count) const {
    SubstituteWalkPoints diffuse, gloss;
    std::size_t diffuse_index[kSubstituteWalks], gloss_index[kSubstituteWalks];
    float diffuse_scale[kSubstituteWalks], gloss_scale[kSubstituteWalks];
    int diffuse_count = 0, gloss_count = 0;
    for (int k = 0; k < count; ++k) {
      const std::size_t i = first + static_cast<std::size_t>(k);
      if (!lights_up(i)) continue;
      const Surface& surface = surfaces[i];
      const vec4 u = random_numbers(i, 0);
      const float p = diffuse_walk_probability(sampler, surface);
      if (u.x < p) {
        diffuse.set(diffuse_count, surface, vec3(u.y, u.z, u.w), false);
        diffuse_scale[diffuse_count] = scale / p;
        diffuse_index[diffuse_count++] = i;
      } else {
        gloss.set(gloss_count, surface, vec3(u.y, u.z, u.w), true);
        gloss_scale[gloss_count] = scale / (1 - p);
        gloss_index[gloss_count++] = i;
      }
    }
    finish<false>(diffuse, diffuse_count, diffuse_index, diffuse_scale);
    if (gloss_count > 0) finish<true>(gloss, gloss_count, gloss_index, gloss_scale);
  }

  template <bool kGloss>
  LUMI_HD LUMI_ALWAYS_INLINE void finish(const SubstituteWalkPoints& points, int count, const std::size_t* index,
                                         const float* lobe_scale) const {
    SubstituteWalk walk = sampler.walk;
    walk.substitutes = walk.substitutes && part == CorrectionPart::kSubstitute;
    WalkResult results[kSubstituteWalks];
    walk_substitute_tree<kGloss>(walk, points, count, results);
    for (int k = 0; k < count; ++k) prefetch_end(results[k]);
    for (int k = 0; k < count; ++k) {
      const std::size_t i = index[k];
      const WalkResult& result = results[k];
      if (!traces.empty()) traces[i] = {static_cast<float>(result.steps), 0, false, false, false};
      if (result.end == WalkEnd::kDead) continue;
      const bool substitute = result.end == WalkEnd::kSubstitute;
      VplPoint light = vpl_of_walk(sampler, result, substitute ? random_numbers(i, 1) : vec4(0));
      light.intensity *= lobe_scale[k] * correct(i, substitute);
      if (!traces.empty()) note(i, result, light);
      write(i, light, kGloss ? Lobes::kGloss : Lobes::kDiffuse);
    }
  }

  LUMI_HD LUMI_ALWAYS_INLINE void prefetch_end(const WalkResult& result) const {
    if (result.end == WalkEnd::kLeaf) {
      prefetch(&sampler.walk.tree.leaf(result.node));
    } else if (result.end == WalkEnd::kSubstitute) {
      prefetch(sampler.walk.tree.distributions + result.node);
    }
  }

  // Weight of this part of S + (L - S) / q.
  LUMI_HD float correct(std::size_t i, bool substitute) const {
    if (part == CorrectionPart::kLeaf) return 1 / sampler.correction;
    if (corrected.empty()) return 1;
    corrected[i] = substitute && random_numbers(i, 2).x < sampler.correction ? 1 : 0;
    return corrected[i] ? 1 - 1 / sampler.correction : 1.0f;
  }

  LUMI_HD void note(std::size_t i, const WalkResult& result, const VplPoint& light) const {
    VplTrace& trace = traces[i];
    trace.substitute = result.end == WalkEnd::kSubstitute;
    if (trace.substitute) {
      trace.size = result.box.diagonal();
      const vec3 p = light.position;
      for (int axis = 0; axis < 3; ++axis)
        trace.boxed = trace.boxed || ((p[axis] == result.box.lo[axis] || p[axis] == result.box.hi[axis]) &&
                                      result.box.lo[axis] < result.box.hi[axis]);
    }
    const vec3 to_surface = surfaces[i].position - light.position;
    const float d2 = length_squared(to_surface);
    trace.clamped = glm::dot(to_surface, light.normal) > sampler.clamp * d2 * glm::sqrt(d2);
  }

  LUMI_HD void write(std::size_t i, const VplPoint& light, Lobes lobes) const {
    const vec3 sent = vpl_light(surfaces[i], light, sampler.clamp, lobes);
    // A corrected sample may be negative.
    if (!(length_squared(sent) > 0)) return;
    contribution[i] = sent;
    shadow[i] = vpl_shadow_ray(surfaces[i], light);
  }
};

// Calls of an IndirectLightKernel for so many surfaces.
LUMI_HD inline int indirect_batches(int surfaces) { return (surfaces + kSubstituteWalks - 1) / kSubstituteWalks; }

}  // namespace lumigrove
