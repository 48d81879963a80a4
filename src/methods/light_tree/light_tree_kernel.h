// Method      Picks one emitter out of very many with probability close to its share of the light at a point,
// by one
//             walk down a perfect tree over the emitters in Morton order.
// Paper       D. Lin, C. Yuksel, "Real-Time Stochastic Lightcuts", Proc. ACM CGIT 3(1) (I3D 2020): 3.1
// and 3.2; cosine
//             bound and special cases as in the authors' code (distance 0, dead branches).
// Symbols     I_j -> intensity -> Y of the peak radiant intensity under child j, W/sr
//             F_j -> cosine_bound -> bound of cos at the receiver over the child's box, no material
//             d_j^min, d_j^max -> near2, far2 -> squared distance from x to the box's nearest / farthest
//             point, m^2 p_j -> probability -> of stepping to child j, given its parent
// Equations   (1) w_j^min, w_j^max and (2) their normalisation, averaged -> child_probabilities
// Departures  Nodes have W children (2 is the paper's tree; 4, 8 and 16 weigh their children in one pass over
// SoA
//             arrays, with eqs. 1-2 normalised over W instead of 2). Bogus leaves are not stored, except to
//             fill the last node of a level: their intensity is 0. Emitters of no flux are sorted last and
//             left out. Points closer than 1e-7 D to a box count as inside it. The horizon test has a
//             relative margin of 1e-6, so that rounding never makes a light at the horizon impossible.
// Estimator   unbiased: every emitter that can contribute at x has positive probability, and the probability
// returned
//             is exactly the product of the steps taken.
// In -> Out   point x, unit normal n, two uniform numbers -> emitter and probability; kNone and 0 on a dead
// branch
//             (all boxes below the horizon).
// Oracle      tests/light_tree_test.cpp: enumeration of pdf_light_tree over all emitters, chi-square of the
// walk
//             against it, mean against the exhaustive sum, LightTree::verify for the build.
#pragma once

#include <span>

#include "base/morton.h"
#include "base/vec.h"
#include "device/sort.h"
#include "lights/emitter.h"
#include "lights/light_set.h"

namespace lumigrove {

inline constexpr int kMaxTreeLevels = 32;
inline constexpr std::uint32_t kNoEmitter = 0xffffffffu;

// Node k of level l holds, for children W*k..W*k+W-1 of level l+1, seven rows of W floats.
// Boxes as centre and half extent (rounded outwards): distance and horizon then need a third fewer operations.
enum NodeRow : int { kCentreX, kCentreY, kCentreZ, kHalfX, kHalfY, kHalfZ, kIntensity, kNodeRows };

struct LightTreeView {
  const float* nodes = nullptr;
  const std::uint32_t* leaf_emitters = nullptr;  // leaf -> emitter
  const std::uint32_t* emitter_leaves =
      nullptr;  // emitter -> leaf, kNoEmitter if it has none; null unless kept
  std::uint32_t level_first[kMaxTreeLevels] = {};  // index of a level's first node, root level first
  int levels = 0;                                  // of nodes; leaves lie below the last
  int width = 0;                                   // W
  std::uint32_t count = 0;                         // leaves
  float inside2 = 0;                               // squared distance that counts as inside a box, m^2
};

// Sum of W values by halves: short dependency chain, same order on every device.
template <int W>
LUMI_HD inline float sum_lanes(const float* values) {
  float partial[W];
  for (int c = 0; c < W; ++c) partial[c] = values[c];
  for (int half = W / 2; half > 0; half /= 2)
    for (int c = 0; c < half; ++c) partial[c] += partial[c + half];
  return partial[0];
}

// Equations 1 and 2 at once for the W children of a node. Returns false, leaving `probability` undefined, when no
// child can contribute.
template <int W>
LUMI_HD inline bool child_probabilities(const float* node, float inside2, vec3 x, vec3 n, float* probability) {
  const float* centre_x = node + kCentreX * W;
  const float* centre_y = node + kCentreY * W;
  const float* centre_z = node + kCentreZ * W;
  const float* half_x = node + kHalfX * W;
  const float* half_y = node + kHalfY * W;
  const float* half_z = node + kHalfZ * W;
  const float* intensity = node + kIntensity * W;
  const vec3 abs_n = glm::abs(n);

  alignas(64) float near_weight[W], far_weight[W], inside_weight[W];
  for (int c = 0; c < W; ++c) {
    const float dx = centre_x[c] - x.x, dy = centre_y[c] - x.y, dz = centre_z[c] - x.z;
    const float ax = glm::abs(dx), ay = glm::abs(dy), az = glm::abs(dz);
    const float px = glm::max(ax - half_x[c], 0.0f), py = glm::max(ay - half_y[c], 0.0f), pz = glm::max(az - half_z[c], 0.0f);
    const float fx = ax + half_x[c], fy = ay + half_y[c], fz = az + half_z[c];
    const float near2 = px * px + py * py + pz * pz;
    const float far2 = fx * fx + fy * fy + fz * fz;
    // Highest corner of the box above the tangent plane, and height of its nearest point.
    const float height = n.x * dx + n.y * dy + n.z * dz + abs_n.x * half_x[c] + abs_n.y * half_y[c] + abs_n.z * half_z[c] +
                         1e-6f * (fx + fy + fz);
    const float along = n.x * (dx < 0 ? -px : px) + n.y * (dy < 0 ? -py : py) + n.z * (dz < 0 ? -pz : pz);
    const float tangent2 = glm::max(near2 - along * along, 0.0f);
    // weight = I cos; one division serves weight / near2 and weight / far2.
    const float near_floor = glm::max(near2, inside2), far_floor = glm::max(far2, inside2);
    const float above = glm::max(height, 0.0f);
    const float length = glm::sqrt(tangent2 + above * above);
    const float share = intensity[c] * above / glm::max(length * near_floor * far_floor, 1e-37f);
    near_weight[c] = share * far_floor;
    far_weight[c] = share * near_floor;
    inside_weight[c] = near2 <= inside2 ? near_weight[c] * near_floor : 0.0f;
  }
  const float far_sum = sum_lanes<W>(far_weight);
  if (!(far_sum > 1e-37f)) return false;  // also keeps its reciprocal finite
  const float inside_sum = sum_lanes<W>(inside_weight);
  const float* nearest = inside_sum > 0 ? inside_weight : near_weight;  // the nearest distance is 0: drop it
  const float near_scale = 0.5f / (inside_sum > 0 ? inside_sum : sum_lanes<W>(near_weight));
  const float far_scale = 0.5f / far_sum;
  for (int c = 0; c < W; ++c) probability[c] = nearest[c] * near_scale + far_weight[c] * far_scale;
  return true;
}

// Index of one of W values chosen in proportion to them, without branches: descends a binary tree of partial sums.
// `r` in [0,1) comes back rescaled to [0,1) for the next choice.
template <int W>
LUMI_HD inline int choose_lane(const float* values, float& r) {
  alignas(64) float sums[2 * W];  // W values, then their sums by halves: W/2, W/4, ... 1
  for (int c = 0; c < W; ++c) sums[c] = values[c];
  int at = 0;
  for (int half = W / 2; half > 0; at += 2 * half, half /= 2)
    for (int c = 0; c < half; ++c) sums[at + 2 * half + c] = sums[at + c] + sums[at + half + c];
  r *= sums[at];
  int lane = 0;
  for (int half = 1; half < W; half *= 2) {  // half: lanes of the level above
    at -= 2 * half;
    const float left = sums[at + lane], right = sums[at + half + lane];
    const bool take_right = (r >= left && right > 0) || !(left > 0);
    r -= take_right ? left : 0.0f;
    lane += take_right ? half : 0;
  }
  r = glm::clamp(r / values[lane], 0.0f, 0x1.fffffep-1f);
  return lane;
}

struct TreeSample {
  std::uint32_t emitter = kNoEmitter;
  float pdf = 0;
};

// One walk from the root. u.x chooses in the upper half of the levels, u.y in the lower half, so that both
// keep enough bits for any depth.
template <int W>
LUMI_HD inline TreeSample sample_light_tree(const LightTreeView& tree, vec3 x, vec3 n, vec2 u) {
  std::uint32_t node = 0;
  float pdf = 1, r = u.x;
  const int middle = (tree.levels + 1) / 2;
  for (int level = 0; level < tree.levels; ++level) {
    if (level == middle) r = u.y;
    alignas(64) float probability[W];
    const float* data =
        tree.nodes + static_cast<std::size_t>(tree.level_first[level] + node) * (kNodeRows * W);
    if (!child_probabilities<W>(data, tree.inside2, x, n, probability)) return {};
    const int chosen = choose_lane<W>(probability, r);
    pdf *= probability[chosen];
    node = node * W + static_cast<std::uint32_t>(chosen);
  }
  return {tree.leaf_emitters[node], pdf};
}

// Probability with which sample_light_tree returns `emitter`: the same products, multiplied in the same
// order.
template <int W>
LUMI_HD inline float pdf_light_tree(const LightTreeView& tree, vec3 x, vec3 n, std::uint32_t emitter) {
  const std::uint32_t leaf = tree.emitter_leaves[emitter];
  if (leaf == kNoEmitter) return 0;
  std::uint32_t span = 1;  // leaves below a child of the current level
  for (int level = 1; level < tree.levels; ++level) span *= W;
  float pdf = 1;
  for (int level = 0; level < tree.levels; ++level, span /= W) {
    alignas(64) float probability[W];
    const std::uint32_t node = leaf / span / W;
    const float* data =
        tree.nodes + static_cast<std::size_t>(tree.level_first[level] + node) * (kNodeRows * W);
    if (!child_probabilities<W>(data, tree.inside2, x, n, probability)) return 0;
    pdf *= probability[leaf / span % W];
  }
  return pdf;
}

// --- build
// ----------------------------------------------------------------------------------------------------

// Sorts after every Morton code: emitters without flux get no leaf.
inline constexpr std::uint32_t kDroppedKey = 1u << 30;

// keys[i] = (Morton code of the centre of emitter i's box, i).
struct MortonKernel {
  LightView lights;
  vec3 lo, inverse;  // quantisation box: lower corner, 1/extent
  std::span<KeyIndex> keys;

  LUMI_HD void operator()(int i) const {
    const std::uint32_t e = static_cast<std::uint32_t>(i);
    const vec3 centre = emitter_bounds(lights.emitters[e]).centre();
    const bool dropped = !(emitter_intensity(lights, e) > 0);
    keys[e] = {dropped ? kDroppedKey : morton30((centre - lo) * inverse), e};
  }
};

// Writes child `c` of the node at `data`.
template <int W>
LUMI_HD inline void store_child(float* data, int c, Box3 box, float intensity) {
  const vec3 centre = box.centre();
  // The larger side, and a little more than rounding can have taken off.
  const vec3 half = glm::max(box.hi - centre, centre - box.lo) * (1 + 1e-6f) + glm::abs(centre) * 1e-7f;
  data[kCentreX * W + c] = centre.x;
  data[kCentreY * W + c] = centre.y;
  data[kCentreZ * W + c] = centre.z;
  data[kHalfX * W + c] = half.x;
  data[kHalfY * W + c] = half.y;
  data[kHalfZ * W + c] = half.z;
  data[kIntensity * W + c] = intensity;
}

// The lowest level: node i over leaves W*i .. W*i+W-1, and the leaf -> emitter table.
template <int W>
struct LeafNodeKernel {
  LightView lights;
  std::span<const KeyIndex> keys;  // sorted
  std::uint32_t count;             // leaves
  float* nodes;                    // of this level
  std::uint32_t* leaf_emitters;
  std::uint32_t* emitter_leaves;  // or null

  LUMI_HD void operator()(int i) const {
    const std::uint32_t first = static_cast<std::uint32_t>(i) * W;
    float* data = nodes + static_cast<std::size_t>(i) * (kNodeRows * W);
    Box3 filler;  // bogus leaves repeat the first box, with no intensity
    for (int c = 0; c < W; ++c) {
      const std::uint32_t leaf = first + static_cast<std::uint32_t>(c);
      if (leaf >= count) {
        store_child<W>(data, c, filler, 0);
        continue;
      }
      const std::uint32_t e = keys[leaf].index;
      leaf_emitters[leaf] = e;
      if (emitter_leaves) emitter_leaves[e] = leaf;
      const Box3 box = emitter_bounds(lights.emitters[e]);
      if (c == 0) filler = box;
      store_child<W>(data, c, box, emitter_intensity(lights, e));
    }
  }
};

// An upper level: each child of node i summarises one node of the level below.
template <int W>
struct InnerNodeKernel {
  const float* below;
  std::uint32_t below_count;
  float* nodes;

  LUMI_HD void operator()(int i) const {
    float* data = nodes + static_cast<std::size_t>(i) * (kNodeRows * W);
    Box3 filler;
    for (int c = 0; c < W; ++c) {
      const std::uint32_t child = static_cast<std::uint32_t>(i) * W + static_cast<std::uint32_t>(c);
      if (child >= below_count) {
        store_child<W>(data, c, filler, 0);
        continue;
      }
      const float* from = below + static_cast<std::size_t>(child) * (kNodeRows * W);
      Box3 box;
      float intensity = 0;
      for (int k = 0; k < W; ++k) {
        const vec3 centre(from[kCentreX * W + k], from[kCentreY * W + k], from[kCentreZ * W + k]);
        const vec3 half(from[kHalfX * W + k], from[kHalfY * W + k], from[kHalfZ * W + k]);
        box = unite(box, Box3{centre - half, centre + half});  // bogus children repeat a real box
        intensity += from[kIntensity * W + k];
      }
      if (c == 0) filler = box;
      store_child<W>(data, c, box, intensity);
    }
  }
};

}  // namespace lumigrove
