// Nodes of the substitute tree as they lie in memory. substitute_build_kernel.h makes them, substitute_walk_kernel.h
// walks them.
//
// N lights in tree order are leaves 0..N-1. Inner node i has a SubstituteNode (what a walk needs to choose between its
// two children) and a Distribution (what a walk that stops there draws from). Both lie in Karras' order: the root is
// node 0; a node that splits its leaves between g and g+1 has the children g (left) and g+1 (right), each a leaf or an
// inner node of that number. With one light there is no inner node; the root is then leaf 0.
#pragma once

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
  std::uint32_t mean;          // 10 bits an axis (x lowest) of (mean - lo) / extent, and flags
  PackedCone cone;             // holds the normals of all lights below
  float intensity;             // Y of the lights' summed intensity, W/sr

  static constexpr std::uint32_t kLeaf = 1u << 30;    // the child is a leaf
  static constexpr std::uint32_t kUsable = 1u << 31;  // its distribution may stand for its lights
};

// One cache line.
struct alignas(64) SubstituteNode {
  ChildRecord child[2];

  LUMI_HD std::uint32_t split() const {  // number of the left child; the right one's is one more
    return (child[0].extent_z & 0xffffu) | (child[1].extent_z << 16);
  }
};
static_assert(sizeof(ChildRecord) == 32 && sizeof(SubstituteNode) == 64);

// One cache line: the lights below a node as one Gaussian. Of a single light: mean = position, covariance 0, nu 1.
struct alignas(64) Distribution {
  vec3 mean;            // weighted by intensity, world
  float nu;             // agreement of the normals: product over all merges of max(n1 . n2, 0)
  vec3 intensity;       // summed, W/sr
  vec3 normal;          // unit, weighted by intensity
  float covariance[6];  // xx, yy, zz, xy, xz, yz; world, m^2

  LUMI_HD vec3 times_covariance(vec3 v) const {
    const float* c = covariance;
    return vec3(c[0] * v.x + c[3] * v.y + c[4] * v.z, c[3] * v.x + c[1] * v.y + c[5] * v.z,
                c[4] * v.x + c[5] * v.y + c[2] * v.z);
  }
  LUMI_HD float variance_along(vec3 direction) const { return glm::dot(direction, times_covariance(direction)); }
};
static_assert(sizeof(Distribution) == 64);

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
