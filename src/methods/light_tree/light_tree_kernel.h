// Method      Picks one emitter out of very many with probability close to its share of the light at a point, by
//             one walk down a perfect tree over the emitters in Morton order.
// Paper       D. Lin, C. Yuksel, "Real-Time Stochastic Lightcuts", Proc. ACM CGIT 3(1) (I3D 2020): 3.1 and 3.2;
//             cosine bound and special cases as in the authors' code (distance 0, dead branches).
// Symbols     I_j -> intensity -> Y of the peak radiant intensity under child j, as a share of all local flux
//             F_j -> cosine -> bound of cos at the receiver over the child's box, no material
//             d_j^min, d_j^max -> near2, far2 -> squared distance from x to the box's nearest / farthest point, m^2
//             p_j -> weight / total -> probability of stepping to child j, given its parent
// Equations   (1) w_j^min, w_j^max and (2) their normalisation, averaged -> weigh_children
// Departures  Nodes have W children (2 is the paper's tree; 4, 8 and 16 weigh their children in one pass over SoA
//             rows, with eqs. 1-2 normalised over W instead of 2). Bogus leaves are not stored, except to fill the
//             last node of a level: their intensity is 0. Emitters of no flux are sorted last and left out. Points
//             closer than 1e-7 D to a box count as inside it. The horizon test has a relative margin of 1e-6, so
//             that rounding never makes a light at the horizon impossible. F_j is the highest corner's height over
//             the nearest distance.
//             With `cones`, weights also have a bound of the emitters' own cosine, which the paper leaves out: half
//             of all samples of closed meshes would otherwise fall on emitters that face away.
// Estimator   unbiased: every emitter that can contribute at x has positive probability, and the probability
//             returned is exactly the product of the steps taken.
// In -> Out   point x, unit normal n, two uniform numbers -> emitter and probability; kNoEmitter and 0 on a dead
//             branch (all boxes below the horizon or facing away).
// Oracle      tests/light_tree_test.cpp: enumeration of pdf_light_tree over all emitters, chi-square of the walk
//             against it, mean against the exhaustive sum, boxes and cones against their leaves.
#pragma once

#include <cmath>
#include <cstddef>

#include "base/lanes.h"
#include "base/vec.h"

namespace lumigrove {

inline constexpr int kMaxTreeLevels = 32;
inline constexpr std::uint32_t kNoEmitter = 0xffffffffu;

// Walks go down together, a level at a time: while one waits for its node or its arithmetic the others go on.
#if defined(__CUDACC__)
inline constexpr int kWalkBatch = 1;  // a warp does that by itself
#else
inline constexpr int kWalkBatch = 64;  // their nodes fit the first-level cache
#endif

// W children. Boxes as centre and half extent (rounded outwards): distance and horizon then need a third fewer
// operations than with corners. The normals n' of a child's emitters lie in a cone |n' - axis| <= radius. 32 bytes a
// child.
template <int W>
struct alignas(W * sizeof(float)) LightNode {
  float centre_x[W], centre_y[W], centre_z[W];
  float half_x[W], half_y[W], half_z[W];
  float intensity[W];
  std::int8_t axis_x[W], axis_y[W], axis_z[W];  // in units of 1/kConeAxis
  std::uint8_t radius[W];                       // in units of 2/kConeRadius
};
inline constexpr float kConeAxis = 127, kConeRadius = 255;

struct LightTreeView {
  const std::byte* nodes = nullptr;              // LightNode<width>, level by level from the root
  const std::uint32_t* leaf_emitters = nullptr;  // leaf -> emitter
  const std::uint32_t* emitter_leaves = nullptr;  // emitter -> leaf, kNoEmitter if none; null unless kept
  std::uint32_t level_first[kMaxTreeLevels] = {};  // index of a level's first node, root level first
  int levels = 0;                                  // of nodes; leaves lie below the last
  int width = 0;                                   // W
  std::uint32_t count = 0;                         // leaves
  float inside2 = 0;                               // squared distance that counts as inside a box, m^2
  int first_cones = 0;  // first level whose weights bound the emitters' own cosine; `levels` for none

  // Node k of level l holds children W*k..W*k+W-1 of level l+1.
  template <int W>
  LUMI_HD const LightNode<W>* level(int l) const {
    return reinterpret_cast<const LightNode<W>*>(nodes) + level_first[l];
  }
};

template <int W>
struct ChildWeights {
  Lanes<W> weight;
  Lanes<W> cumulative;  // sum of the weights up to and with this child's
  float total;          // 0: no child can contribute
};

// Upper bound of cos at the emitters of every child, times `near`: n' (x - y) over all y in the box and n' in the
// cone is at most axis (x - c) + |axis| h + radius (|x - c| + |h|), and the last sum at most sqrt(2) |far|.
// `to_centre` is c - x, `half` is h.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<W> bound_facing(const LightNode<W>& node, const LaneVec3<W>& to_centre,
                                                 const LaneVec3<W>& half, const Lanes<W>& far) {
  const LaneVec3<W> axis{load_bytes<W>(node.axis_x), load_bytes<W>(node.axis_y), load_bytes<W>(node.axis_z)};
  const Lanes<W> scaled = dot<W>(abs_lanes<W>(axis), half) - dot<W>(axis, to_centre);
  const Lanes<W> slack = load_bytes<W>(node.radius) * (far * (1.41422f * 2 / kConeRadius));
  return multiply_add<W>(scaled, broadcast<W>(1 / kConeAxis), slack);
}

// Equations 1 and 2 for the W children of a node at once.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE ChildWeights<W> weigh_children(const LightNode<W>& node, bool cones, float inside2,
                                                          vec3 x, vec3 n) {
  const Lanes<W> zero = broadcast<W>(0), one = broadcast<W>(1), inside = broadcast<W>(inside2);
  const LaneVec3<W> half{load_lanes<W>(node.half_x), load_lanes<W>(node.half_y), load_lanes<W>(node.half_z)};
  const LaneVec3<W> to_centre{load_lanes<W>(node.centre_x) - x.x, load_lanes<W>(node.centre_y) - x.y,
                              load_lanes<W>(node.centre_z) - x.z};
  const LaneVec3<W> apart = abs_lanes<W>(to_centre);
  const LaneVec3<W> nearest{max_lanes<W>(apart.x - half.x, zero), max_lanes<W>(apart.y - half.y, zero),
                            max_lanes<W>(apart.z - half.z, zero)};
  const LaneVec3<W> farthest{apart.x + half.x, apart.y + half.y, apart.z + half.z};
  const Lanes<W> near2 = dot<W>(nearest, nearest), far2 = dot<W>(farthest, farthest);
  const Lanes<W> inverse_near = reciprocal_sqrt<W>(max_lanes<W>(near2, inside));
  const Lanes<W> inverse_far = reciprocal_sqrt<W>(max_lanes<W>(far2, inside));
  const Lanes<W> far = far2 * inverse_far;

  // Height of the box's highest corner above the tangent plane.
  const Lanes<W> margin = far * 2e-6f;
  const Lanes<W> height = add_dot<W>(add_dot<W>(margin, broadcast<W>(vec3(std::fabs(n.x), std::fabs(n.y), std::fabs(n.z))), half), broadcast<W>(n), to_centre);
  const Lanes<W> cosine = min_lanes<W>(max_lanes<W>(height, zero) * inverse_near, one);
  Lanes<W> shining = load_lanes<W>(node.intensity) * cosine;
  if (cones) {
    const Lanes<W> facing = bound_facing<W>(node, to_centre, half, far);
    shining = shining * min_lanes<W>(max_lanes<W>(facing, zero) * inverse_near, one);
  }

  const Lanes<W> far_weight = shining * (inverse_far * inverse_far);
  // Where x is inside a box its nearest distance is 0: then only such boxes count, without the distance.
  const Lanes<W> inside_weight = keep_if_not_above<W>(near2, inside, shining);
  const Lanes<W> near_weight = select_lanes<W>(greater_bits<W>(inside_weight, zero) != 0, inside_weight,
                                               shining * (inverse_near * inverse_near));

  // Near weights are scaled to the sum of the far ones, so that the average of both needs no other division.
  const Lanes<W> near_sums = prefix_sum<W>(near_weight), far_sums = prefix_sum<W>(far_weight);
  const float far_total = far_sums[W - 1];
  const Lanes<W> scale = broadcast<W>(far_total / near_sums[W - 1]);
  return {multiply_add<W>(near_weight, scale, far_weight), multiply_add<W>(near_sums, scale, far_sums),
          far_total + far_total};
}

struct ChosenChild {
  int lane;
  float probability;
  float r;  // uniform in [0,1) for the next choice
};

// A child in proportion to its weight; never one of weight 0. total > 0, r in [0,1).
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE ChosenChild choose_child(const ChildWeights<W>& children, float r) {
  const float target = r * children.total;
  const std::uint32_t positive = greater_bits<W>(children.weight, broadcast<W>(0));
  const std::uint32_t beyond = greater_bits<W>(children.cumulative, broadcast<W>(target)) & positive;
  const int lane = beyond != 0 ? lowest_bit(beyond) : highest_bit(positive | 1u);
  alignas(64) float weights[W], sums[W];
  store_lanes<W>(children.weight, weights);
  store_lanes<W>(children.cumulative, sums);
  const float weight = weights[lane];
  const float rest = (target - (sums[lane] - weight)) / weight;
  return {lane, weight / children.total, glm::min(glm::max(rest, 0.0f), 0x1.fffffep-1f)};
}

struct WalkPoint {
  vec3 x;
  float u0;  // chooses in the upper half of the levels
  vec3 n;    // unit
  float u1;  // chooses in the lower half, so that both keep enough bits for any depth
};

struct TreeSample {
  std::uint32_t emitter = kNoEmitter;
  float pdf = 0;
};

// One walk from the root for each of at most kWalkBatch points.
template <int W>
LUMI_HD inline void sample_light_tree(const LightTreeView& tree, const WalkPoint* points, int count,
                                      TreeSample* samples) {
  std::uint32_t node[kWalkBatch];
  float pdf[kWalkBatch], r[kWalkBatch];
  int alive[kWalkBatch];
  int living = count;
  for (int i = 0; i < count; ++i) {
    alive[i] = i;
    node[i] = 0;
    pdf[i] = 1;
    r[i] = points[i].u0;
    samples[i] = {};
  }
  const int middle = (tree.levels + 1) / 2;
  for (int level = 0; level < tree.levels; ++level) {
    const LightNode<W>* nodes = tree.level<W>(level);
    const bool last = level + 1 == tree.levels;
    const LightNode<W>* below = last ? nullptr : tree.level<W>(level + 1);
    int kept = 0;
    for (int k = 0; k < living; ++k) {
      const int i = alive[k];
      const WalkPoint& point = points[i];
      const ChildWeights<W> children = weigh_children<W>(nodes[node[i]], level >= tree.first_cones, tree.inside2, point.x, point.n);
      const ChosenChild chosen = choose_child<W>(children, level == middle ? point.u1 : r[i]);
      node[i] = node[i] * W + static_cast<std::uint32_t>(chosen.lane);
      pdf[i] *= chosen.probability;
      r[i] = chosen.r;
      alive[kept] = i;
      kept += children.total > 0 ? 1 : 0;
      if (last) {
        prefetch(tree.leaf_emitters + node[i]);
      } else {
        const char* next = reinterpret_cast<const char*>(below + node[i]);
        for (std::size_t line = 0; line < sizeof(LightNode<W>); line += 64) prefetch(next + line);
      }
    }
    living = kept;
  }
  for (int k = 0; k < living; ++k) samples[alive[k]] = {tree.leaf_emitters[node[alive[k]]], pdf[alive[k]]};
}

// Probability with which sample_light_tree returns `emitter`: the same products, multiplied in the same order.
template <int W>
LUMI_HD inline float pdf_light_tree(const LightTreeView& tree, vec3 x, vec3 n, std::uint32_t emitter) {
  const std::uint32_t leaf = tree.emitter_leaves[emitter];
  if (leaf == kNoEmitter) return 0;
  std::uint32_t span = 1;  // leaves below a child of the current level
  for (int level = 1; level < tree.levels; ++level) span *= W;
  float pdf = 1;
  for (int level = 0; level < tree.levels; ++level, span /= W) {
    const LightNode<W>& node = tree.level<W>(level)[leaf / span / W];
    const ChildWeights<W> children = weigh_children<W>(node, level >= tree.first_cones, tree.inside2, x, n);
    if (!(children.total > 0)) return 0;
    alignas(64) float weights[W];
    store_lanes<W>(children.weight, weights);
    pdf *= weights[leaf / span % W] / children.total;
  }
  return pdf;
}

}  // namespace lumigrove
