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

// Enough that the few walks for gloss fill batches of their own.
inline constexpr int kSurfacesPerCall = kSubstituteWalks == 1 ? 1 : 1024;

// Which half of a corrected sample is drawn (VplSampler::correction).
enum class CorrectionPart : std::uint8_t { kSubstitute, kLeaf };

// surfaces[i] -> shadow[i], contribution[i] (radiance towards wo if unoccluded). Rays that carry nothing are marked
// untraced. One call does kSurfacesPerCall surfaces, so that their walks down the tree go together.
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
    const std::size_t first = static_cast<std::size_t>(batch) * kSurfacesPerCall;
    const std::size_t count = glm::min<std::size_t>(kSurfacesPerCall, surfaces.size() - first);
    if (sampler.choice == VplChoice::kTree) {
      light_by_walks(first, count);
      return;
    }
    for (std::size_t i = first; i < first + count; ++i) {
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
    return surfaces[i].instance != kNoId;
  }

  // Walks that wait until there are enough to go together.
  struct Walks {
    SubstituteWalkPoints points;
    std::size_t index[kSubstituteWalks];
    float scale[kSubstituteWalks];
    int count = 0;

    LUMI_HD void add(std::size_t i, const Surface& surface, vec4 u, float probability, bool gloss) {
      points.set(count, surface, vec3(u.y, u.z, u.w), gloss);
      scale[count] = 1 / probability;
      index[count++] = i;
    }
    LUMI_HD bool full() const { return count == kSubstituteWalks; }
  };

  // One lobe is lit a surface; the walks of each lobe go together.
  LUMI_HD void light_by_walks(std::size_t first, std::size_t count) const {
    Walks diffuse, gloss;
    for (std::size_t i = first; i < first + count; ++i) {
      if (!lights_up(i)) continue;
      const Surface& surface = surfaces[i];
      const vec4 u = random_numbers(i, 0);
      const float p = diffuse_walk_probability(sampler, surface);
      if (u.x < p)
        diffuse.add(i, surface, u, p, false);
      else
        gloss.add(i, surface, u, 1 - p, true);
      if (diffuse.full()) light<false>(diffuse);
      if (gloss.full()) light<true>(gloss);
    }
    if (diffuse.count > 0) light<false>(diffuse);
    if (gloss.count > 0) light<true>(gloss);
  }

  // Lights the surfaces of the walks and leaves none.
  template <bool kGloss>
  LUMI_HD LUMI_ALWAYS_INLINE void light(Walks& walks) const {
    SubstituteWalk walk = sampler.walk;
    walk.substitutes = walk.substitutes && part == CorrectionPart::kSubstitute;
    const int count = walk.tree.count > 0 ? walks.count : 0;
    walks.count = 0;
    if (count == 0) return;
    SubstituteWalkState state;
    walk_to_ends<kGloss>(walk, walks.points, count, state);
    prefetch_ends(walk.tree, state, count);
    alignas(64) float gaussian[4][kSubstituteWalks] = {}, weight[kSubstituteWalks] = {};
    const std::size_t* index = walks.index;
    for (int k = 0; k < count; ++k) {
      const bool substitute = end_of_walk(state, k) == WalkEnd::kSubstitute;
      weight[k] = scale * walks.scale[k] * correct(index[k], substitute);
      if (!substitute) continue;
      const vec4 u = random_numbers(index[k], 1);
      for (int axis = 0; axis < 4; ++axis) gaussian[axis][k] = u[axis];
    }
    for (int first = 0; first < count; first += kWalkLanes)
      finish_group<kGloss>(walk, walks.points, state, first, glm::min(count - first, kWalkLanes), gaussian, weight,
                           index);
  }

  LUMI_HD LUMI_ALWAYS_INLINE void prefetch_ends(const SubstituteTreeView& tree, const SubstituteWalkState& state,
                                                int count) const {
    for (int k = 0; k < count; ++k) {
      if ((state.flags[k] & ChildRecord::kLeaf) != 0)
        prefetch(tree.leaves + state.child[k]);
      else
        prefetch(tree.distributions + state.child[k]);
    }
    for (int k = 0; k < count; ++k)
      if ((state.flags[k] & ChildRecord::kLeaf) != 0) prefetch(&tree.leaf(state.child[k]));
  }

  template <bool kGloss>
  LUMI_HD LUMI_ALWAYS_INLINE void finish_group(const SubstituteWalk& walk, const SubstituteWalkPoints& points,
                                               const SubstituteWalkState& state, int first, int count,
                                               const float (&gaussian)[4][kSubstituteWalks], const float* weight,
                                               const std::size_t* index) const {
    constexpr int L = kWalkLanes;
    Lanes<L> u[4];
    for (int k = 0; k < 4; ++k) u[k] = load_lanes<L>(gaussian[k] + first);
    LightLanes<L> light = draw_lights<L>(walk, state, first, u);
    const Lanes<L> scales = load_lanes<L>(weight + first);
    light.intensity = {light.intensity.x * scales, light.intensity.y * scales, light.intensity.z * scales};
    if (!traces.empty()) note(walk, state, first, count, light, index);
    if constexpr (kGloss)
      write_gloss(light, first, count, index);
    else
      write_lit<L>(light_diffuse_lobes<L>(sampler, points, first, light), count, index + first, shadow, contribution);
  }

  LUMI_HD LUMI_ALWAYS_INLINE void write_gloss(const LightLanes<kWalkLanes>& light, int first, int count,
                                              const std::size_t* index) const {
    const DrawnLights drawn(light);
    for (int k = 0; k < count; ++k) {
      if (!(drawn.alive[k] > 0)) continue;
      VplPoint point = drawn.point(k);
      if (drawn.substitute[k] > 0) point.skip = sampler.substitute_offset;
      write(index[first + k], point, Lobes::kGloss);
    }
  }

  // LightLanes one by one.
  struct DrawnLights {
    float position[3][kWalkLanes], normal[3][kWalkLanes], intensity[3][kWalkLanes], free_position[3][kWalkLanes];
    float epsilon[kWalkLanes], substitute[kWalkLanes], alive[kWalkLanes];

    LUMI_HD explicit DrawnLights(const LightLanes<kWalkLanes>& light) {
      store(light.position, position);
      store(light.normal, normal);
      store(light.intensity, intensity);
      store(light.free_position, free_position);
      store_lanes<kWalkLanes>(light.epsilon, epsilon);
      store_lanes<kWalkLanes>(light.substitute, substitute);
      store_lanes<kWalkLanes>(light.alive, alive);
    }
    LUMI_HD static void store(const LaneVec3<kWalkLanes>& from, float (&to)[3][kWalkLanes]) {
      store_lanes<kWalkLanes>(from.x, to[0]);
      store_lanes<kWalkLanes>(from.y, to[1]);
      store_lanes<kWalkLanes>(from.z, to[2]);
    }
    LUMI_HD static vec3 at(const float (&from)[3][kWalkLanes], int k) {
      return vec3(from[0][k], from[1][k], from[2][k]);
    }
    LUMI_HD VplPoint point(int k) const {
      return {at(position, k), at(normal, k), at(intensity, k), epsilon[k], 0};
    }
  };

  // Weight of this part of S + (L - S) / q.
  LUMI_HD float correct(std::size_t i, bool substitute) const {
    if (part == CorrectionPart::kLeaf) return 1 / sampler.correction;
    if (corrected.empty()) return 1;
    corrected[i] = substitute && random_numbers(i, 2).x < sampler.correction ? 1 : 0;
    return corrected[i] ? 1 - 1 / sampler.correction : 1.0f;
  }

  LUMI_HD void note(const SubstituteWalk& walk, const SubstituteWalkState& state, int first, int count,
                    const LightLanes<kWalkLanes>& light, const std::size_t* index) const {
    const DrawnLights drawn(light);
    for (int k = 0; k < count; ++k) {
      const std::size_t i = index[first + k];
      const WalkResult result = walk_result(walk, state, first + k);
      VplTrace& trace = traces[i];
      trace = {static_cast<float>(result.steps), 0, false, false, false};
      if (result.end == WalkEnd::kDead) continue;
      const VplPoint point = drawn.point(k);
      if (result.end == WalkEnd::kSubstitute) {
        trace.size = result.box.diagonal();
        trace.substitute = true;
        trace.boxed = DrawnLights::at(drawn.free_position, k) != point.position;
      }
      const vec3 to_surface = surfaces[i].position - point.position;
      const float d2 = length_squared(to_surface);
      trace.clamped = glm::dot(to_surface, point.normal) > sampler.clamp * d2 * glm::sqrt(d2);
    }
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
LUMI_HD inline int indirect_batches(int surfaces) { return (surfaces + kSurfacesPerCall - 1) / kSurfacesPerCall; }

}  // namespace lumigrove
