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
enum NodeRow : int { kLoX, kLoY, kLoZ, kHiX, kHiY, kHiZ, kIntensity, kNodeRows };

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

// Equations 1 and 2 at once for the W children of a node. Returns false, leaving `probability` undefined,
// when no child can contribute.
template <int W>
LUMI_HD inline bool child_probabilities(const float* node, float inside2, vec3 x, vec3 n,
                                        float* probability) {
  const float* lo_x = node + kLoX * W;
  const float* lo_y = node + kLoY * W;
  const float* lo_z = node + kLoZ * W;
  const float* hi_x = node + kHiX * W;
  const float* hi_y = node + kHiY * W;
  const float* hi_z = node + kHiZ * W;
  const float* intensity = node + kIntensity * W;
  // The corner farthest along n decides whether any of the box is above the horizon.
  const float* top_x = n.x > 0 ? hi_x : lo_x;
  const float* top_y = n.y > 0 ? hi_y : lo_y;
  const float* top_z = n.z > 0 ? hi_z : lo_z;

  alignas(64) float near_weight[W], far_weight[W], inside_weight[W];
  for (int c = 0; c < W; ++c) {
    const float dx = glm::max(glm::max(lo_x[c] - x.x, 0.0f), x.x - hi_x[c]);
    const float dy = glm::max(glm::max(lo_y[c] - x.y, 0.0f), x.y - hi_y[c]);
    const float dz = glm::max(glm::max(lo_z[c] - x.z, 0.0f), x.z - hi_z[c]);
    const float sx = lo_x[c] > x.x ? dx : -dx, sy = lo_y[c] > x.y ? dy : -dy, sz = lo_z[c] > x.z ? dz : -dz;
    const float near2 = dx * dx + dy * dy + dz * dz;
    const float fx = glm::max(x.x - lo_x[c], hi_x[c] - x.x);
    const float fy = glm::max(x.y - lo_y[c], hi_y[c] - x.y);
    const float fz = glm::max(x.z - lo_z[c], hi_z[c] - x.z);
    const float far2 = glm::max(fx * fx + fy * fy + fz * fz, inside2);

    const float hx = n.x * (top_x[c] - x.x), hy = n.y * (top_y[c] - x.y), hz = n.z * (top_z[c] - x.z);
    const float height = hx + hy + hz + 1e-6f * (glm::abs(hx) + glm::abs(hy) + glm::abs(hz));
    const float along = n.x * sx + n.y * sy + n.z * sz;
    const float tangent2 = glm::max(near2 - along * along, 0.0f);
    const float cosine_bound = height > 0 ? height / glm::sqrt(tangent2 + height * height) : 0.0f;

    const float weight = intensity[c] * cosine_bound;
    inside_weight[c] = near2 <= inside2 ? weight : 0.0f;
    near_weight[c] = weight / glm::max(near2, inside2);
    far_weight[c] = weight / far2;
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
    float below = 0;
    int chosen = -1;
    float chosen_below = 0;
    for (int c = 0; c < W; ++c) {  // last child of positive probability that starts at or below r
      const bool take = probability[c] > 0 && below <= r;
      chosen = take ? c : chosen;
      chosen_below = take ? below : chosen_below;
      below += probability[c];
    }
    const float p = probability[chosen];
    r = glm::clamp((r - chosen_below) / p, 0.0f, 0x1.fffffep-1f);
    pdf *= p;
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
  data[kLoX * W + c] = box.lo.x;
  data[kLoY * W + c] = box.lo.y;
  data[kLoZ * W + c] = box.lo.z;
  data[kHiX * W + c] = box.hi.x;
  data[kHiY * W + c] = box.hi.y;
  data[kHiZ * W + c] = box.hi.z;
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
        const vec3 lo(from[kLoX * W + k], from[kLoY * W + k], from[kLoZ * W + k]);
        const vec3 hi(from[kHiX * W + k], from[kHiY * W + k], from[kHiZ * W + k]);
        box = unite(box, Box3{lo, hi});  // bogus children repeat a real box
        intensity += from[kIntensity * W + k];
      }
      if (c == 0) filler = box;
      store_child<W>(data, c, box, intensity);
    }
  }
};

}  // namespace lumigrove
