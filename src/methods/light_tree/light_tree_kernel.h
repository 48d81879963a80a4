// Method      Picks one emitter out of very many with probability close to its share of the light at a point, by
//             one walk down a perfect tree over the emitters in Morton order.
// Paper       D. Lin, C. Yuksel, "Real-Time Stochastic Lightcuts", Proc. ACM CGIT 3(1) (I3D 2020): 3.1 and 3.2;
//             cosine bound and special cases as in the authors' code (distance 0, dead branches). C. Yuksel,
//             "Stochastic Lightcuts", HPG 2019, for the weights that theirs are compared with (Weights::kYuksel).
// Symbols     I_j -> intensity -> Y of the peak radiant intensity under child j, as a share of all local flux
//             F_j -> cosine -> bound of cos at the receiver over the child's box, no material
//             d_j^min, d_j^max -> near2, far2 -> squared distance from x to the box's nearest / farthest point, m^2
//             p_j -> weight / total -> probability of stepping to child j, given its parent
// Equations   (1) w_j^min, w_j^max and (2) their normalisation, averaged -> weigh_children; with kYuksel w_j^min alone,
//             for all children without the distance where that to one of their boxes is less than the box's diagonal
// Departures  Nodes have W children (2 is the paper's tree; 4, 8 and 16 weigh their children in one pass over SoA
//             rows, with eqs. 1-2, or Yuksel's weights, normalised over W instead of 2; boxes of children that cannot
//             contribute are near to nothing). Bogus leaves are not stored, except to fill the
//             last node of a level: their intensity is 0. Emitters of no flux are sorted last and left out. Points
//             closer than 1e-7 D to a box count as inside it. Virtual point lights lie on the very surfaces that they
//             light: over them distances have a floor (BoxNearness), and no point counts as inside. The horizon test
//             has a relative margin of 1e-6, so that rounding never makes a light at the horizon impossible. F_j is
//             the highest corner's height over the nearest distance. Gloss is not in the weights, as in the paper.
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
#include <type_traits>

#include "base/lanes.h"
#include "base/vec.h"
#include "lights/cone_lanes.h"
#include "lumigrove/settings.h"

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

// How near boxes count. Those within inside2 hold the point, and then are the only ones that count; below 0: none do.
// Others are taken to be no nearer than floor2. m^2.
struct BoxNearness {
  float inside2, floor2;

  LUMI_HD BoxNearness(float squared) : inside2(squared), floor2(squared) {}
  LUMI_HD BoxNearness(float inside_squared, float floor_squared)
      : inside2(floor_squared > inside_squared ? -1 : inside_squared), floor2(floor_squared) {}
};

struct LightTreeView {
  const std::byte* nodes = nullptr;              // LightNode<width>, level by level from the root
  const std::uint32_t* leaf_emitters = nullptr;  // leaf -> emitter
  const std::uint32_t* emitter_leaves = nullptr;  // emitter -> leaf, kNoEmitter if none; null unless kept
  std::uint32_t level_first[kMaxTreeLevels] = {};  // index of a level's first node, root level first
  int levels = 0;                                  // of nodes; leaves lie below the last
  int width = 0;                                   // W
  std::uint32_t count = 0;                         // leaves
  int root_children = 0;                           // that are not bogus
  float inside2 = 0;                               // squared distance that counts as inside a box, m^2
  float floor2 = 0;                                // least squared distance in the weights, m^2
  int first_cones = 0;  // first level whose weights bound the emitters' own cosine; `levels` for none
  Weights weights = Weights::kMinMax;  // or kYuksel

  LUMI_HD BoxNearness nearness() const { return {inside2, floor2}; }

  // Node k of level l holds children W*k..W*k+W-1 of level l+1.
  template <int W>
  LUMI_HD const LightNode<W>* level(int l) const {
    return reinterpret_cast<const LightNode<W>*>(nodes) + level_first[l];
  }
};

// f(std::integral_constant<int, width>()) for the width of a tree: 2, 4, 8 or 16.
template <class Function>
LUMI_HD LUMI_ALWAYS_INLINE decltype(auto) with_width(int width, const Function& f) {
  switch (width) {
    case 2:
      return f(std::integral_constant<int, 2>());
    case 4:
      return f(std::integral_constant<int, 4>());
    case 8:
      return f(std::integral_constant<int, 8>());
    default:
      return f(std::integral_constant<int, 16>());
  }
}

// f(std::integral_constant<Weights, weights>()) for the weights of a tree, so that walks need not ask at every step.
template <class Function>
LUMI_HD LUMI_ALWAYS_INLINE decltype(auto) with_weights(Weights weights, const Function& f) {
  if (weights == Weights::kYuksel) return f(std::integral_constant<Weights, Weights::kYuksel>());
  return f(std::integral_constant<Weights, Weights::kMinMax>());
}

// Children first, ..., first + children - 1 of a node, and all lights below them: where a walk starts. As nodes are W wide
// and whole binary trees of their children, every subtree of the binary tree is such a range of 1, 2, 4, ... children.
struct Subtree {
  std::uint32_t node = 0;  // of its level
  std::int16_t level = 0;
  std::uint8_t first = 0, children = 0;

  LUMI_HD bool operator==(const Subtree& o) const {
    return node == o.node && level == o.level && first == o.first && children == o.children;
  }
};

LUMI_HD inline Subtree whole_tree(const LightTreeView& tree) {
  return {0, 0, 0, static_cast<std::uint8_t>(tree.root_children)};
}

// Boxes, and what shines in them, one a lane: the children of a node, or one child for many points.
template <int W>
struct BoxLanes {
  LaneVec3<W> centre, half;
  Lanes<W> intensity;
};

template <int W>
LUMI_HD LUMI_ALWAYS_INLINE BoxLanes<W> load_boxes(const LightNode<W>& node) {
  return {{load_lanes<W>(node.centre_x), load_lanes<W>(node.centre_y), load_lanes<W>(node.centre_z)},
          {load_lanes<W>(node.half_x), load_lanes<W>(node.half_y), load_lanes<W>(node.half_z)},
          load_lanes<W>(node.intensity)};
}

template <int W>
LUMI_HD LUMI_ALWAYS_INLINE ConeLanes<W> load_cones(const LightNode<W>& node) {
  return {{load_bytes<W>(node.axis_x), load_bytes<W>(node.axis_y), load_bytes<W>(node.axis_z)},
          load_bytes<W>(node.radius)};
}

template <int P, int W>
LUMI_HD LUMI_ALWAYS_INLINE BoxLanes<P> broadcast_box(const LightNode<W>& node, int c) {
  return {broadcast<P>(vec3(node.centre_x[c], node.centre_y[c], node.centre_z[c])),
          broadcast<P>(vec3(node.half_x[c], node.half_y[c], node.half_z[c])), broadcast<P>(node.intensity[c])};
}

template <int P, int W>
LUMI_HD LUMI_ALWAYS_INLINE ConeLanes<P> broadcast_cone(const LightNode<W>& node, int c) {
  return {broadcast<P>(vec3(node.axis_x[c], node.axis_y[c], node.axis_z[c])),
          broadcast<P>(static_cast<float>(node.radius[c]))};
}

// Equation 1: w^max and w^min, and either without the distance. `inside` is that where x is inside the box, or for
// kYuksel nearer than its diagonal, elsewhere 0.
template <int W>
struct BoxWeights {
  Lanes<W> near, far, plain, inside;
};

// Rounding must not make a light at the horizon impossible: margin of its test, relative to the distance.
inline constexpr float kHorizonMargin = 2e-6f;

// `cones` is asked for ConeLanes only when `use_cones`.
template <int W, class Cones>
LUMI_HD LUMI_ALWAYS_INLINE BoxWeights<W> weigh_boxes(const BoxLanes<W>& box, bool use_cones, const Cones& cones,
                                                     BoxNearness nearness, const LaneVec3<W>& x, const LaneVec3<W>& n,
                                                     Weights weights = Weights::kMinMax,
                                                     float horizon_margin = kHorizonMargin) {
  const Lanes<W> zero = broadcast<W>(0), one = broadcast<W>(1), floor2 = broadcast<W>(nearness.floor2);
  const LaneVec3<W>& half = box.half;
  const LaneVec3<W> to_centre{box.centre.x - x.x, box.centre.y - x.y, box.centre.z - x.z};
  const LaneVec3<W> apart = abs_lanes<W>(to_centre);
  const LaneVec3<W> nearest{max_lanes<W>(apart.x - half.x, zero), max_lanes<W>(apart.y - half.y, zero),
                            max_lanes<W>(apart.z - half.z, zero)};
  const LaneVec3<W> farthest{apart.x + half.x, apart.y + half.y, apart.z + half.z};
  const Lanes<W> near2 = dot<W>(nearest, nearest), far2 = dot<W>(farthest, farthest);
  const Lanes<W> bounded_far2 = max_lanes<W>(far2, floor2);
  const Lanes<W> inverse_near = reciprocal_sqrt<W>(max_lanes<W>(near2, floor2));
  const Lanes<W> inverse_far = reciprocal_sqrt<W>(bounded_far2);
  const Lanes<W> far = bounded_far2 * inverse_far;

  // Height of the box's highest corner above the tangent plane.
  const Lanes<W> margin = far * horizon_margin;
  const Lanes<W> height = add_dot<W>(add_dot<W>(margin, abs_lanes<W>(n), half), n, to_centre);
  const Lanes<W> cosine = min_lanes<W>(max_lanes<W>(height, zero) * inverse_near, one);
  Lanes<W> shining = box.intensity * cosine;
  if (use_cones) {
    const Lanes<W> facing = bound_facing<W>(cones(), to_centre, half, far);
    shining = shining * min_lanes<W>(max_lanes<W>(facing, zero) * inverse_near, one);
  }
  const Lanes<W> plain_inside = weights == Weights::kYuksel
                                    ? choose_where_greater<W>(dot<W>(half, half) * 4.0f, near2, shining, zero)
                                    : keep_if_not_above<W>(near2, broadcast<W>(nearness.inside2), shining);
  return {shining * (inverse_near * inverse_near), shining * (inverse_far * inverse_far), shining, plain_inside};
}

template <int W>
struct ChildWeights {
  Lanes<W> weight;
  Lanes<W> cumulative;  // sum of the weights up to and with this child's
  float total;          // 0: no child can contribute
};

// 1 in lanes first, ..., first + count - 1, elsewhere 0.
template <int W>
LUMI_HD inline Lanes<W> lanes_in_range(int first, int count) {
  float lanes[W];
  for (int c = 0; c < W; ++c) lanes[c] = c >= first && c < first + count ? 1.0f : 0.0f;
  return load_lanes<W>(lanes);
}

// How the children of a node are weighed.
struct Weighing {
  Weights weights = Weights::kMinMax;  // or kYuksel
  bool cones = true;                   // weights bound the emitters' own cosine
  BoxNearness nearness = 0.0f;
  float horizon_margin = kHorizonMargin;
};

LUMI_HD LUMI_ALWAYS_INLINE Weighing weighing_of_level(const LightTreeView& tree, int level, Weights weights) {
  return {weights, level >= tree.first_cones, tree.nearness()};
}

// Equations 1 and 2 for the W children of a node at once. `lanes` are the node's boxes, those that do not count without intensity.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE ChildWeights<W> weigh_children(BoxLanes<W> lanes, const LightNode<W>& node,
                                                          const Weighing& weighing, vec3 x, vec3 n) {
  const BoxWeights<W> boxes = weigh_boxes<W>(
      lanes, weighing.cones, [&] { return load_cones<W>(node); }, weighing.nearness, broadcast<W>(x), broadcast<W>(n),
      weighing.weights, weighing.horizon_margin);
  const bool is_inside = greater_bits<W>(boxes.inside, broadcast<W>(0)) != 0;
  if (weighing.weights == Weights::kYuksel) {
    const Lanes<W> weights = select_lanes<W>(is_inside, boxes.plain, boxes.near);
    const Lanes<W> sums = prefix_sum<W>(weights);
    return {weights, sums, sums[W - 1]};
  }
  // Where x is inside a box its nearest distance is 0: then only such boxes count, without the distance.
  const Lanes<W> near = select_lanes<W>(is_inside, boxes.inside, boxes.near);
  // Near weights are scaled to the sum of the far ones, so that the average of both needs no other division.
  const Lanes<W> near_sums = prefix_sum<W>(near), far_sums = prefix_sum<W>(boxes.far);
  const float far_total = far_sums[W - 1];
  const Lanes<W> scale = broadcast<W>(far_total / near_sums[W - 1]);
  return {multiply_add<W>(near, scale, boxes.far), multiply_add<W>(near_sums, scale, far_sums),
          far_total + far_total};
}

template <int W>
LUMI_HD LUMI_ALWAYS_INLINE ChildWeights<W> weigh_children(const LightNode<W>& node, const Weighing& weighing, vec3 x,
                                                          vec3 n) {
  return weigh_children<W>(load_boxes<W>(node), node, weighing, x, n);
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

// Points to walk for. Each coordinate by itself, so that many can be read at once.
struct alignas(64) WalkPoints {
  float x[kWalkBatch] = {}, y[kWalkBatch] = {}, z[kWalkBatch] = {};
  float nx[kWalkBatch] = {}, ny[kWalkBatch] = {}, nz[kWalkBatch] = {};  // unit
  float u0[kWalkBatch] = {};  // chooses in the upper half of the levels
  float u1[kWalkBatch] = {};  // chooses in the lower half, so that both keep enough bits for any depth

  LUMI_HD void set(int i, vec3 position, vec3 normal, vec2 u) {
    x[i] = position.x, y[i] = position.y, z[i] = position.z;
    nx[i] = normal.x, ny[i] = normal.y, nz[i] = normal.z;
    u0[i] = u.x, u1[i] = u.y;
  }
  LUMI_HD vec3 position(int i) const { return {x[i], y[i], z[i]}; }
  LUMI_HD vec3 normal(int i) const { return {nx[i], ny[i], nz[i]}; }
};

struct TreeSample {
  std::uint32_t emitter = kNoEmitter;
  float pdf = 0;
};

// Where the walks of a batch are.
struct WalkState {
  std::uint32_t node[kWalkBatch];  // of the level to come
  float pdf[kWalkBatch], r[kWalkBatch];
  int alive[kWalkBatch];  // the first `living` are the walks not ended on a dead branch
  int living;
};

// a[c] becomes a[0] + ... + a[c], added in the order of prefix_sum, so that the last is the same to the bit.
template <int W, int P>
LUMI_HD LUMI_ALWAYS_INLINE void prefix_sums_across(Lanes<P> (&a)[W]) {
  for (int by = 1; by < W; by *= 2)
    for (int c = W - 1; c >= by; --c) a[c] = a[c] + a[c - by];
}

// The first step, which all walks take from one node: P points at once, child by child, instead of W children at once. A
// start with few children then costs little.
template <int W, int P, Weights kWeights>
LUMI_HD inline void step_from_start(const LightTreeView& tree, Subtree start, const WalkPoints& points, int first,
                                    WalkState& state) {
  const LightNode<W>& node = tree.level<W>(start.level)[start.node];
  const int begin = start.first, end = start.first + start.children;
  const Lanes<P> zero = broadcast<P>(0);
  const LaneVec3<P> x{load_lanes<P>(points.x + first), load_lanes<P>(points.y + first),
                      load_lanes<P>(points.z + first)};
  const LaneVec3<P> n{load_lanes<P>(points.nx + first), load_lanes<P>(points.ny + first),
                      load_lanes<P>(points.nz + first)};
  Lanes<P> near[W], far[W], inside[W];
  Lanes<P> most_inside = zero;
  constexpr bool kYuksel = kWeights == Weights::kYuksel;
  for (int c = 0; c < W; ++c) near[c] = far[c] = inside[c] = zero;
  for (int c = begin; c < end; ++c) {
    const BoxWeights<P> box = weigh_boxes<P>(
        broadcast_box<P>(node, c), start.level >= tree.first_cones, [&] { return broadcast_cone<P>(node, c); }, tree.nearness(),
        x, n, kWeights);
    near[c] = box.near;
    far[c] = box.far;
    inside[c] = kYuksel ? box.plain : box.inside;
    most_inside = max_lanes<P>(most_inside, box.inside);
  }
  for (int c = begin; c < end; ++c) {
    near[c] = choose_where_greater<P>(most_inside, zero, inside[c], near[c]);
    if (kYuksel) far[c] = near[c];  // the scale below is then 1, and everything twice what weigh_children has
  }

  Lanes<P> near_sums[W], far_sums[W];
  for (int c = 0; c < W; ++c) {
    near_sums[c] = near[c];
    far_sums[c] = far[c];
  }
  prefix_sums_across<W, P>(near_sums);
  prefix_sums_across<W, P>(far_sums);
  const Lanes<P> far_total = far_sums[W - 1], total = far_total + far_total;
  const Lanes<P> scale = far_total / near_sums[W - 1];
  const Lanes<P> target = load_lanes<P>(points.u0 + first) * total;

  // From the last child to the first: the last of positive weight, then every one whose sum is beyond the target.
  Lanes<P> lane = zero, weight = zero, sum = zero, any = zero;
  for (int c = end - 1; c >= begin; --c) {
    const Lanes<P> child_weight = multiply_add<P>(near[c], scale, far[c]);
    const Lanes<P> child_sum = multiply_add<P>(near_sums[c], scale, far_sums[c]);
    const Lanes<P> beyond = choose_where_greater<P>(child_sum, target, child_weight, zero);
    const Lanes<P> take = choose_where_greater<P>(any, zero, beyond, child_weight);
    lane = choose_where_greater<P>(take, zero, broadcast<P>(static_cast<float>(c)), lane);
    weight = choose_where_greater<P>(take, zero, child_weight, weight);
    sum = choose_where_greater<P>(take, zero, child_sum, sum);
    any = max_lanes<P>(any, child_weight);
  }
  const Lanes<P> rest = (target - (sum - weight)) / weight;
  float lanes[P], totals[P];
  store_lanes<P>(lane, lanes);
  store_lanes<P>(total, totals);
  store_lanes<P>(weight / total, state.pdf + first);
  store_lanes<P>(min_lanes<P>(max_lanes<P>(rest, zero), broadcast<P>(0x1.fffffep-1f)), state.r + first);
  for (int i = 0; i < P; ++i) {
    state.node[first + i] = start.node * W + (totals[i] > 0 ? static_cast<std::uint32_t>(lanes[i]) : 0);
    if (!(totals[i] > 0)) state.pdf[first + i] = 0;
  }
}

// Fetches early what the next step of a walk reads.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE void prefetch_step(const LightTreeView& tree, int level, std::uint32_t node) {
  if (level == tree.levels) {
    prefetch(tree.leaf_emitters + node);
    return;
  }
  const char* next = reinterpret_cast<const char*>(tree.level<W>(level) + node);
  for (std::size_t line = 0; line < sizeof(LightNode<W>); line += 64) prefetch(next + line);
}

// The step of every living walk from a level below the root.
template <int W, Weights kWeights>
LUMI_HD LUMI_ALWAYS_INLINE void step_down(const LightTreeView& tree, const WalkPoints& points, int level,
                                          WalkState& state) {
  const LightNode<W>* nodes = tree.level<W>(level);
  const bool second_number = level == (tree.levels + 1) / 2;
  const Weighing weighing = weighing_of_level(tree, level, kWeights);
  int kept = 0;
  for (int k = 0; k < state.living; ++k) {
    const int i = state.alive[k];
    const ChildWeights<W> children =
        weigh_children<W>(nodes[state.node[i]], weighing, points.position(i), points.normal(i));
    const ChosenChild chosen = choose_child<W>(children, second_number ? points.u1[i] : state.r[i]);
    state.node[i] = state.node[i] * W + static_cast<std::uint32_t>(chosen.lane);
    state.pdf[i] *= chosen.probability;
    state.r[i] = chosen.r;
    state.alive[kept] = i;
    kept += children.total > 0 ? 1 : 0;
    prefetch_step<W>(tree, level + 1, state.node[i]);
  }
  state.living = kept;
}

template <int W, Weights kWeights>
LUMI_HD inline void walk_light_tree(const LightTreeView& tree, Subtree start, const WalkPoints& points, int count,
                                    TreeSample* samples) {
  constexpr int kPoints = kWalkBatch < 16 ? kWalkBatch : 16;
  WalkState state;
  state.living = 0;
  for (int first = 0; first < count; first += kPoints)
    step_from_start<W, kPoints, kWeights>(tree, start, points, first, state);
  for (int i = 0; i < count; ++i) {
    samples[i] = {};
    state.alive[state.living] = i;
    state.living += state.pdf[i] > 0 ? 1 : 0;
    prefetch_step<W>(tree, start.level + 1, state.node[i]);
  }
  for (int level = start.level + 1; level < tree.levels; ++level)
    step_down<W, kWeights>(tree, points, level, state);
  for (int k = 0; k < state.living; ++k) {
    const int i = state.alive[k];
    samples[i] = {tree.leaf_emitters[state.node[i]], state.pdf[i]};
  }
}

// One walk down `start` for each of the first `count` points. start.children > 0.
template <int W>
LUMI_HD inline void sample_light_tree(const LightTreeView& tree, Subtree start, const WalkPoints& points, int count,
                                      TreeSample* samples) {
  with_weights(tree.weights, [&](auto weights) { walk_light_tree<W, weights>(tree, start, points, count, samples); });
}

// Probability with which sample_light_tree returns `emitter`: the same products, multiplied in the same order. 0 for an
// emitter that is not below `start`.
template <int W>
LUMI_HD inline float pdf_light_tree(const LightTreeView& tree, Subtree start, vec3 x, vec3 n, std::uint32_t emitter) {
  const std::uint32_t leaf = tree.emitter_leaves[emitter];
  if (leaf == kNoEmitter) return 0;
  std::uint32_t span = 1;  // leaves below a child of the current level
  for (int level = start.level + 1; level < tree.levels; ++level) span *= W;
  const std::uint32_t lane = leaf / span % W;
  if (leaf / span / W != start.node || lane < start.first || lane >= start.first + start.children) return 0;
  float pdf = 1;
  for (int level = start.level; level < tree.levels; ++level, span /= W) {
    const LightNode<W>& node = tree.level<W>(level)[leaf / span / W];
    BoxLanes<W> boxes = load_boxes<W>(node);
    if (level == start.level) boxes.intensity = boxes.intensity * lanes_in_range<W>(start.first, start.children);
    const ChildWeights<W> children = weigh_children<W>(boxes, node, weighing_of_level(tree, level, tree.weights), x, n);
    if (!(children.total > 0)) return 0;
    alignas(64) float weights[W];
    store_lanes<W>(children.weight, weights);
    pdf *= weights[leaf / span % W] / children.total;
  }
  return pdf;
}

}  // namespace lumigrove
