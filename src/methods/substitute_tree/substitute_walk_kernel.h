// Method      Walks from the root of a substitute tree to one light, or to an inner node whose Gaussian stands for the
//             lights below it, with probability close to their share of the light that a surface reflects.
// Paper       W. Tatzgern, B. Mayr, B. Kerbl, M. Steinberger, "Stochastic Substitute Trees for Real-Time Global
//             Illumination", I3D 2020: section 4; C. Yuksel, "Stochastic Lightcuts", HPG 2019, for its weights; B. Walter
//             et al., "Lightcuts", SIGGRAPH 2005, for the cosine bound.
// Symbols     I_j -> ChildRecord::intensity -> Y of the summed intensity of the lights below child j, W/sr
//             M_j -> material -> bound of the cosine at the receiver, times the gloss lobe towards R' if that is sampled
//             G_j -> inverse_distance2 -> 1 / max(|x - p_j|^2, epsilon^2), 1/m^2; p_j: mean of the lights below j
//             R' -> direction_in_box -> direction to the box that makes the least angle with the mirror direction R
//             P -> WalkResult::pdf -> product of the steps' probabilities
// Equations   (5) with V = 1 -> weigh_children; p = w_1 / (w_1 + w_2) -> step
// Departures  Sixteen walks go side by side, one in each SIMD lane; steps and probabilities are those of single walks.
//             The cosine bound turns the box into the surface's frame by its centre and half extent; heights have a
//             relative margin of 2e-6, so that rounding never makes a light at the horizon impossible.
//             The gloss lobe is floored by its own tail, never 0, so that no box above the horizon is a dead branch.
//             With `cones`, weights also bound the cosine at the lights (paper: none).
//             Where stochastic lightcuts' baseline leaves the distance out (kInBox) it is one unit of the demos, whose
//             scenes measure some 4.64: leaving it out would make probabilities depend on the unit of length.
//             Random numbers are not re-stretched for more than kStepsPerNumber steps.
// Estimator   The walk itself is exact: every light that can contribute at x has positive probability, and the
//             probability returned is that of the steps taken. Drawing from substitutes is biased: they are not where
//             the lights are.
// In -> Out   WalkPoints of surfaces -> WalkResults; kind kDead on a dead branch (all boxes below the horizon)
// Oracle      tests/substitute_walk_test.cpp: sum of pdf_substitute_leaf over all lights, chi-square, exhaustive sum.
#pragma once

#include "base/lanes.h"
#include "base/rng.h"
#include "lights/cone_lanes.h"
#include "lumigrove/settings.h"
#include "methods/substitute_tree/substitute_node.h"
#include "scene/bsdf.h"

namespace lumigrove {

struct SubstituteWalk {
  SubstituteTreeView tree;
  Weights weight = Weights::kDistanceBounded;
  float floor2 = 0;        // epsilon^2, m^2: least squared distance
  bool cones = false;      // bound the cosine at the lights
  bool substitutes = true; // stop at usable nodes
  float inside2 = 1;       // m^2: squared distance that kInBox takes where x lies in the box
};

#if defined(__CUDACC__)
inline constexpr int kWalkLanes = 1;  // a thread is a lane
inline constexpr int kWalkGroups = 1;
#else
#if defined(__AVX512F__)
inline constexpr int kWalkLanes = 16;
#else
inline constexpr int kWalkLanes = 8;
#endif
inline constexpr int kWalkGroups = 64 / kWalkLanes;  // while one waits for its nodes the others go on
#endif
inline constexpr int kSubstituteWalks = kWalkLanes * kWalkGroups;
inline constexpr int kStepsPerNumber = 10;

// Surfaces to walk for, each number by itself so that a row of lanes can be read at once.
struct alignas(64) SubstituteWalkPoints {
  float position[3][kSubstituteWalks] = {};
  float normal[3][kSubstituteWalks] = {};
  float tangent[2][3][kSubstituteWalks] = {};  // with the normal an orthonormal frame
  float u[3][kSubstituteWalks] = {};           // uniform in [0,1)
  // Not for the walk, but for lighting the surface by what it ends at
  float geometric_normal[3][kSubstituteWalks] = {};
  float diffuse[3][kSubstituteWalks] = {};
  float epsilon[kSubstituteWalks] = {};
  // Gloss only
  float wo[3][kSubstituteWalks] = {};
  float mirror[3][kSubstituteWalks] = {};      // R, unit
  float alpha2[kSubstituteWalks] = {};
  float f0[kSubstituteWalks] = {};             // Y

  LUMI_HD void set(int i, const Surface& s, vec3 numbers, bool gloss) {
    const Frame frame = make_frame(s.normal);
    const vec3 reflected = 2 * glm::dot(s.normal, s.wo) * s.normal - s.wo;
    for (int axis = 0; axis < 3; ++axis) {
      position[axis][i] = s.position[axis];
      normal[axis][i] = s.normal[axis];
      tangent[0][axis][i] = frame.x[axis];
      tangent[1][axis][i] = frame.y[axis];
      u[axis][i] = numbers[axis];
      geometric_normal[axis][i] = s.geometric_normal[axis];
      diffuse[axis][i] = s.diffuse[axis];
      if (!gloss) continue;
      wo[axis][i] = s.wo[axis];
      mirror[axis][i] = reflected[axis];
    }
    epsilon[i] = s.epsilon;
    if (!gloss) return;
    const float alpha = s.roughness * s.roughness;
    alpha2[i] = alpha * alpha;
    f0[i] = luminance(s.specular);
  }
};

enum class WalkEnd : std::uint8_t { kDead, kLeaf, kSubstitute };

struct WalkResult {
  WalkEnd end = WalkEnd::kDead;
  std::uint32_t node = 0;  // leaf or inner node
  Box3 box;                // of a substitute: holds its lights
  float pdf = 0;
  int steps = 0;           // choices between two children
};

// --- one step ----------------------------------------------------------------------------------------------

template <int L>
struct WalkLanes {  // the surfaces of a group
  LaneVec3<L> position, normal, tangent[2], wo, mirror;
  Lanes<L> alpha2, f0;
};

template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> load_vec3(const float (&rows)[3][kSubstituteWalks], int first) {
  return {load_lanes<L>(rows[0] + first), load_lanes<L>(rows[1] + first), load_lanes<L>(rows[2] + first)};
}

template <int L, bool kGloss>
LUMI_HD LUMI_ALWAYS_INLINE WalkLanes<L> load_walks(const SubstituteWalkPoints& points, int first) {
  WalkLanes<L> lanes;
  lanes.position = load_vec3<L>(points.position, first);
  lanes.normal = load_vec3<L>(points.normal, first);
  lanes.tangent[0] = load_vec3<L>(points.tangent[0], first);
  lanes.tangent[1] = load_vec3<L>(points.tangent[1], first);
  if constexpr (kGloss) {
    lanes.wo = load_vec3<L>(points.wo, first);
    lanes.mirror = load_vec3<L>(points.mirror, first);
    lanes.alpha2 = load_lanes<L>(points.alpha2 + first);
    lanes.f0 = load_lanes<L>(points.f0 + first);
  }
  return lanes;
}

inline constexpr int kNodeWords = sizeof(SubstituteNode) / sizeof(float);

// words[w][lane] = word w of the lane's node: a transposition.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE void load_nodes(const SubstituteNode* nodes, const std::uint32_t* index,
                                           Lanes<L> (&words)[kNodeWords]) {
  LUMI_UNROLL(2)
  for (int part = 0; part < kNodeWords; part += L) {
    LUMI_UNROLL(16)
    for (int i = 0; i < L; ++i)
      words[part + i] = load_lanes<L>(reinterpret_cast<const float*>(nodes + index[i]) + part);
    transpose_lanes<L>(words + part);
  }
}

template <int L>
struct ChildLanes {
  LaneVec3<L> lo, hi;  // of the box, relative to the surface's position
  LaneVec3<L> mean;    // likewise
  ConeLanes<L> cone;
  Lanes<L> intensity;
  IntLanes<L> flags;   // the record's word `mean`
};

// Signed byte number `byte` of every word.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<L> signed_byte(const IntLanes<L>& word, int byte) {
  return to_float<L>((word << (24 - 8 * byte)) >> 24);
}

// Words 3 and 4 of a ChildRecord.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> unpack_extents(const IntLanes<L>& xy, const IntLanes<L>& z) {
  constexpr auto kHigh = static_cast<std::int32_t>(0xffff0000u);
  return {from_bits<L>(xy << 16), from_bits<L>(xy & kHigh), from_bits<L>(z & kHigh)};
}

template <int L>
LUMI_HD LUMI_ALWAYS_INLINE ChildLanes<L> unpack_child(const Lanes<L>* words, const LaneVec3<L>& x) {
  ChildLanes<L> child;
  const IntLanes<L> mean = bits_of<L>(words[5]), cone = bits_of<L>(words[6]);
  const LaneVec3<L> extent = unpack_extents<L>(bits_of<L>(words[3]), bits_of<L>(words[4]));
  const auto share = [&](int shift) { return to_float<L>((mean >> shift) & 1023) * (1.0f / 1023); };
  child.lo = {words[0] - x.x, words[1] - x.y, words[2] - x.z};
  child.hi = {child.lo.x + extent.x, child.lo.y + extent.y, child.lo.z + extent.z};
  child.mean = {multiply_add<L>(share(0), extent.x, child.lo.x), multiply_add<L>(share(10), extent.y, child.lo.y),
                multiply_add<L>(share(20), extent.z, child.lo.z)};
  child.cone = {{signed_byte<L>(cone, 0), signed_byte<L>(cone, 1), signed_byte<L>(cone, 2)},
                to_float<L>((cone >> 24) & 255)};
  child.intensity = words[7];
  child.flags = mean;
  return child;
}

// Distances along the surface's normal and tangents of the box's nearest points: what bounds the cosine.
template <int L>
struct BoxInFrame {
  Lanes<L> height;  // of the highest point above the tangent plane, at least 0
  Lanes<L> aside2;  // squared, of the point nearest to the normal
};

template <int L>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<L> reach(const LaneVec3<L>& direction, const LaneVec3<L>& half) {
  return dot<L>(abs_lanes<L>(direction), half);
}

template <int L>
LUMI_HD LUMI_ALWAYS_INLINE BoxInFrame<L> turn_box(const WalkLanes<L>& walks, const LaneVec3<L>& centre,
                                                  const LaneVec3<L>& half) {
  const Lanes<L> zero = broadcast<L>(0);
  const Lanes<L> margin =
      (abs_lanes<L>(centre.x) + abs_lanes<L>(centre.y) + abs_lanes<L>(centre.z) + half.x + half.y + half.z) * 2e-6f;
  const Lanes<L> height = dot<L>(walks.normal, centre) + reach<L>(walks.normal, half) + margin;
  Lanes<L> aside2 = zero;
  for (const LaneVec3<L>& tangent : walks.tangent) {
    const Lanes<L> aside =
        max_lanes<L>(abs_lanes<L>(dot<L>(tangent, centre)) - reach<L>(tangent, half), zero);
    aside2 = multiply_add<L>(aside, aside, aside2);
  }
  return {max_lanes<L>(height, zero), aside2};
}

// Unit direction from the surface into the box that makes the least angle with R, R itself if it meets the box: the
// best of R's intersections with the six planes, each clamped to the box; the nearest point of the box if there is
// none.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> direction_in_box(const LaneVec3<L>& r, const LaneVec3<L>& lo,
                                                        const LaneVec3<L>& hi) {
  const Lanes<L> zero = broadcast<L>(0), tiny = broadcast<L>(1e-30f);
  const auto into = [&](const Lanes<L>& v, const Lanes<L>& a, const Lanes<L>& b) {
    return min_lanes<L>(max_lanes<L>(v, a), b);
  };
  LaneVec3<L> best{into(zero, lo.x, hi.x), into(zero, lo.y, hi.y), into(zero, lo.z, hi.z)};
  const Lanes<L> nearest2 = max_lanes<L>(dot<L>(best, best), tiny);
  best = {best.x * reciprocal_sqrt<L>(nearest2), best.y * reciprocal_sqrt<L>(nearest2),
          best.z * reciprocal_sqrt<L>(nearest2)};
  Lanes<L> best_cosine = dot<L>(best, r);
  const Lanes<L> rs[3] = {r.x, r.y, r.z}, los[3] = {lo.x, lo.y, lo.z}, his[3] = {hi.x, hi.y, hi.z};
  for (int axis = 0; axis < 3; ++axis) {
    const Lanes<L> usable = abs_lanes<L>(rs[axis]) - 1e-6f;
    const Lanes<L> inverse = 1.0f / choose_where_greater<L>(usable, zero, rs[axis], broadcast<L>(1));
    for (int side = 0; side < 2; ++side) {
      const Lanes<L> t = (side == 0 ? los[axis] : his[axis]) * inverse;
      const LaneVec3<L> p{into(r.x * t, lo.x, hi.x), into(r.y * t, lo.y, hi.y), into(r.z * t, lo.z, hi.z)};
      const Lanes<L> length2 = dot<L>(p, p);
      const Lanes<L> scale = reciprocal_sqrt<L>(max_lanes<L>(length2, tiny));
      const Lanes<L> cosine = dot<L>(p, r) * scale;
      // Behind the surface's mirror direction, or without a direction: no candidate.
      const Lanes<L> valid = min_lanes<L>(min_lanes<L>(usable, t), length2);
      const Lanes<L> better = choose_where_greater<L>(cosine, best_cosine, valid, zero);
      best_cosine = choose_where_greater<L>(better, zero, cosine, best_cosine);
      best.x = choose_where_greater<L>(better, zero, p.x * scale, best.x);
      best.y = choose_where_greater<L>(better, zero, p.y * scale, best.y);
      best.z = choose_where_greater<L>(better, zero, p.z * scale, best.z);
    }
  }
  // The surface's own position in the box: R.
  const Lanes<L> outside = max_lanes<L>(max_lanes<L>(max_lanes<L>(lo.x, zero - hi.x), max_lanes<L>(lo.y, zero - hi.y)),
                                        max_lanes<L>(lo.z, zero - hi.z));
  return {choose_where_greater<L>(outside, zero, best.x, r.x), choose_where_greater<L>(outside, zero, best.y, r.y),
          choose_where_greater<L>(outside, zero, best.z, r.z)};
}

// Y of the gloss lobe towards w, up to factors that both children share; never 0.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<L> gloss_towards(const WalkLanes<L>& walks, const LaneVec3<L>& w) {
  const Lanes<L> one = broadcast<L>(1), zero = broadcast<L>(0);
  const LaneVec3<L> h{w.x + walks.wo.x, w.y + walks.wo.y, w.z + walks.wo.z};
  const Lanes<L> n_h = dot<L>(walks.normal, h), h2 = dot<L>(h, h);
  // As ggx_normal_density; |h - n (n h)|^2 = h2 - n_h^2 is good enough for a weight.
  const Lanes<L> aside2 = max_lanes<L>(multiply_add<L>(zero - n_h, n_h, h2), zero);
  const Lanes<L> q = multiply_add<L>(walks.alpha2, n_h * n_h, aside2);
  const Lanes<L> density = walks.alpha2 * (h2 * h2) / max_lanes<L>(q * q, broadcast<L>(1e-30f));
  const Lanes<L> k = walks.alpha2 * 0.5f;
  const Lanes<L> cosine = max_lanes<L>(dot<L>(walks.normal, w), zero);
  const Lanes<L> shadowing = one / multiply_add<L>(cosine, one - k, k);
  const Lanes<L> miss = one - min_lanes<L>(h2 * reciprocal_sqrt<L>(max_lanes<L>(h2, broadcast<L>(1e-30f))) * 0.5f, one);
  const Lanes<L> miss2 = miss * miss;
  const Lanes<L> fresnel = multiply_add<L>(one - walks.f0, miss2 * miss2 * miss, walks.f0);
  return max_lanes<L>(density * shadowing * fresnel, broadcast<L>(1e-6f));
}

template <int L>
struct BoxDistances {
  Lanes<L> near2, far2;  // squared, to the box's nearest and farthest point
};
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE BoxDistances<L> box_distances(const LaneVec3<L>& centre, const LaneVec3<L>& half) {
  const Lanes<L> zero = broadcast<L>(0);
  const LaneVec3<L> apart = abs_lanes<L>(centre);
  const LaneVec3<L> near{max_lanes<L>(apart.x - half.x, zero), max_lanes<L>(apart.y - half.y, zero),
                         max_lanes<L>(apart.z - half.z, zero)};
  const LaneVec3<L> far{apart.x + half.x, apart.y + half.y, apart.z + half.z};
  return {dot<L>(near, near), dot<L>(far, far)};
}

// Equation 5 without the distance: M_j I_j, and what the rules about distance need.
template <int L>
struct ChildShine {
  Lanes<L> shine;
  Lanes<L> mean2;           // squared distance to the mean
  Lanes<L> near2;           // to the box; only where asked for
  Lanes<L> diagonal2;       // of the box
};

template <int L, bool kGloss>
LUMI_HD LUMI_ALWAYS_INLINE ChildShine<L> shine_of_child(const SubstituteWalk& walk, const WalkLanes<L>& walks,
                                                        const ChildLanes<L>& child) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-30f);
  const LaneVec3<L> centre{(child.lo.x + child.hi.x) * 0.5f, (child.lo.y + child.hi.y) * 0.5f,
                           (child.lo.z + child.hi.z) * 0.5f};
  const LaneVec3<L> half{(child.hi.x - child.lo.x) * 0.5f, (child.hi.y - child.lo.y) * 0.5f,
                         (child.hi.z - child.lo.z) * 0.5f};
  const BoxInFrame<L> box = turn_box<L>(walks, centre, half);
  const Lanes<L> square = multiply_add<L>(box.height, box.height, box.aside2);
  const Lanes<L> cosine = box.height * reciprocal_sqrt<L>(max_lanes<L>(square, tiny));
  ChildShine<L> result;
  result.shine = child.intensity * cosine;
  if constexpr (kGloss)
    result.shine = result.shine * gloss_towards<L>(walks, direction_in_box<L>(walks.mirror, child.lo, child.hi));
  result.mean2 = dot<L>(child.mean, child.mean);
  result.near2 = result.diagonal2 = zero;
  if (walk.cones || walk.weight != Weights::kDistanceBounded) {
    const BoxDistances<L> distances = box_distances<L>(centre, half);
    result.near2 = distances.near2;
    result.diagonal2 = dot<L>(half, half) * 4.0f;
    if (walk.cones) {
      const Lanes<L> far = distances.far2 * reciprocal_sqrt<L>(max_lanes<L>(distances.far2, tiny));
      const Lanes<L> facing = max_lanes<L>(bound_facing<L>(child.cone, centre, half, far), zero);
      const Lanes<L> inverse_near = reciprocal_sqrt<L>(max_lanes<L>(distances.near2, tiny));
      result.shine = result.shine * min_lanes<L>(facing * inverse_near, one);
    }
  }
  return result;
}

template <int L>
struct PairWeights {
  Lanes<L> left, right;
};

// Equation 5 for both children, times what the distances of both divide by: the shares are the same.
template <int L, bool kGloss>
LUMI_HD LUMI_ALWAYS_INLINE PairWeights<L> weigh_children(const SubstituteWalk& walk, const WalkLanes<L>& walks,
                                                         const ChildLanes<L>& left, const ChildLanes<L>& right) {
  const ChildShine<L> a = shine_of_child<L, kGloss>(walk, walks, left);
  const ChildShine<L> b = shine_of_child<L, kGloss>(walk, walks, right);
  const Lanes<L> floor2 = broadcast<L>(walk.floor2), one = broadcast<L>(1), zero = broadcast<L>(0);
  if (walk.weight == Weights::kDistanceBounded)
    return {a.shine * max_lanes<L>(b.mean2, floor2), b.shine * max_lanes<L>(a.mean2, floor2)};
  Lanes<L> divide_a, divide_b;
  if (walk.weight == Weights::kInBox) {
    const Lanes<L> inside2 = broadcast<L>(walk.inside2);
    divide_a = choose_where_greater<L>(a.near2, zero, max_lanes<L>(a.mean2, floor2), inside2);
    divide_b = choose_where_greater<L>(b.near2, zero, max_lanes<L>(b.mean2, floor2), inside2);
  } else {
    // Either child's box is wider than far away: distances would say nothing. Two lights have no width.
    const Lanes<L> too_near = max_lanes<L>(a.diagonal2 - a.near2, b.diagonal2 - b.near2);
    divide_a = choose_where_greater<L>(too_near, zero, one, max_lanes<L>(a.near2, floor2));
    divide_b = choose_where_greater<L>(too_near, zero, one, max_lanes<L>(b.near2, floor2));
  }
  return {a.shine * divide_b, b.shine * divide_a};
}

// --- walks -------------------------------------------------------------------------------------------------

// Where the walks are.
struct alignas(64) SubstituteWalkState {
  std::uint32_t node[kSubstituteWalks];    // inner node that the walk is at, or ended at a child of
  std::uint32_t parent[kSubstituteWalks];  // of the child last stepped to
  std::uint32_t child[kSubstituteWalks];   // that child, and its flags
  std::uint32_t flags[kSubstituteWalks];
  float pdf[kSubstituteWalks];             // 0: dead
  float r[kSubstituteWalks];
  float steps[kSubstituteWalks];
  float going[kSubstituteWalks];         // 1 while the walk goes on
  bool at_root;                          // no walk leaves the root
};

// The step of a group of walks; those that have ended stay where they are. Does any go on?
template <int L, bool kGloss>
LUMI_HD LUMI_ALWAYS_INLINE bool step_substitute_walks(const SubstituteWalk& walk, const SubstituteWalkPoints& points,
                                                      int first, int step, SubstituteWalkState& state) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1);
  const WalkLanes<L> walks = load_walks<L, kGloss>(points, first);
  Lanes<L> words[kNodeWords];
  load_nodes<L>(walk.tree.nodes, state.node + first, words);
  const ChildLanes<L> left = unpack_child<L>(words, walks.position);
  const ChildLanes<L> right = unpack_child<L>(words + kNodeWords / 2, walks.position);
  const PairWeights<L> weights = weigh_children<L, kGloss>(walk, walks, left, right);

  const Lanes<L> total = weights.left + weights.right;
  const bool fresh = step % kStepsPerNumber == 0 && step / kStepsPerNumber < 3;
  const Lanes<L> r = load_lanes<L>(fresh ? points.u[step / kStepsPerNumber] + first : state.r + first);
  const Lanes<L> target = r * total;
  // The left child unless the target lies beyond it; never a child of weight 0.
  const Lanes<L> beyond = choose_where_greater<L>(weights.right, zero, target - weights.left, zero - one);
  const Lanes<L> go_right = choose_where_greater<L>(weights.left, zero, beyond, one);
  // target == left counts as beyond: r = left / total leaves [left, total) to the right child.
  const Lanes<L> side = choose_where_greater<L>(zero, go_right, zero, one);
  const Lanes<L> weight = choose_where_greater<L>(side, zero, weights.right, weights.left);
  const Lanes<L> rest = choose_where_greater<L>(side, zero, target - weights.left, target) * reciprocal<L>(weight);
  const Lanes<L> going = load_lanes<L>(state.going + first);
  const Lanes<L> alive = choose_where_greater<L>(total, zero, going, zero);

  const IntLanes<L> split = (bits_of<L>(words[4]) & 0xffff) | (bits_of<L>(words[4 + kNodeWords / 2]) << 16);
  const IntLanes<L> child = split + choose_where_greater<L>(side, zero, broadcast_int<L>(1), broadcast_int<L>(0));
  const IntLanes<L> flags = choose_where_greater<L>(side, zero, right.flags, left.flags);
  const std::int32_t stops = static_cast<std::int32_t>(
      ChildRecord::kLeaf | (walk.substitutes && !kGloss ? ChildRecord::kUsable : 0u));
  // The stop bits as numbers: 0 where none is set.
  const Lanes<L> stopped = to_float<L>(((flags & stops) >> 30) & 3);
  const Lanes<L> goes_on = choose_where_greater<L>(stopped, zero, zero, alive);

  // Ended walks keep their state; one that just died gets probability 0.
  const auto keep = [&](const IntLanes<L>& now, std::uint32_t* kept, const Lanes<L>& where) {
    store_lanes<L>(choose_where_greater<L>(where, zero, now, load_lanes<L>(kept)), kept);
  };
  const Lanes<L> pdf = load_lanes<L>(state.pdf + first);
  const Lanes<L> stepped = choose_where_greater<L>(total, zero, pdf * (weight * reciprocal<L>(total)), zero);
  store_lanes<L>(choose_where_greater<L>(going, zero, stepped, pdf), state.pdf + first);
  store_lanes<L>(min_lanes<L>(max_lanes<L>(rest, zero), broadcast<L>(0x1.fffffep-1f)), state.r + first);
  store_lanes<L>(load_lanes<L>(state.steps + first) + going, state.steps + first);
  store_lanes<L>(goes_on, state.going + first);
  keep(load_lanes<L>(state.node + first), state.parent + first, alive);
  keep(child, state.child + first, alive);
  keep(flags, state.flags + first, alive);
  keep(child, state.node + first, goes_on);
  forget_registers();
  for (int i = 0; i < L; ++i) prefetch(walk.tree.nodes + state.node[first + i]);
  return greater_bits<L>(goes_on, zero) != 0;
}

// One walk for each of the first `count` points, count <= kSubstituteWalks.
template <bool kGloss>
LUMI_HD inline void walk_to_ends(const SubstituteWalk& walk, const SubstituteWalkPoints& points, int count,
                                 SubstituteWalkState& state) {
  const SubstituteTreeView& tree = walk.tree;
  state.at_root = tree.count <= 1 || (walk.substitutes && !kGloss && tree.root_usable);
  for (int i = 0; i < kSubstituteWalks; ++i) {
    state.node[i] = state.parent[i] = state.child[i] = 0;
    state.flags[i] = tree.count == 1 ? ChildRecord::kLeaf : ChildRecord::kUsable;
    state.r[i] = state.steps[i] = 0;
    state.pdf[i] = tree.count > 0 && i < count ? 1.0f : 0.0f;
    state.going[i] = i < count ? 1.0f : 0.0f;
  }
  if (state.at_root) return;
  bool going[kWalkGroups];
  for (int g = 0; g < kWalkGroups; ++g) going[g] = g * kWalkLanes < count;
  bool any = true;
  for (int step = 0; any; ++step) {
    any = false;
    for (int g = 0; g < kWalkGroups; ++g) {
      if (!going[g]) continue;
      going[g] = step_substitute_walks<kWalkLanes, kGloss>(walk, points, g * kWalkLanes, step, state);
      any = any || going[g];
    }
  }
}

LUMI_HD inline WalkEnd end_of_walk(const SubstituteWalkState& state, int i) {
  if (!(state.pdf[i] > 0)) return WalkEnd::kDead;
  return (state.flags[i] & ChildRecord::kLeaf) != 0 ? WalkEnd::kLeaf : WalkEnd::kSubstitute;
}

// What the parent knows of the child that a walk ended at; not for walks that ended at the root.
LUMI_HD inline const ChildRecord& record_of_end(const SubstituteWalk& walk, const SubstituteWalkState& state, int i) {
  const SubstituteNode& parent = walk.tree.nodes[state.parent[i]];
  return parent.child[(state.child[i] - parent.split()) & 1];  // of dead walks any
}

LUMI_HD inline WalkResult walk_result(const SubstituteWalk& walk, const SubstituteWalkState& state, int i) {
  WalkResult result;
  result.end = end_of_walk(state, i);
  result.steps = static_cast<int>(state.steps[i]);
  result.pdf = state.pdf[i];
  result.node = state.child[i];
  if (result.end == WalkEnd::kSubstitute)
    result.box = state.at_root ? walk.tree.bounds : unpack_box(record_of_end(walk, state, i));
  return result;
}

// The same, as one result for each walk.
template <bool kGloss>
LUMI_HD inline void walk_substitute_tree(const SubstituteWalk& walk, const SubstituteWalkPoints& points, int count,
                                         WalkResult* results) {
  SubstituteWalkState state;
  walk_to_ends<kGloss>(walk, points, count, state);
  for (int i = 0; i < count; ++i) results[i] = walk_result(walk, state, i);
}

// --- probabilities and single walks ------------------------------------------------------------------------

// Probabilities of the two children of node `node`, by the walk's own arithmetic; both 0 on a dead branch.
template <bool kGloss>
LUMI_HD inline vec2 child_probabilities(const SubstituteWalk& walk, const SubstituteWalkPoints& points, int i,
                                        std::uint32_t node) {
  constexpr int L = kWalkLanes;
  const int first = i / L * L;
  std::uint32_t index[L];
  for (int k = 0; k < L; ++k) index[k] = node;
  const WalkLanes<L> walks = load_walks<L, kGloss>(points, first);
  Lanes<L> words[kNodeWords];
  load_nodes<L>(walk.tree.nodes, index, words);
  const PairWeights<L> weights =
      weigh_children<L, kGloss>(walk, walks, unpack_child<L>(words, walks.position),
                                unpack_child<L>(words + kNodeWords / 2, walks.position));
  const Lanes<L> total = weights.left + weights.right;
  float left[L], right[L], totals[L];
  store_lanes<L>(weights.left * reciprocal<L>(total), left);
  store_lanes<L>(weights.right * reciprocal<L>(total), right);
  store_lanes<L>(total, totals);
  return totals[i - first] > 0 ? vec2(left[i - first], right[i - first]) : vec2(0);
}

// Probability with which the walk of point i ends at leaf `leaf`; 0 if a substitute above it catches all walks.
template <bool kGloss>
LUMI_HD inline float pdf_substitute_leaf(const SubstituteWalk& walk, const SubstituteWalkPoints& points, int i,
                                         std::uint32_t leaf) {
  const SubstituteTreeView& tree = walk.tree;
  const bool substitutes = walk.substitutes && !kGloss;
  if (tree.count <= 1) return tree.count == 1 && leaf == 0 ? 1.0f : 0.0f;
  if (substitutes && tree.root_usable) return 0;
  float pdf = 1;
  std::uint32_t node = 0;
  while (pdf > 0) {
    const vec2 p = child_probabilities<kGloss>(walk, points, i, node);
    const std::uint32_t split = tree.nodes[node].split();
    const int side = leaf > split ? 1 : 0;
    pdf *= p[side];
    const std::uint32_t flags = tree.nodes[node].child[side].mean;
    if ((flags & ChildRecord::kLeaf) != 0) return pdf;
    if (substitutes && (flags & ChildRecord::kUsable) != 0) return 0;
    node = split + static_cast<std::uint32_t>(side);
  }
  return 0;
}

}  // namespace lumigrove
