// What the builders of light BVHs share. Nodes lie in preorder: a subtree of k leaves takes k - 1 nodes, its left part
// right behind its root, so that every place is known before the part is built.
#pragma once

#include <span>

#include "methods/light_bvh/light_bvh_costs.h"
#include "methods/light_bvh/light_bvh_kernel.h"
#include "methods/light_tree/light_tree_build_kernel.h"

namespace lumigrove {

// Emitters that shine, in Morton order.
struct BvhInput {
  std::span<const std::uint32_t> emitters;       // numbers in the light set
  std::span<const EmitterCluster> clusters;  // one of each
  std::span<const NodeChild> children;           // the same as nodes store it
  float scene_diagonal = 1;
};

struct BvhOutput {
  std::span<LightBvhNode> nodes;         // the root's place is 1
  std::span<std::uint32_t> leaf_places;  // number of a leaf -> place in the input
};

// A subtree, as its parent stores it.
struct BvhPart {
  NodeChild child;
  float moment = 0;
  std::uint32_t count = 0;
  std::uint32_t link = kBvhLeaf;
};

inline BvhPart leaf_part(const BvhInput& input, std::uint32_t place) {
  const NodeChild& child = input.children[place];
  return {child, child.intensity * child.intensity, 1, kBvhLeaf | input.emitters[place]};
}

inline BvhPart unite(const BvhPart& a, const BvhPart& b) {
  BvhPart both;
  both.child = {unite(a.child.box, b.child.box), a.child.intensity + b.child.intensity,
                unite(a.child.cone, b.child.cone)};
  both.moment = a.moment + b.moment;
  both.count = a.count + b.count;
  return both;
}

inline void store_parts(LightBvhNode& node, const BvhPart& a, const BvhPart& b, std::uint32_t first) {
  for (int c = 0; c < 2; ++c) {
    const BvhPart& part = c == 0 ? a : b;
    store_child(node.bounds, c, part.child);
    node.child[c] = part.link;
    node.count[c] = part.count;
    node.moment[c] = part.moment;
  }
  node.first = first;
  node.unused = 0;
}

// Both fill `output` and return the whole tree. At least one emitter.
BvhPart build_saoh(const BvhInput& input, const BvhOutput& output);
BvhPart build_agglomerative(const BvhInput& input, const BvhOutput& output);

}  // namespace lumigrove
