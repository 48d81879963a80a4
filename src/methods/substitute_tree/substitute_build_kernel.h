// Method      Merges very many virtual point lights into a binary tree, in every inner node of which one Gaussian on a
//             plane stands for all lights below, where they are alike enough.
// Paper       W. Tatzgern, B. Mayr, B. Kerbl, M. Steinberger, "Stochastic Substitute Trees for Real-Time Global
//             Illumination", I3D 2020: 3.2 (substitute distributions) and 3.3 (parallel construction).
//             Topology: T. Karras, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees", HPG
//             2012, made bottom-up in the one pass that also merges, as in C. Apetrei, "Fast and Simple Agglomerative
//             LBVH Construction", CGVC 2014.
// Symbols     c -> weight, luminance(intensity) -> Y of the summed radiant intensity, W/sr
//             p -> mean -> mean position weighted by c, m, world
//             n -> normal -> unit, weighted by c, world
//             sigma^2 -> covariance -> all six terms, m^2, world; sigma_z^2 = n^T C n -> variance_along(normal)
//             nu -> nu -> agreement of the normals, 0 to 1
//             M, N, id -> morton, direction, position in sorted order: the code C of a light
//             delta -> common -> length of the common prefix of two neighbouring codes, bits
// Equations   (1) p, (2) sigma^2, and nu -> merge_distributions; (3) -> usable; (4) -> SubstituteKeyKernel,
//             SubstitutePrefixKernel
// Departures  The covariance is whole and in world space, so that nothing is lost where children lie in different
//             planes; the paper adds variances along the axes of each child's own plane. sigma_z is a standard
//             deviation, as in the authors' code. The Morton grid spans the box of the lights, not of the scene. The
//             direction code subdivides its triangle exactly; the authors' code reaches 56 of its 512 cells. Lights of
//             no intensity are left out. Nodes keep cones of the normals too. Opposed normals agree by 0.
//             Topology::kPerfect uses the position in sorted order for a code: a left-complete balanced tree.
// Estimator   none: what the walks make of the tree.
// In -> Out   lights -> nodes and distributions in Karras' order (substitute_node.h). Same bits for any number of
//             threads: a node's left and right child do not depend on who arrives first.
// Oracle      tests/substitute_tree_test.cpp: a serial recursive split, population moments in double, and every leaf
//             against every box and cone above it.
#pragma once

#include <cstdint>
#include <span>

#include "base/atomic.h"
#include "base/direction_code.h"
#include "base/lanes.h"
#include "base/morton.h"
#include "device/sort.h"
#include "methods/substitute_tree/substitute_node.h"

namespace lumigrove {

inline constexpr int kMortonBits = 30;
inline constexpr std::uint32_t kDroppedDirection = 1u << kDirectionBits;  // sorts after every direction code
inline constexpr std::uint32_t kNobody = 0xffffffffu;                     // nobody has arrived at a split yet

// Codes of light i; its key is its direction until SubstituteMortonKernel.
struct SubstituteKeyKernel {
  std::span<const Vpl> vpls;
  vec3 lo, inverse;  // quantisation box: lower corner, 1/extent
  std::uint32_t* morton;
  std::uint16_t* direction;
  std::span<KeyIndex> keys;

  LUMI_HD void operator()(int i) const {
    const Vpl& vpl = vpls[static_cast<std::size_t>(i)];
    const float weight = luminance(vpl.intensity);
    const bool kept = weight > 0 && is_finite(weight);
    const std::uint32_t code = kept ? direction_code(vpl.normal) : kDroppedDirection;
    morton[i] = morton30((vpl.position - lo) * inverse);
    direction[i] = static_cast<std::uint16_t>(code);
    keys[static_cast<std::size_t>(i)] = {code, static_cast<std::uint32_t>(i)};
  }
};

// Sorted by direction; now to be sorted by position.
struct SubstituteMortonKernel {
  const std::uint32_t* morton;
  std::span<KeyIndex> keys;

  LUMI_HD void operator()(int i) const {
    KeyIndex& key = keys[static_cast<std::size_t>(i)];
    key.key = morton[key.index];
  }
};

LUMI_HD inline int leading_zeros(std::uint32_t bits) { return bits == 0 ? 32 : 31 - highest_bit(bits); }

// leaves[i] = the i-th light, common[i] = length of the common prefix of the codes of leaves i and i + 1.
struct SubstitutePrefixKernel {
  std::span<const KeyIndex> keys;  // sorted
  const std::uint16_t* direction;
  bool perfect;  // the code is the position alone
  std::uint32_t* leaves;
  std::uint8_t* common;
  std::uint32_t* arrivals;

  LUMI_HD void operator()(int i) const {
    const auto here = static_cast<std::uint32_t>(i), next = here + 1;
    leaves[i] = keys[here].index;
    if (next >= keys.size()) return;
    arrivals[i] = kNobody;
    common[i] = static_cast<std::uint8_t>(common_prefix(here, next));
  }

  LUMI_HD int common_prefix(std::uint32_t a, std::uint32_t b) const {
    const int position = leading_zeros(a ^ b);
    if (perfect) return position;
    if (const std::uint32_t differ = keys[a].key ^ keys[b].key; differ != 0)
      return leading_zeros(differ) - (32 - kMortonBits);
    const auto differ = static_cast<std::uint32_t>(direction[keys[a].index] ^ direction[keys[b].index]);
    if (differ != 0) return kMortonBits + leading_zeros(differ) - (32 - kDirectionBits);
    return kMortonBits + kDirectionBits + position;
  }
};

// By components: GCC copies a whole vec3 that was just computed through memory, twelve cycles late.
LUMI_HD LUMI_ALWAYS_INLINE void store(vec3 v, vec3& to) {
  to.x = v.x;
  to.y = v.y;
  to.z = v.z;
}

// Weighted by the children's intensities; of which neither is zero unless both are too small for a sum.
LUMI_HD LUMI_ALWAYS_INLINE void merge_distributions(const Distribution& a, const Distribution& b, float weight_a,
                                                    float weight_b, Distribution& sum) {
  const float total = weight_a + weight_b;
  const float share_b = total > 0 ? weight_b / total : 0.5f, share_a = 1 - share_b;
  const vec3 apart = b.mean - a.mean;
  store(a.intensity + b.intensity, sum.intensity);
  store(a.mean + apart * share_b, sum.mean);  // (1)
  sum.nu = a.nu * b.nu * glm::clamp(glm::dot(a.normal, b.normal), 0.0f, 1.0f);
  const vec3 normal = a.normal * share_a + b.normal * share_b;
  const float length2 = length_squared(normal);
  const bool opposed = !(length2 > 1e-10f);
  store(opposed ? a.normal : normal * (1 / glm::sqrt(length2)), sum.normal);
  if (opposed) sum.nu = 0;
  // (2): both means' offsets from the new one make one term.
  const vec3 spread = apart * (share_a * share_b);
  const float *ca = a.covariance, *cb = b.covariance;
  const auto add = [&](int k, float outer) { return ca[k] * share_a + (cb[k] * share_b + outer); };
  sum.covariance[0] = add(0, apart.x * spread.x);
  sum.covariance[1] = add(1, apart.y * spread.y);
  sum.covariance[2] = add(2, apart.z * spread.z);
  sum.covariance[3] = add(3, apart.x * spread.y);
  sum.covariance[4] = add(4, apart.x * spread.z);
  sum.covariance[5] = add(5, apart.y * spread.z);
}

// From leaf i upwards, as far as the other child of each parent has come already.
struct SubstituteMergeKernel {
  std::span<const Vpl> vpls;
  const std::uint32_t* leaves;
  const std::uint8_t* common;  // count - 1
  std::uint32_t count;         // leaves, at least 2
  float min_nu, max_sigma, max_diagonal;
  std::uint32_t* arrivals;  // of a split, the far end of the leaves of the child that came first; kNobody before
  SubstituteNode* nodes;
  Distribution* distributions;
  NodeExtent* extents;

  LUMI_HD void operator()(int i) const {
    prefetch_leaf(static_cast<std::uint32_t>(i) + kAhead);
    prefetch_node(static_cast<std::uint32_t>(i) + kAhead);
    std::uint32_t first = static_cast<std::uint32_t>(i), last = first;
    bool left = is_left_child(first, last);
    do {
      const std::uint32_t split = left ? last : first - 1;
      const std::uint32_t other = hand_over(arrivals[split], left ? first : last, kNobody);
      if (other == kNobody) return;
      (left ? last : first) = other;
      const bool root = first == 0 && last == count - 1;
      left = !root && is_left_child(first, last);
      make_node(root ? 0 : left ? last : first, split, split == first, split + 1 == last);
    } while (first != 0 || last != count - 1);
  }

  static constexpr std::uint32_t kAhead = 16;
  LUMI_HD LUMI_ALWAYS_INLINE void prefetch_leaf(std::uint32_t leaf) const {
    if (leaf >= count) return;
    const Vpl& vpl = vpls[leaves[leaf]];
    prefetch(&vpl);
    prefetch(&vpl.intensity.z);
  }

  LUMI_HD LUMI_ALWAYS_INLINE void prefetch_node(std::uint32_t number) const {
    if (number + 1 >= count) return;
    prefetch_to_write(&nodes[number]);
    prefetch_to_write(&distributions[number]);
    prefetch_to_write(&extents[number]);
  }

  // Whether the parent of the node over leaves first..last splits its own leaves after `last`: it is the ancestor whose
  // leaves have more bits in common. Not for the root.
  LUMI_HD bool is_left_child(std::uint32_t first, std::uint32_t last) const {
    return first == 0 || (last + 1 < count && common[last] > common[first - 1]);
  }

  struct Child {
    Distribution distribution;
    Box3 box;
    PackedCone cone;
    float weight;
  };
  // Also writes its record. `split_half`: 16 bits of the split.
  LUMI_HD LUMI_ALWAYS_INLINE void load_child(std::uint32_t number, bool leaf, std::uint32_t split_half, Child& child,
                                             ChildRecord& record) const {
    if (leaf) {
      const Vpl& vpl = vpls[leaves[number]];
      child.distribution = {vpl.position, 1, vpl.normal, vpl.intensity, {}};
      child.box = {vpl.position, vpl.position};
      child.cone = pack_normal(vpl.normal);
      child.weight = luminance(vpl.intensity);
      record = {vpl.position, 0, split_half, ChildRecord::kLeaf, child.cone, child.weight};
    } else {
      child.distribution = distributions[number];
      const NodeExtent& extent = extents[number];
      child.box = extent.box;
      child.cone = extent.cone;
      child.weight = luminance(child.distribution.intensity);
      pack_child(child.box, child.distribution.mean, child.cone, child.weight, extent.flags, split_half, record);
    }
  }

  LUMI_HD void make_node(std::uint32_t number, std::uint32_t split, bool left_leaf, bool right_leaf) const {
    Child a, b;
    load_child(split, left_leaf, split & 0xffffu, a, nodes[number].child[0]);
    load_child(split + 1, right_leaf, split >> 16, b, nodes[number].child[1]);
    Distribution& sum = distributions[number];
    merge_distributions(a.distribution, b.distribution, a.weight, b.weight, sum);
    NodeExtent& extent = extents[number];
    const vec3 lo = glm::min(a.box.lo, b.box.lo), hi = glm::max(a.box.hi, b.box.hi);
    store(lo, extent.box.lo);
    store(hi, extent.box.hi);
    store(glm::clamp(sum.mean, lo, hi), sum.mean);
    extent.cone = unite(a.cone, b.cone);
    extent.flags = usable(sum, hi - lo) ? ChildRecord::kUsable : 0u;
  }

  LUMI_HD bool usable(const Distribution& d, vec3 extent) const {  // (3)
    return d.nu >= min_nu && d.variance_along(d.normal) <= max_sigma * max_sigma &&
           length_squared(extent) <= max_diagonal * max_diagonal;
  }
};

}  // namespace lumigrove
