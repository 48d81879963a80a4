#include "methods/light_tree/light_tree.h"

#include <algorithm>

#include "base/stopwatch.h"
#include "device/device.h"
#include "lumigrove/error.h"
#include "methods/light_tree/light_tree_build_kernel.h"

namespace lumigrove {

void LightTree::build(const LightView& lights, const Options& options) {
  const float inverse_flux = lights.local_flux > 0 ? 1 / std::min(lights.local_flux, 1e37f) : 0;
  build_over(EmitterLeaves{lights, inverse_flux}, lights.emitters.size(), lights.bounds, lights.diagonal, options);
}

void LightTree::build(const BoxLeaves& leaves, const Box3& bounds, float diagonal, const Options& options) {
  build_over(leaves, leaves.boxes.size(), bounds, diagonal, options);
}

void LightTree::free_buffers() {
  LargeArray<KeyIndex>().swap(keys_);
  LargeArray<KeyIndex>().swap(scratch_);
}

template <class Leaves>
void LightTree::build_over(const Leaves& leaves, std::size_t count, const Box3& bounds, float diagonal,
                           const Options& options) {
  const int w = options.width;
  if (w != 2 && w != 4 && w != 8 && w != 16)
    throw Error("a light tree has 2, 4, 8 or 16 children a node, not " + std::to_string(w));
  const Stopwatch watch;
  view_ = {};
  view_.width = w;
  view_.weights = options.weights;
  // Not below the smallest distance whose square a float resolves against the scene.
  view_.inside2 = std::max(1e-14f * diagonal * diagonal, 1e-30f);
  view_.floor2 = std::max(view_.inside2, options.floor * options.floor);

  keys_.resize(count);
  launch(static_cast<int>(count), MortonKernel<Leaves>{leaves, bounds.lo, inverse_extent(bounds), keys_}, 4096);
  radix_sort(keys_, 31, scratch_);
  const auto dropped =
      std::partition_point(keys_.begin(), keys_.end(), [](KeyIndex k) { return k.key < kDroppedKey; });
  view_.count = static_cast<std::uint32_t>(dropped - keys_.begin());

  leaf_emitters_.resize(view_.count);
  emitter_leaves_.clear();
  if (options.keep_leaves) emitter_leaves_.assign(count, kNoEmitter);
  with_width(options.width, [&](auto width) { build_levels<width>(leaves); });
  if (!options.cones) view_.first_cones = view_.levels;
  build_ms_ = watch.ms();
}

template <int W, class Leaves>
void LightTree::build_levels(const Leaves& leaves) {
  std::vector<std::uint32_t> counts;  // nodes a level, lowest first
  for (std::uint32_t n = view_.count; n > 0 && (counts.empty() || n > 1);)
    counts.push_back(n = (n + W - 1) / W);
  view_.levels = static_cast<int>(counts.size());
  if (view_.levels > 0)
    view_.root_children = static_cast<int>(view_.levels > 1 ? counts[counts.size() - 2] : view_.count);
  std::uint32_t total = 0;
  for (int level = 0; level < view_.levels; ++level) {
    view_.level_first[level] = total;
    total += counts[static_cast<std::size_t>(view_.levels - 1 - level)];
  }
  nodes_.resize(total * sizeof(LightNode<W>));
  auto* const nodes = reinterpret_cast<LightNode<W>*>(nodes_.data());

  for (int level = view_.levels - 1; level >= 0; --level) {
    const std::uint32_t count = counts[static_cast<std::size_t>(view_.levels - 1 - level)];
    LightNode<W>* const here = nodes + view_.level_first[level];
    if (level == view_.levels - 1) {
      launch(static_cast<int>(count),
             LeafNodeKernel<W, Leaves>{leaves, keys_, view_.count, here, leaf_emitters_.data(),
                                       emitter_leaves_.empty() ? nullptr : emitter_leaves_.data()},
             1024 / W);
    } else {
      const std::uint32_t below = counts[static_cast<std::size_t>(view_.levels - 2 - level)];
      launch(static_cast<int>(count), InnerNodeKernel<W>{nodes + view_.level_first[level + 1], below, here},
             4096 / W);
    }
  }
  view_.first_cones = find_first_cones<W>();
}

// The cones of upper levels hold nearly all directions: they would only cost time. Looks at small levels only, so
// that the search does not show beside the build.
template <int W>
int LightTree::find_first_cones() const {
  constexpr std::uint32_t kSmallLevel = 512;
  const auto* nodes = reinterpret_cast<const LightNode<W>*>(nodes_.data());
  for (int level = 0; level + 1 < view_.levels; ++level) {
    const std::uint32_t first = view_.level_first[level], end = view_.level_first[level + 1];
    if (end - first > kSmallLevel) return level;
    float sum = 0, intensity = 0;
    for (std::uint32_t i = first; i < end; ++i) {
      for (int c = 0; c < W; ++c) {
        sum += nodes[i].intensity[c] * static_cast<float>(nodes[i].radius[c]) * (2 / kConeRadius);
        intensity += nodes[i].intensity[c];
      }
    }
    constexpr float kUseful = 1.2f;  // |n' - axis| of normals 74 degrees away
    if (sum < kUseful * intensity) return level;
  }
  return std::max(0, view_.levels - 1);
}

LightTreeView LightTree::view() const {
  LightTreeView view = view_;
  view.nodes = nodes_.data();
  view.leaf_emitters = leaf_emitters_.data();
  view.emitter_leaves = emitter_leaves_.empty() ? nullptr : emitter_leaves_.data();
  return view;
}

std::size_t LightTree::bytes() const {
  return nodes_.size() +
         (leaf_emitters_.size() + emitter_leaves_.size()) * sizeof(std::uint32_t);
}

}  // namespace lumigrove
