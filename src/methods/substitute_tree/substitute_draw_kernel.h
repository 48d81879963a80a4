// Draws lights from what walks down a substitute tree ended at: a leaf's light as it is, a substitute's from its Gaussian.
// The method and its header block are in substitute_walk_kernel.h.
//
// A Gaussian point is mean + C xi, with C the Cholesky factor of the covariance and xi three standard normal numbers (Box,
// Muller 1958), clamped to the box of the lights (the paper's section 4.2). A leaf is a Gaussian without covariance.
#pragma once

#include "base/lane_math.h"
#include "methods/substitute_tree/substitute_walk_kernel.h"

namespace lumigrove {

template <int L>
struct LightLanes {
  LaneVec3<L> position, normal, intensity;  // W/sr along the normal, divided by the probability of the walk
  Lanes<L> epsilon;                         // of a leaf's light; 0 for a substitute
  Lanes<L> substitute;                      // 1 or 0
  Lanes<L> alive;                           // 1, or 0 for a dead branch: then nothing else means anything
  LaneVec3<L> free_position;                // before it was clamped to the box
};

// words[w][lane] = word w of what the lane's walk ended at, a Vpl or a Distribution.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE void load_ends(const SubstituteWalk& walk, const SubstituteWalkState& state, int first,
                                          Lanes<L> (&words)[16]) {
  constexpr int kVplWords = sizeof(Vpl) / sizeof(float), kDistributionWords = sizeof(Distribution) / sizeof(float);
  static_assert(kDistributionWords == 16);
  const SubstituteTreeView& tree = walk.tree;
  LUMI_UNROLL(2)
  for (int part = 0; part < kDistributionWords; part += L) {
    LUMI_UNROLL(16)
    for (int i = 0; i < L; ++i) {
      const WalkEnd end = end_of_walk(state, first + i);
      const bool leaf = end != WalkEnd::kSubstitute;
      const void* from = leaf ? static_cast<const void*>(&tree.leaf(end == WalkEnd::kLeaf ? state.child[first + i] : 0))
                              : static_cast<const void*>(tree.distributions + state.child[first + i]);
      const int count = glm::clamp((leaf ? kVplWords : kDistributionWords) - part, 0, L);
      words[part + i] = load_first_lanes<L>(static_cast<const float*>(from) + part, count);
    }
    transpose_lanes<L>(words + part);
  }
}

template <int L>
struct BoxCorners {
  LaneVec3<L> lo, hi;
};

// Of the boxes that hold the ends' lights.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE BoxCorners<L> load_end_boxes(const SubstituteWalk& walk, const SubstituteWalkState& state,
                                                        int first) {
  if (state.at_root) return {broadcast<L>(walk.tree.bounds.lo), broadcast<L>(walk.tree.bounds.hi)};
  constexpr int kWords = sizeof(ChildRecord) / sizeof(float), kRows = kWords < L ? L : kWords;
  Lanes<L> words[kRows];
  for (int part = 0; part < kRows; part += L) {
    for (int i = 0; i < L; ++i) {
      const auto* record = reinterpret_cast<const float*>(&record_of_end(walk, state, first + i));
      words[part + i] = load_first_lanes<L>(record + part, glm::min(kWords - part, L));
    }
    transpose_lanes<L>(words + part);
  }
  const LaneVec3<L> extent = unpack_extents<L>(bits_of<L>(words[3]), bits_of<L>(words[4]));
  return {{words[0], words[1], words[2]}, {words[0] + extent.x, words[1] + extent.y, words[2] + extent.z}};
}

// Three independent standard normal numbers from four uniform ones.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> standard_normal(const Lanes<L> (&u)[4]) {
  const Lanes<L> tiny = broadcast<L>(1e-12f);
  const auto radius = [&](const Lanes<L>& v) {
    const Lanes<L> squared = -2.0f * log_lanes<L>(max_lanes<L>(1.0f - v, tiny));
    return squared * inverse_sqrt<L>(max_lanes<L>(squared, tiny));
  };
  const Lanes<L> r0 = radius(u[0]), r1 = radius(u[2]);
  Lanes<L> sine, cosine, unused, other;
  sine_cosine_of_turns<L>(u[1], sine, cosine);
  sine_cosine_of_turns<L>(u[3], unused, other);
  return {r0 * cosine, r0 * sine, r1 * other};
}

// C xi, for the covariance xx, yy, zz, xy, xz, yz. Directions without variance stay without.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> correlate(const Lanes<L>* covariance, const LaneVec3<L>& xi) {
  const Lanes<L> zero = broadcast<L>(0), tiny = broadcast<L>(1e-30f);
  const auto inverse_root = [&](const Lanes<L>& variance) {
    return choose_where_greater<L>(variance, tiny, inverse_sqrt<L>(max_lanes<L>(variance, tiny)), zero);
  };
  const Lanes<L> xx = covariance[0], yy = covariance[1], zz = covariance[2], xy = covariance[3], xz = covariance[4],
                 yz = covariance[5];
  const Lanes<L> inverse_x = inverse_root(xx);
  const Lanes<L> y_x = xy * inverse_x, z_x = xz * inverse_x;
  const Lanes<L> rest_y = max_lanes<L>(yy - y_x * y_x, zero), inverse_y = inverse_root(rest_y);
  const Lanes<L> z_y = (yz - z_x * y_x) * inverse_y;
  const Lanes<L> rest_z = max_lanes<L>(zz - z_x * z_x - z_y * z_y, zero);
  return {xx * inverse_x * xi.x, multiply_add<L>(y_x, xi.x, rest_y * inverse_y * xi.y),
          multiply_add<L>(z_x, xi.x, multiply_add<L>(z_y, xi.y, rest_z * inverse_root(rest_z) * xi.z))};
}

// `u`: uniform numbers, used by substitutes. tree.count > 0.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LightLanes<L> draw_lights(const SubstituteWalk& walk, const SubstituteWalkState& state,
                                                     int first, const Lanes<L> (&u)[4]) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1);
  Lanes<L> words[16];
  load_ends<L>(walk, state, first, words);
  const BoxCorners<L> box = load_end_boxes<L>(walk, state, first);
  const Lanes<L> pdf = load_lanes<L>(state.pdf + first);
  LightLanes<L> light;
  light.alive = choose_where_greater<L>(pdf, zero, one, zero);
  const IntLanes<L> leaf = load_lanes<L>(state.flags + first) & static_cast<std::int32_t>(ChildRecord::kLeaf);
  light.substitute = choose_where_greater<L>(to_float<L>(leaf), zero, zero, light.alive);
  const LaneVec3<L> offset = correlate<L>(words + 10, standard_normal<L>(u));
  light.free_position = {words[0] + offset.x, words[1] + offset.y, words[2] + offset.z};
  light.position = {min_lanes<L>(max_lanes<L>(light.free_position.x, box.lo.x), box.hi.x),
                    min_lanes<L>(max_lanes<L>(light.free_position.y, box.lo.y), box.hi.y),
                    min_lanes<L>(max_lanes<L>(light.free_position.z, box.lo.z), box.hi.z)};
  light.normal = {words[4], words[5], words[6]};
  const Lanes<L> scale = choose_where_greater<L>(pdf, zero, one / pdf, zero);
  light.intensity = {words[7] * scale, words[8] * scale, words[9] * scale};
  light.epsilon = choose_where_greater<L>(light.substitute, zero, zero, words[3]);
  return light;
}

// One point of one distribution, by the same arithmetic.
LUMI_HD inline vec3 sample_distribution(const Distribution& d, const Box3& box, vec4 u) {
  constexpr int L = kWalkLanes;
  Lanes<L> numbers[4], covariance[6];
  for (int k = 0; k < 4; ++k) numbers[k] = broadcast<L>(u[k]);
  for (int k = 0; k < 6; ++k) covariance[k] = broadcast<L>(d.covariance[k]);
  const LaneVec3<L> offset = correlate<L>(covariance, standard_normal<L>(numbers));
  float x[L], y[L], z[L];
  store_lanes<L>(offset.x, x);
  store_lanes<L>(offset.y, y);
  store_lanes<L>(offset.z, z);
  return glm::min(glm::max(d.mean + vec3(x[0], y[0], z[0]), box.lo), box.hi);
}

}  // namespace lumigrove
