// Nodes of the substitute tree as they lie in memory. substitute_build_kernel.h makes them, substitute_walk_kernel.h
// walks them.
//
// N lights in tree order are leaves 0..N-1. Inner node i has a SubstituteNode (what a walk needs to choose between its
// two children) and a Distribution (what a walk that stops there draws from). Both lie in Karras' order: the root is
// node 0; a node that splits its leaves between g and g+1 has the children g (left) and g+1 (right), each a leaf or an
// inner node of that number. With one light there is no inner node; the root is then leaf 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "base/vec.h"
#include "lights/packed_cone.h"
#include "lights/vpl.h"

namespace lumigrove {

// 32 bytes: what the parent knows of a child.
struct ChildRecord {
  vec3 lo;                     // of the box
  std::uint32_t extent_xy;     // of the box, bfloat16 rounded up: x in the low half, y in the high half
  std::uint32_t extent_z;      // z in the high half; in the low half 16 bits of the split (SubstituteNode::split)
  std::uint32_t mean;          // 10 bits an axis (x lowest) of (mean - lo) / extent, 1 = kMeanSteps; and flags
  PackedCone cone;             // holds the normals of all lights below
  float intensity;             // Y of the lights' summed intensity, W/sr

  static constexpr std::uint32_t kLeaf = 1u << 30;    // the child is a leaf
  static constexpr std::uint32_t kUsable = 1u << 31;  // its distribution may stand for its lights
  static constexpr std::uint32_t kMeanBits = 10, kMeanSteps = (1u << kMeanBits) - 1;
};

// bfloat16 in the low half: the least one not below x >= 0.
LUMI_HD inline std::uint32_t bfloat16_up(float x) {
  std::uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return (bits + 0xffffu) >> 16;
}
LUMI_HD inline float bfloat16_value(std::uint32_t low_half) {
  const std::uint32_t bits = low_half << 16;
  float x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

// Least packed extent with lo + extent >= hi, also when that is rounded to a float.
LUMI_HD inline std::uint32_t pack_extent(float lo, float hi) {
  const std::uint32_t up = bfloat16_up(hi - lo);
  return lo + bfloat16_value(up) < hi ? up + 1 : up;
}

// In steps of the extent; 0 where the box is flat.
LUMI_HD inline std::uint32_t pack_mean(float lo, float inverse_extent, float mean) {
  constexpr float kTop = ChildRecord::kMeanSteps;
  const float steps = (mean - lo) * inverse_extent * kTop + 0.5f;
  const float positive = steps > 0 ? steps : 0;  // also where NaN
  return static_cast<std::uint32_t>(static_cast<int>(positive < kTop ? positive : kTop));
}

// `flags`: kLeaf, kUsable. `split_half`: 16 bits of the node's split, the low ones in the left child. Writes in place,
// because a record copied right after it was made waits for its parts.
LUMI_HD inline void pack_child(const Box3& box, vec3 mean, PackedCone cone, float intensity, std::uint32_t flags,
                               std::uint32_t split_half, ChildRecord& child) {
  const std::uint32_t x = pack_extent(box.lo.x, box.hi.x), y = pack_extent(box.lo.y, box.hi.y),
                      z = pack_extent(box.lo.z, box.hi.z);
  const vec3 inverse = 1.0f / vec3(bfloat16_value(x), bfloat16_value(y), bfloat16_value(z));
  const std::uint32_t packed = pack_mean(box.lo.x, inverse.x, mean.x) |
                               pack_mean(box.lo.y, inverse.y, mean.y) << ChildRecord::kMeanBits |
                               pack_mean(box.lo.z, inverse.z, mean.z) << (2 * ChildRecord::kMeanBits);
  child.lo = box.lo;
  child.extent_xy = x | (y << 16);
  child.extent_z = split_half | (z << 16);
  child.mean = packed | flags;
  child.cone = cone;
  child.intensity = intensity;
}

LUMI_HD inline vec3 unpack_extent(const ChildRecord& child) {
  return vec3(bfloat16_value(child.extent_xy & 0xffffu), bfloat16_value(child.extent_xy >> 16),
              bfloat16_value(child.extent_z >> 16));
}

// Holds all lights below.
LUMI_HD inline Box3 unpack_box(const ChildRecord& child) { return {child.lo, child.lo + unpack_extent(child)}; }

// Within half a step of the mean, an axis.
LUMI_HD inline vec3 unpack_mean(const ChildRecord& child) {
  const auto steps = [&](std::uint32_t axis) {
    return static_cast<float>((child.mean >> (axis * ChildRecord::kMeanBits)) & ChildRecord::kMeanSteps);
  };
  return child.lo + unpack_extent(child) * (vec3(steps(0), steps(1), steps(2)) * (1.0f / ChildRecord::kMeanSteps));
}

// One cache line.
struct alignas(64) SubstituteNode {
  ChildRecord child[2];

  LUMI_HD std::uint32_t split() const {  // number of the left child; the right one's is one more
    return (child[0].extent_z & 0xffffu) | (child[1].extent_z << 16);
  }
};
static_assert(sizeof(ChildRecord) == 32 && sizeof(SubstituteNode) == 64);

// One cache line: the lights below a node as one Gaussian. Of a single light: mean = position, covariance 0, nu 1. The
// first ten words mean the same as a Vpl's, but for nu, so that both are read alike.
struct alignas(64) Distribution {
  vec3 mean;            // weighted by intensity, world
  float nu;             // agreement of the normals: product over all merges of max(n1 . n2, 0)
  vec3 normal;          // unit, weighted by intensity
  vec3 intensity;       // summed, W/sr
  float covariance[6];  // xx, yy, zz, xy, xz, yz; world, m^2

  LUMI_HD vec3 times_covariance(vec3 v) const {
    const float* c = covariance;
    return vec3(c[0] * v.x + c[3] * v.y + c[4] * v.z, c[3] * v.x + c[1] * v.y + c[5] * v.z,
                c[4] * v.x + c[5] * v.y + c[2] * v.z);
  }
  LUMI_HD float variance_along(vec3 direction) const { return glm::dot(direction, times_covariance(direction)); }
};
static_assert(sizeof(Distribution) == 64 && offsetof(Distribution, normal) == offsetof(Vpl, normal) &&
              offsetof(Distribution, intensity) == offsetof(Vpl, intensity));

// During the build only: what the parent of an inner node needs and does not find in the Distribution.
struct alignas(32) NodeExtent {
  Box3 box;  // exact
  PackedCone cone;
  std::uint32_t flags;  // of ChildRecord
};

struct SubstituteTreeView {
  const SubstituteNode* nodes = nullptr;         // N - 1
  const Distribution* distributions = nullptr;   // N - 1
  const std::uint32_t* leaves = nullptr;         // N: leaf -> index into `vpls`
  std::span<const Vpl> vpls;
  std::uint32_t count = 0;                       // N, lights of positive intensity
  bool root_usable = false;                      // the root's own distribution may stand for all lights
  Box3 bounds;                                   // of all lights
  float intensity = 0;                           // Y of all lights, W/sr

  LUMI_HD const Vpl& leaf(std::uint32_t i) const { return vpls[leaves[i]]; }
};

}  // namespace lumigrove
