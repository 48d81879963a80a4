// Method      Picks emitters by walks down a binary tree whose shape follows the lights, instead of the perfect tree's
//             halves of a Morton order; near the surface the tree is split first, and one walk starts at each part.
// Paper       A. Conty Estevez, C. Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", Proc. ACM
//             CGIT 1(2) (HPG 2018): importance, splitting, builder `saoh`; P. Moreau, M. Pharr, P. Clarberg, "Dynamic
//             Many-Light Sampling for Real-Time Ray Tracing", HPG 2019, for the same in real time. D. Lin, C. Yuksel,
//             "Real-Time Stochastic Lightcuts", Proc. ACM CGIT 3(1) (I3D 2020): 3.2 weights, and trees of both builders as
//             what theirs is compared with; B. Walter et al., "Fast Agglomerative Clustering for Rendering", RT 2008,
//             for the builder `agglomerative`.
//             Formulas of the first are those of implementations that cite its equations (Cycles' branch of 2018,
//             Falcor, pbrt-v4 and section 12.6 of its book), which it was checked against instead of the text.
// Symbols     E -> intensity -> Y of the peak radiant intensity below a child, as a share of all local flux
//             theta_o -> cone -> bounds the emitters' normals; theta_e = pi/2 for every light
//             theta_u -> uncertainty -> half the angle that the sphere around the box spans at x
//             theta_i' , theta' -> angles at the receiver and at the emitters, less what is uncertain
//             a, b -> near, far -> least and greatest distance to the box, in units of the diagonal of the lights' box
//             e, N -> intensity / count, count -> of the emitters below a node; Var[e] from their second moment
//             sigma -> standard deviation of the estimate of all light below a node from one of its lights
// Equations   (3) importance f_a |cos theta_i'| E cos theta' / d^2 with f_a = 1 -> saoh_importance; (8, 9) mean and
//             variance of g = 1 / d^2 with d uniform in [a, b] and (10) sigma^2 = N^2 (Var[e] Var[g] + Var[e] E[g]^2 +
//             E[e]^2 Var[g]) -> split_variance; (1 / (1 + sigma))^(1/4) < threshold -> should_split; cost E M_A M_Omega of
//             each half, times K_r -> saoh_cost, orientation_measure
// Departures  d, to the box's centre, is not below the radius of the box's sphere, inside of which all cosines count as
//             1; theirs is not below half of it, and only where nothing is split (pbrt-v4: d^2 is not below half the
//             box's diagonal, a length). Boxes behind the surface have importance 0 (pbrt-v4: the absolute cosine, for
//             transmission). a and b are to the box, and inside it nodes are always split; theirs: its sphere.
//             K_r compares extents of the lights' centres (pbrt-v4: of their boxes). Intensity and distance in sigma are
//             relative to the lights as a whole, so that a threshold means the same in scenes of any size and
//             brightness. Splitting goes level by level and ends at `cap` nodes; children that cannot contribute are
//             left out of the set. The second random number of a walk takes over once 12 bits of the first are used.
// Estimator   unbiased: every emitter that can contribute at x has positive probability, which is returned exactly; the
//             split set is a partition of all lights that can contribute, the same each time for a point and normal.
// In -> Out   point x, unit normal n, two uniform numbers, entry of the tree -> emitter and probability; kNoEmitter and 0
//             on a dead branch. Point and normal -> split set of entries.
// Oracle      tests/light_bvh_test.cpp: enumeration of pdf_light_bvh, chi-square, sum over split sets against the exhaustive
//             sum, merges against all pairs, boxes and cones against their leaves.
#pragma once

#include <span>

#include "lumigrove/settings.h"
#include "methods/light_tree/light_tree_kernel.h"
#include "scene/surface.h"
#include "trace/ray.h"

namespace lumigrove {

// A link with this bit is an emitter's index, otherwise a node's.
inline constexpr std::uint32_t kBvhLeaf = 0x80000000u;

// Two children. 48 bytes a child.
struct alignas(32) LightBvhNode {
  LightNode<2> bounds;
  std::uint32_t child[2];  // links
  std::uint32_t count[2];  // leaves below each
  float moment[2];         // sum of the squared intensities of the lights below each
  std::uint32_t first;     // number of the first leaf below; those of child 0 come first
  std::uint32_t unused;
};

// Entry 2 node + lane is the child `lane` of a node; entry 0 is the whole tree.
inline constexpr std::uint32_t kBvhRoot = 0;

// An entry as a range of one child, as perfect trees have them, and back.
LUMI_HD inline Subtree subtree_of_entry(std::uint32_t entry) {
  return {entry / 2, 0, static_cast<std::uint8_t>(entry % 2), 1};
}
LUMI_HD inline std::uint32_t entry_of_subtree(Subtree subtree) { return 2 * subtree.node + subtree.first; }

struct LightBvhView {
  const LightBvhNode* nodes = nullptr;             // the first stands above the root, its only child
  const std::uint32_t* emitter_leaves = nullptr;  // emitter -> number of its leaf, kNoEmitter if none
  std::uint32_t count = 0;                         // leaves
  float inside2 = 0;                               // squared distance that counts as inside a box, m^2
  float floor2 = 0;                                // least squared distance in the weights, m^2
  float unit2 = 1;                                 // squared unit of length of the splitting criterion, m^2
  bool cones = true;                               // not kSaoh: weights bound the emitters' own cosine
  Weights weights = Weights::kMinMax;

  LUMI_HD BoxNearness nearness() const { return {inside2, floor2}; }
  LUMI_HD std::uint32_t link(std::uint32_t entry) const { return nodes[entry / 2].child[entry % 2]; }
};

// --- weights -----------------------------------------------------------------------------------------------

struct AngleCosSin {  // of an angle in [0, pi]
  float cos, sin;
};

// The angle a - b, or 0 where b is larger.
LUMI_HD inline AngleCosSin reduce_angle(AngleCosSin a, AngleCosSin b) {
  if (a.cos >= b.cos) return {1, 0};
  return {a.cos * b.cos + a.sin * b.sin, a.sin * b.cos - a.cos * b.sin};
}

LUMI_HD inline AngleCosSin angle_of_cosine(float cosine) {
  const float c = glm::clamp(cosine, -1.0f, 1.0f);
  return {c, glm::sqrt(1 - c * c)};
}

// Bound of the cosine between the emitters' normals and the direction to x, which lies within `uncertainty` of
// `to_surface` (unit).
LUMI_HD inline float bound_emission(PackedCone cone, vec3 to_surface, AngleCosSin uncertainty) {
  const float length2 = length_squared(cone.axis()), width = cone.width();
  if (length2 < 0.25f) return 1;
  const float length = glm::sqrt(length2);
  const float cos_o = (1 + length2 - width * width) / (2 * length);  // |n' - axis| <= width with |n'| = 1
  if (cos_o <= -1) return 1;
  const AngleCosSin theta = angle_of_cosine(glm::dot(cone.axis(), to_surface) / length);
  return reduce_angle(reduce_angle(theta, angle_of_cosine(cos_o)), uncertainty).cos;
}

// Importance of child c for a surface; 0 only if nothing below it can light the surface.
LUMI_HD inline float saoh_importance(const LightNode<2>& node, int c, float floor2, vec3 x, vec3 n) {
  if (!(node.intensity[c] > 0)) return 0;
  const vec3 to_centre = vec3(node.centre_x[c], node.centre_y[c], node.centre_z[c]) - x;
  const vec3 half(node.half_x[c], node.half_y[c], node.half_z[c]);
  const float radius2 = glm::max(length_squared(half), floor2), distance2 = length_squared(to_centre);
  if (!(distance2 > radius2)) return node.intensity[c] / radius2;
  const vec3 direction = to_centre * (1 / glm::sqrt(distance2));
  const float sine2 = radius2 / distance2;
  const AngleCosSin uncertainty{glm::sqrt(1 - sine2), glm::sqrt(sine2)};
  constexpr float kMargin = 2e-5f;  // so that rounding never makes a light at the horizon impossible
  const float receiver = reduce_angle(angle_of_cosine(glm::dot(n, direction)), uncertainty).cos + kMargin;
  if (!(receiver > 0)) return 0;
  const PackedCone cone{node.axis_x[c], node.axis_y[c], node.axis_z[c], node.radius[c]};
  const float emission = bound_emission(cone, -direction, uncertainty) + kMargin;
  if (!(emission > 0)) return 0;
  return node.intensity[c] * receiver * emission / distance2;
}

LUMI_HD inline ChildWeights<2> weigh_children(const LightBvhView& bvh, const LightBvhNode& node, vec3 x, vec3 n) {
  if (bvh.weights != Weights::kSaoh)
    return weigh_children<2>(node.bounds, Weighing{bvh.weights, bvh.cones, bvh.nearness()}, x, n);
  const float weights[2] = {saoh_importance(node.bounds, 0, bvh.floor2, x, n),
                            saoh_importance(node.bounds, 1, bvh.floor2, x, n)};
  const float sums[2] = {weights[0], weights[0] + weights[1]};
  return {load_lanes<2>(weights), load_lanes<2>(sums), sums[1]};
}

// --- walks -------------------------------------------------------------------------------------------------

// Where a walk is.
struct BvhWalk {
  std::uint32_t link = kBvhLeaf;
  float pdf = 0;        // 0: ended on a dead branch
  float r = 0, r2 = 0;  // uniform numbers: for the next choice, and the one that takes over later; below 0 once it has

  LUMI_HD bool ended() const { return (link & kBvhLeaf) != 0; }
};

// Down `entry`; an ended walk where there are no lights.
LUMI_HD inline BvhWalk start_walk(const LightBvhView& bvh, std::uint32_t entry, vec2 u) {
  if (bvh.count == 0) return {};
  return {bvh.link(entry), 1, u.x, u.y};
}

// One step of a walk that has not ended.
LUMI_HD LUMI_ALWAYS_INLINE void step_walk(const LightBvhView& bvh, vec3 x, vec3 n, BvhWalk& walk) {
  constexpr float kWornOut = 0x1p-12f;
  const LightBvhNode& node = bvh.nodes[walk.link];
  const ChildWeights<2> children = weigh_children(bvh, node, x, n);
  if (!(children.total > 0)) {
    walk.link = kBvhLeaf;
    walk.pdf = 0;
    return;
  }
  const ChosenChild chosen = choose_child<2>(children, walk.r);
  walk.pdf *= chosen.probability;
  const bool take_over = walk.pdf < kWornOut && walk.r2 >= 0;
  walk.r = take_over ? walk.r2 : chosen.r;
  if (take_over) walk.r2 = -1;
  walk.link = node.child[chosen.lane];
}

LUMI_HD inline TreeSample end_of_walk(const BvhWalk& walk) {
  return walk.pdf > 0 ? TreeSample{walk.link & ~kBvhLeaf, walk.pdf} : TreeSample{};
}

// One walk down the subtree of `entry`.
LUMI_HD inline TreeSample sample_light_bvh(const LightBvhView& bvh, std::uint32_t entry, vec3 x, vec3 n, vec2 u) {
  BvhWalk walk = start_walk(bvh, entry, u);
  while (!walk.ended()) step_walk(bvh, x, n, walk);
  return end_of_walk(walk);
}

// Probability with which sample_light_bvh returns `emitter`: the same products, multiplied in the same order. 0 for an
// emitter that is not below `entry`.
LUMI_HD inline float pdf_light_bvh(const LightBvhView& bvh, std::uint32_t entry, vec3 x, vec3 n,
                                   std::uint32_t emitter) {
  if (bvh.count == 0) return 0;
  const std::uint32_t leaf = bvh.emitter_leaves[emitter];
  if (leaf == kNoEmitter) return 0;
  std::uint32_t link = bvh.link(entry);
  if ((link & kBvhLeaf) == 0) {
    const LightBvhNode& start = bvh.nodes[link];
    if (leaf < start.first || leaf >= start.first + start.count[0] + start.count[1]) return 0;
  }
  float pdf = 1;
  while ((link & kBvhLeaf) == 0) {
    const LightBvhNode& node = bvh.nodes[link];
    const ChildWeights<2> children = weigh_children(bvh, node, x, n);
    if (!(children.total > 0)) return 0;
    const int lane = leaf < node.first + node.count[0] ? 0 : 1;
    float weights[2];
    store_lanes<2>(children.weight, weights);
    pdf *= weights[lane] / children.total;
    link = node.child[lane];
  }
  return link == (kBvhLeaf | emitter) ? pdf : 0.0f;
}

// --- splitting ---------------------------------------------------------------------------------------------

inline constexpr int kMaxSplit = 64;

struct SplitOptions {
  float threshold = 0;  // 0: no splitting, 1: wherever one light cannot stand for all
  int cap = 16;         // most nodes of a set, at most kMaxSplit
};

// sigma^2 for the lights below an entry; infinite where x is inside its box.
LUMI_HD inline float split_variance(const LightBvhView& bvh, std::uint32_t entry, vec3 x) {
  const LightBvhNode& node = bvh.nodes[entry / 2];
  const LightNode<2>& box = node.bounds;
  const std::uint32_t c = entry % 2;
  const vec3 apart = glm::abs(vec3(box.centre_x[c], box.centre_y[c], box.centre_z[c]) - x);
  const vec3 half(box.half_x[c], box.half_y[c], box.half_z[c]);
  const float near2 = length_squared(glm::max(apart - half, vec3(0))), far2 = length_squared(apart + half);
  if (!(glm::max(near2, bvh.floor2) > bvh.inside2)) return kInfinity;
  const float a = glm::sqrt(glm::max(near2, bvh.floor2) / bvh.unit2),
              b = glm::sqrt(glm::max(far2, bvh.floor2) / bvh.unit2);
  // g = 1 / d^2 with d uniform in [a, b].
  const float mean_g = 1 / (a * b), variance_g = (b - a) * (b - a) * mean_g * mean_g * mean_g * (1.0f / 3);
  const float intensity2 = box.intensity[c] * box.intensity[c];
  const float variance_e = glm::max(0.0f, static_cast<float>(node.count[c]) * node.moment[c] - intensity2);
  return variance_e * (variance_g + mean_g * mean_g) + intensity2 * variance_g;
}

LUMI_HD inline bool should_split(const LightBvhView& bvh, std::uint32_t entry, vec3 x, float threshold) {
  if ((bvh.link(entry) & kBvhLeaf) != 0) return false;
  const float t2 = threshold * threshold;
  return 1 < (1 + glm::sqrt(split_variance(bvh, entry, x))) * (t2 * t2);
}

// The split set: entries whose subtrees hold every light that can contribute at x once. Returns their number.
LUMI_HD inline int split_light_bvh(const LightBvhView& bvh, vec3 x, vec3 n, const SplitOptions& options,
                                   std::uint32_t* entries) {
  if (bvh.count == 0) return 0;
  entries[0] = kBvhRoot;
  int count = 1;
  std::uint64_t settled = 0;
  for (bool changed = true; changed && count < options.cap;) {
    changed = false;
    for (int i = 0, end = count; i < end && count < options.cap; ++i) {
      if (((settled >> i) & 1) != 0) continue;
      settled |= std::uint64_t{1} << i;
      if (!should_split(bvh, entries[i], x, options.threshold)) continue;
      const std::uint32_t link = bvh.link(entries[i]);
      float weights[2];
      store_lanes<2>(weigh_children(bvh, bvh.nodes[link], x, n).weight, weights);
      if (!(weights[0] > 0 || weights[1] > 0)) continue;  // its walk will find the same
      entries[i] = 2 * link + (weights[0] > 0 ? 0u : 1u);
      if (weights[0] > 0 && weights[1] > 0) entries[count++] = 2 * link + 1;
      settled &= ~(std::uint64_t{1} << i);
      changed = true;
    }
  }
  return count;
}

// The split sets of all surfaces: counts[i] entries from entries[i * cap].
struct SplitKernel {
  LightBvhView bvh;
  SplitOptions options;
  std::span<const Surface> surfaces;
  std::span<std::uint32_t> entries;
  std::span<std::uint8_t> counts;

  LUMI_HD void operator()(int i) const {
    const std::size_t k = static_cast<std::size_t>(i);
    const Surface& s = surfaces[k];
    counts[k] = 0;
    if (s.instance == kNoId) return;
    counts[k] = static_cast<std::uint8_t>(split_light_bvh(
        bvh, s.position, s.normal, options, entries.data() + k * static_cast<std::size_t>(options.cap)));
  }
};

}  // namespace lumigrove
