// What a substitute tree looks like: numbers about its nodes, and ways to visit them. Host only.
#pragma once

#include <array>
#include <vector>

#include "methods/substitute_tree/substitute_node.h"

namespace lumigrove {

// An inner node as a visit from the root meets it.
struct VisitedNode {
  std::uint32_t number = 0;
  std::uint32_t first = 0, last = 0;  // leaves below it
  int level = 0;                      // 0: the root
  bool usable = false;
  bool below_substitute = false;  // a node above it is usable: walks that take substitutes never come here
  Box3 box;                       // holds its lights

  std::uint32_t lights() const { return last - first + 1; }
  // A usable node nearest the root: where walks that take substitutes stop.
  bool is_substitute() const { return usable && !below_substitute; }
};

// Every inner node, each before its children, left before right.
template <class Visit>
void for_each_inner_node(const SubstituteTreeView& tree, const Visit& visit) {
  if (tree.count < 2) return;
  std::vector<VisitedNode> waiting{{0, 0, tree.count - 1, 0, tree.root_usable, false, tree.bounds}};
  while (!waiting.empty()) {
    const VisitedNode at = waiting.back();
    waiting.pop_back();
    visit(at);
    const SubstituteNode& node = tree.nodes[at.number];
    const std::uint32_t split = node.split();
    for (const std::uint32_t side : {1u, 0u}) {
      const ChildRecord& child = node.child[side];
      if ((child.mean & ChildRecord::kLeaf) != 0) continue;
      waiting.push_back({split + side, side == 0 ? at.first : split + 1, side == 0 ? split : at.last, at.level + 1,
                         (child.mean & ChildRecord::kUsable) != 0, at.below_substitute || at.usable,
                         unpack_box(child)});
    }
  }
}

// Standard deviations of a distribution along axes of its own: the two principal ones on its surface, larger first,
// and the normal. What Figure 2b of the paper draws.
struct PrincipalAxes {
  vec3 axis[3];    // unit
  float sigma[3];  // metres
};
PrincipalAxes principal_axes(const Distribution& distribution);

// Values below which so large a share of a population lies.
inline constexpr std::array<float, 7> kQuantileShares = {0, 0.1f, 0.25f, 0.5f, 0.75f, 0.9f, 1};
using Quantiles = std::array<float, kQuantileShares.size()>;
Quantiles quantiles_of(std::vector<float> population);  // all 0 when it is empty

struct SubstituteTreeStatistics {
  std::uint32_t lights = 0, inner_nodes = 0;
  double mean_depth = 0;  // choices between two children from the root to a leaf
  int max_depth = 0;
  std::uint32_t usable_nodes = 0;
  Quantiles nu{}, sigma{};               // of the inner nodes; sigma along the normal, metres
  std::uint32_t substitutes = 0;         // usable nodes nearest the root
  std::uint32_t substituted_lights = 0;  // that lie below them
  Quantiles substitute_diagonal{};       // of their boxes, metres
  Quantiles substitute_lights{};         // below each of them
};
SubstituteTreeStatistics describe(const SubstituteTreeView& tree);

}  // namespace lumigrove
