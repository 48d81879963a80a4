// Kernels that build the perfect light tree: Morton codes of its leaves, then every level from the one below it.
// The method and its header block are in light_tree_kernel.h. Leaves are emitters, or boxes that stand for something.
#pragma once

#include <span>

#include "base/morton.h"
#include "device/sort.h"
#include "lights/emitter.h"
#include "methods/light_tree/light_tree_kernel.h"

namespace lumigrove {

// Sorts after every Morton code: emitters without flux get no leaf.
inline constexpr std::uint32_t kDroppedKey = 1u << 30;

struct NodeChild {
  Box3 box;
  float intensity = 0;
  PackedCone cone;
};

template <int W>
LUMI_HD inline void store_child(LightNode<W>& node, int c, const NodeChild& child) {
  const vec3 centre = child.box.centre();
  // The larger side, and a little more than rounding can have taken off.
  const vec3 half =
      glm::max(child.box.hi - centre, centre - child.box.lo) * (1 + 1e-6f) + glm::abs(centre) * 1e-7f;
  node.centre_x[c] = centre.x;
  node.centre_y[c] = centre.y;
  node.centre_z[c] = centre.z;
  node.half_x[c] = half.x;
  node.half_y[c] = half.y;
  node.half_z[c] = half.z;
  node.intensity[c] = child.intensity;
  node.axis_x[c] = child.cone.x;
  node.axis_y[c] = child.cone.y;
  node.axis_z[c] = child.cone.z;
  node.radius[c] = child.cone.radius;
}

LUMI_HD inline NodeChild emitter_child(const LightView& lights, std::uint32_t e, float inverse_flux) {
  const NormalCone cone = emission_cone(lights, lights.emitters[e]);
  PackedCone packed = pack_axis(cone.axis);
  packed.radius = pack_radius(cone.radius + kPackedAxisError);
  return {emitter_bounds(lights.emitters[e]), emitter_intensity(lights, e) * inverse_flux, packed};
}

// In Morton order emitters lie anywhere in memory: fetches early what emitter_child will read. The instance is known
// only from the emitter, so it follows half as far ahead.
LUMI_HD LUMI_ALWAYS_INLINE void prefetch_emitters(const LightView& lights, std::span<const KeyIndex> keys,
                                                  std::uint32_t leaf, std::uint32_t ahead) {
  if (leaf + 2 * ahead >= keys.size()) return;
  const Emitter& emitter = lights.emitters[keys[leaf + 2 * ahead].index];
  prefetch(&emitter);
  prefetch(&emitter.source);
  const Emitter& next = lights.emitters[keys[leaf + ahead].index];
  if (!next.triangle()) return;
  prefetch(&lights.instances[next.source]);
  prefetch(&lights.instances[next.source].masked);
}

// The emitters themselves as leaves. Intensities are shares of all local flux.
struct EmitterLeaves {
  LightView lights;
  float inverse_flux;

  LUMI_HD Box3 box(std::uint32_t e) const { return emitter_bounds(lights.emitters[e]); }
  LUMI_HD float intensity(std::uint32_t e) const { return emitter_intensity(lights, e); }
  LUMI_HD NodeChild child(std::uint32_t e) const { return emitter_child(lights, e, inverse_flux); }
  LUMI_HD LUMI_ALWAYS_INLINE void prefetch_ahead(std::span<const KeyIndex> keys, std::uint32_t leaf,
                                                 std::uint32_t ahead) const {
    prefetch_emitters(lights, keys, leaf, ahead);
  }
};

// Boxes as leaves. Intensities are shares of their total.
struct BoxLeaves {
  std::span<const NodeChild> boxes;
  float inverse_total;

  LUMI_HD Box3 box(std::uint32_t i) const { return boxes[i].box; }
  LUMI_HD float intensity(std::uint32_t i) const { return boxes[i].intensity; }
  LUMI_HD NodeChild child(std::uint32_t i) const {
    return {boxes[i].box, boxes[i].intensity * inverse_total, boxes[i].cone};
  }
  LUMI_HD LUMI_ALWAYS_INLINE void prefetch_ahead(std::span<const KeyIndex> keys, std::uint32_t leaf,
                                                 std::uint32_t ahead) const {
    if (leaf + ahead < keys.size()) prefetch(&boxes[keys[leaf + ahead].index]);
  }
};

// keys[i] = (Morton code of the centre of leaf i's box, i).
template <class Leaves>
struct MortonKernel {
  Leaves leaves;
  vec3 lo, inverse;  // quantisation box: lower corner, 1/extent
  std::span<KeyIndex> keys;

  LUMI_HD void operator()(int i) const {
    const std::uint32_t e = static_cast<std::uint32_t>(i);
    const vec3 centre = leaves.box(e).centre();
    const bool dropped = !(leaves.intensity(e) > 0);
    keys[e] = {dropped ? kDroppedKey : morton30((centre - lo) * inverse), e};
  }
};

// The lowest level: node i over leaves W*i .. W*i+W-1, and the leaf -> emitter table.
template <int W, class Leaves>
struct LeafNodeKernel {
  Leaves leaves;
  std::span<const KeyIndex> keys;  // sorted
  std::uint32_t count;             // leaves
  LightNode<W>* nodes;  // of this level
  std::uint32_t* leaf_emitters;
  std::uint32_t* emitter_leaves;  // or null

  LUMI_HD void operator()(int i) const {
    const std::uint32_t first = static_cast<std::uint32_t>(i) * W;
    NodeChild filler;  // bogus leaves repeat the first box, with no intensity
    for (int c = 0; c < W; ++c) {
      const std::uint32_t leaf = first + static_cast<std::uint32_t>(c);
      if (leaf >= count) {
        store_child(nodes[i], c, filler);
        continue;
      }
      leaves.prefetch_ahead(keys, leaf, W);
      const std::uint32_t e = keys[leaf].index;
      leaf_emitters[leaf] = e;
      if (emitter_leaves) emitter_leaves[e] = leaf;
      const NodeChild child = leaves.child(e);
      if (c == 0) filler = {child.box, 0, child.cone};
      store_child(nodes[i], c, child);
    }
  }
};

// One child that stands for all children of `node`. Bogus ones repeat a real box and a real cone.
template <int W>
LUMI_HD inline NodeChild summarise_node(const LightNode<W>& node) {
  NodeChild sum;
  vec3 axes(0);
  for (int k = 0; k < W; ++k) {
    const vec3 centre(node.centre_x[k], node.centre_y[k], node.centre_z[k]);
    const vec3 half(node.half_x[k], node.half_y[k], node.half_z[k]);
    sum.box = unite(sum.box, Box3{centre - half, centre + half});
    sum.intensity += node.intensity[k];
    axes += vec3(node.axis_x[k], node.axis_y[k], node.axis_z[k]);
  }
  const float length = glm::length(axes);
  sum.cone = pack_axis(length > 0.5f ? axes / length : vec3(0));
  float radius = 0;
  for (int k = 0; k < W; ++k) {
    const PackedCone cone{node.axis_x[k], node.axis_y[k], node.axis_z[k], node.radius[k]};
    radius = glm::max(radius, cone.width() + glm::length(cone.axis() - sum.cone.axis()));
  }
  sum.cone.radius = pack_radius(radius);
  return sum;
}

// An upper level: each child of node i summarises one node of the level below.
template <int W>
struct InnerNodeKernel {
  const LightNode<W>* below;
  std::uint32_t below_count;
  LightNode<W>* nodes;

  LUMI_HD void operator()(int i) const {
    NodeChild filler;
    for (int c = 0; c < W; ++c) {
      const std::uint32_t child = static_cast<std::uint32_t>(i) * W + static_cast<std::uint32_t>(c);
      if (child >= below_count) {
        store_child(nodes[i], c, filler);
        continue;
      }
      const NodeChild sum = summarise_node(below[child]);
      if (c == 0) filler = {sum.box, 0, sum.cone};
      store_child(nodes[i], c, sum);
    }
  }
};

}  // namespace lumigrove
