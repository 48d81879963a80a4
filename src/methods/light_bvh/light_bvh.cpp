#include "methods/light_bvh/light_bvh.h"

#include <algorithm>

#include "base/stopwatch.h"
#include "device/device.h"
#include "device/sort.h"
#include "lumigrove/error.h"
#include "methods/light_bvh/light_bvh_build.h"

namespace lumigrove {

void LightBvh::build(const LightView& lights, const Options& options) {
  if (options.builder != Hierarchy::kSaoh && options.builder != Hierarchy::kAgglomerative)
    throw Error("a light BVH is built by 'saoh' or 'agglomerative'");
  const Stopwatch watch;
  const int emitters = static_cast<int>(lights.emitters.size());
  view_ = {};
  view_.weights = options.weights;
  view_.cones = options.cones;
  view_.inside2 = std::max(1e-14f * lights.diagonal * lights.diagonal, 1e-30f);
  const float unit = lights.bounds.diagonal();
  view_.unit2 = std::max(unit * unit, view_.inside2);
  view_.floor2 = std::max(view_.inside2, options.floor * options.floor);

  // Morton order first: neighbours in space are then neighbours in memory.
  LargeArray<KeyIndex> keys(static_cast<std::size_t>(emitters)), scratch;
  launch(emitters, MortonKernel<EmitterLeaves>{{lights, 1}, lights.bounds.lo, inverse_extent(lights.bounds), keys});
  radix_sort(keys, 31, scratch);
  const auto dropped =
      std::partition_point(keys.begin(), keys.end(), [](KeyIndex k) { return k.key < kDroppedKey; });
  const auto count = static_cast<std::size_t>(dropped - keys.begin());
  view_.count = static_cast<std::uint32_t>(count);
  nodes_.clear();
  emitter_leaves_.assign(static_cast<std::size_t>(emitters), kNoEmitter);
  if (count > 0) {
    const float inverse_flux = lights.local_flux > 0 ? 1 / std::min(lights.local_flux, 1e37f) : 0;
    std::vector<std::uint32_t> numbers(count), leaf_places(count);
    std::vector<EmitterCluster> clusters(count);
    std::vector<NodeChild> children(count);
    launch(static_cast<int>(count), [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      numbers[k] = keys[k].index;
      clusters[k] = emitter_cluster(lights, numbers[k], inverse_flux);
      children[k] = emitter_child(lights, numbers[k], inverse_flux);
    });
    nodes_.resize(count);
    const BvhInput input{numbers, clusters, children, lights.diagonal};
    const BvhOutput output{nodes_, leaf_places};
    const BvhPart root =
        options.builder == Hierarchy::kSaoh ? build_saoh(input, output) : build_agglomerative(input, output);
    BvhPart nothing;
    nothing.child = {root.child.box, 0, root.child.cone};
    store_parts(nodes_[0], root, nothing, 0);
    for (std::uint32_t leaf = 0; leaf < count; ++leaf) emitter_leaves_[numbers[leaf_places[leaf]]] = leaf;
  }
  build_ms_ = watch.ms();
}

LightBvhView LightBvh::view() const {
  LightBvhView view = view_;
  view.nodes = nodes_.data();
  view.emitter_leaves = emitter_leaves_.data();
  return view;
}

std::size_t LightBvh::bytes() const {
  return nodes_.size() * sizeof(LightBvhNode) + emitter_leaves_.size() * sizeof(std::uint32_t);
}

}  // namespace lumigrove
