// Many walks down the light tree at once for all points of a region; light_tree_kernel.h holds the method. As their numbers
// ascend, the walks that come to a node are neighbours, and its children are weighed once for all of them
// (P. Clarberg et al., "Wavelet Importance Sampling", SIGGRAPH 2005, warp points through a hierarchy in this way).
#pragma once

#include <span>

#include "methods/light_tree/light_tree_kernel.h"

namespace lumigrove {

// Points within `half` of `centre`, with unit normals n of |n - normal| <= spread.
struct WalkRegion {
  vec3 centre, half;  // metres
  vec3 normal;
  float spread = 0;
};

template <int W>
LUMI_HD LUMI_ALWAYS_INLINE BoxLanes<W> boxes_around_region(const LightNode<W>& node, const WalkRegion& region) {
  BoxLanes<W> boxes = load_boxes<W>(node);
  boxes.half = {boxes.half.x + region.half.x, boxes.half.y + region.half.y, boxes.half.z + region.half.z};
  return boxes;
}

// Weights of children first, ..., first + children - 1 for a region: every one that is positive for a point of it is positive. No point is nearer to a box, nor the box
// higher above its horizon, than the centre is to the box enlarged by the region, with a margin for the normals.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE ChildWeights<W> weigh_children_of_region(const LightNode<W>& node, int first, int children,
                                                                    Weighing weighing, const WalkRegion& region) {
  BoxLanes<W> boxes = boxes_around_region<W>(node, region);
  if (children < W) boxes.intensity = boxes.intensity * lanes_in_range<W>(first, children);
  weighing.horizon_margin += region.spread;
  return weigh_children<W>(boxes, node, weighing, region.centre, region.normal);
}

// Most that each child can send to a point of the region.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<W> bound_children_of_region(const LightNode<W>& node, const Weighing& weighing,
                                                             const WalkRegion& region) {
  return weigh_boxes<W>(
             boxes_around_region<W>(node, region), weighing.cones, [&] { return load_cones<W>(node); },
             weighing.nearness, broadcast<W>(region.centre), broadcast<W>(region.normal), Weights::kMinMax,
             weighing.horizon_margin + region.spread)
      .near;
}

// Walks first, ..., end - 1 of a sorted set, which have come the same way.
struct WalkRange {
  std::uint32_t node;  // of the level to come
  float pdf;
  std::uint32_t first, end;
};

// Numbers of walks, ascending, in [0,1); overwritten. `fresh` ones take over in the lower half of the levels for walks that
// go alone, so that they keep enough bits. `ranges`, `next`: room for one each a walk.
struct SortedWalks {
  std::span<float> r;
  std::span<const float> fresh;
  std::span<WalkRange> ranges, next;
};

// Walks first, ..., end - 1 start here.
struct SortedStart {
  Subtree subtree;
  std::uint32_t first, end;
};

// Sorted walks on their way down.
template <int W>
struct SortedWalk {
  const LightTreeView& tree;
  const WalkRegion& region;
  const SortedWalks& walks;
  std::span<TreeSample> samples;
  Weighing weighing;
  int level = 0;

  // One step of the walks of a range, from all children of its node or those of `start`. Those that go on are appended to
  // `next`; returns how many ranges it then has.
  LUMI_HD LUMI_ALWAYS_INLINE int step(const WalkRange& range, const Subtree* start, WalkRange* next, int kept) const {
    const LightNode<W>& node = tree.level<W>(level)[range.node];
    const ChildWeights<W> children = start ? weigh_children_of_region<W>(node, start->first, start->children, weighing, region)
                                           : weigh_children_of_region<W>(node, 0, W, weighing, region);
    const std::uint32_t positive = greater_bits<W>(children.weight, broadcast<W>(0));
    const bool last = level + 1 == tree.levels;
    float* const r = walks.r.data();
    if (!(children.total > 0) || positive == 0) {
      for (std::uint32_t i = range.first; i < range.end; ++i) samples[i] = {};
      return kept;
    }
    if (level == (tree.levels + 1) / 2 && range.end == range.first + 1) r[range.first] = walks.fresh[range.first];
    alignas(64) float weights[W], sums[W];
    store_lanes<W>(children.weight, weights);
    store_lanes<W>(children.cumulative, sums);
    for (std::uint32_t i = range.first; i < range.end;) {
      const std::uint32_t beyond = greater_bits<W>(children.cumulative, broadcast<W>(r[i] * children.total)) & positive;
      const int lane = beyond != 0 ? lowest_bit(beyond) : highest_bit(positive);
      const float before = sums[lane] - weights[lane], inverse = 1 / weights[lane];
      const float end = beyond != 0 ? sums[lane] : kInfinity;
      WalkRange child{range.node * W + static_cast<std::uint32_t>(lane), range.pdf * (weights[lane] / children.total), i,
                      i};
      for (; i < range.end && r[i] * children.total < end; ++i) {
        r[i] = glm::min(glm::max((r[i] * children.total - before) * inverse, 0.0f), 0x1.fffffep-1f);
        if (last) samples[i] = {tree.leaf_emitters[child.node], child.pdf};
      }
      if (last) continue;
      child.end = i;
      next[kept++] = child;
      prefetch_step<W>(tree, level + 1, child.node);
    }
    return kept;
  }
};

// samples[i]: of the walk with number r[i]; kNoEmitter and 0 on a dead branch. The numbers ascend within a start.
template <int W, Weights kWeights>
LUMI_HD inline void walk_light_tree_sorted(const LightTreeView& tree, const WalkRegion& region,
                                           std::span<const SortedStart> starts, const SortedWalks& walks,
                                           std::span<TreeSample> samples) {
  WalkRange *ranges = walks.ranges.data(), *next = walks.next.data();
  SortedWalk<W> walk{tree, region, walks, samples, {}, 0};
  int living = 0;
  for (int level = 0; level < tree.levels; ++level) {
    walk.level = level;
    walk.weighing = weighing_of_level(tree, level, kWeights);
    int kept = 0;
    for (int k = 0; k < living; ++k) kept = walk.step(ranges[k], nullptr, next, kept);
    for (const SortedStart& s : starts)
      if (s.subtree.level == level) kept = walk.step({s.subtree.node, 1, s.first, s.end}, &s.subtree, next, kept);
    WalkRange* const done = ranges;
    ranges = next;
    next = done;
    living = kept;
  }
}

// tree.count > 0.
LUMI_HD inline void sample_light_tree_sorted(const LightTreeView& tree, const WalkRegion& region,
                                             std::span<const SortedStart> starts, const SortedWalks& walks,
                                             std::span<TreeSample> samples) {
  with_width(tree.width, [&](auto width) {
    with_weights(tree.weights,
                 [&](auto weights) { walk_light_tree_sorted<width, weights>(tree, region, starts, walks, samples); });
  });
}

// Probability with which a walk from `start` ends at leaf number `leaf`; 0 for one that is not below.
template <int W>
LUMI_HD inline float pdf_leaf_in_region(const LightTreeView& tree, const WalkRegion& region, Subtree start,
                                        std::uint32_t leaf) {
  std::uint32_t span = 1;  // leaves below a child of the current level
  for (int level = start.level + 1; level < tree.levels; ++level) span *= W;
  const std::uint32_t lane = leaf / span % W;
  if (leaf / span / W != start.node || lane < start.first || lane >= start.first + start.children) return 0;
  float pdf = 1;
  for (int level = start.level; level < tree.levels; ++level, span /= W) {
    const LightNode<W>& node = tree.level<W>(level)[leaf / span / W];
    const Weighing weighing = weighing_of_level(tree, level, tree.weights);
    const ChildWeights<W> children =
        level == start.level ? weigh_children_of_region<W>(node, start.first, start.children, weighing, region)
                             : weigh_children_of_region<W>(node, 0, W, weighing, region);
    if (!(children.total > 0)) return 0;
    alignas(64) float weights[W];
    store_lanes<W>(children.weight, weights);
    pdf *= weights[leaf / span % W] / children.total;
  }
  return pdf;
}
LUMI_HD inline float pdf_leaf_in_region(const LightTreeView& tree, const WalkRegion& region, Subtree start,
                                        std::uint32_t leaf) {
  if (tree.count == 0) return 0;
  return with_width(tree.width, [&](auto w) { return pdf_leaf_in_region<w>(tree, region, start, leaf); });
}

}  // namespace lumigrove
