#include "methods/substitute_tree/substitute_tree.h"

#include <algorithm>

#include "base/stopwatch.h"
#include "device/device.h"
#include "methods/substitute_tree/substitute_build_kernel.h"

namespace lumigrove {

void SubstituteTree::build(const VplView& lights, const Options& options) {
  const Stopwatch watch;
  view_ = {};
  view_.vpls = lights.vpls;
  sort_lights(lights);
  link_leaves(options.topology);
  if (view_.count > 1) {
    merge(options);
  } else if (view_.count == 1) {
    const Vpl& only = lights.vpls[leaves_[0]];
    view_.bounds = {only.position, only.position};
    view_.intensity = luminance(only.intensity);
  }
  build_ms_ = watch.ms();
}

// By position, then direction, then index: sorts are stable.
void SubstituteTree::sort_lights(const VplView& lights) {
  const std::size_t n = lights.vpls.size();
  keys_.resize(n);
  morton_.resize(n);
  direction_.resize(n);
  launch(static_cast<int>(n), SubstituteKeyKernel{lights.vpls, lights.bounds.lo, inverse_extent(lights.bounds),
                                                  morton_.data(), direction_.data(), keys_});
  radix_sort(keys_, kDirectionBits + 1, sort_scratch_);
  const auto dropped =
      std::partition_point(keys_.begin(), keys_.end(), [](KeyIndex k) { return k.key < kDroppedDirection; });
  view_.count = static_cast<std::uint32_t>(dropped - keys_.begin());
  keys_.resize(view_.count);
  launch(static_cast<int>(view_.count), SubstituteMortonKernel{morton_.data(), keys_});
  radix_sort(keys_, kMortonBits, sort_scratch_);
}

void SubstituteTree::link_leaves(Topology topology) {
  const std::size_t inner = view_.count > 0 ? view_.count - 1 : 0;
  leaves_.resize(view_.count);
  common_.resize(inner);
  arrivals_.resize(inner);
  launch(static_cast<int>(view_.count),
         SubstitutePrefixKernel{keys_, direction_.data(), topology == Topology::kPerfect, leaves_.data(),
                                common_.data(), arrivals_.data()});
  nodes_.resize(inner);
  distributions_.resize(inner);
  extents_.resize(inner);
}

void SubstituteTree::merge(const Options& options) {
  launch(static_cast<int>(view_.count),
         SubstituteMergeKernel{view_.vpls, leaves_.data(), common_.data(), view_.count, options.min_nu,
                               options.max_sigma, options.max_diagonal, arrivals_.data(), nodes_.data(),
                               distributions_.data(), extents_.data()},
         2048);
  view_.root_usable = extents_[0].flags != 0;
  view_.bounds = extents_[0].box;
  view_.intensity = luminance(distributions_[0].intensity);
}

SubstituteTreeView SubstituteTree::view() const {
  SubstituteTreeView view = view_;
  view.nodes = nodes_.data();
  view.distributions = distributions_.data();
  view.leaves = leaves_.data();
  return view;
}

std::size_t SubstituteTree::bytes() const {
  return nodes_.size() * sizeof(SubstituteNode) + distributions_.size() * sizeof(Distribution) +
         leaves_.size() * sizeof(std::uint32_t);
}

std::size_t SubstituteTree::scratch_bytes() const {
  return (keys_.capacity() + sort_scratch_.capacity()) * sizeof(KeyIndex) +
         (morton_.capacity() + arrivals_.capacity()) * sizeof(std::uint32_t) +
         direction_.capacity() * sizeof(std::uint16_t) + common_.capacity() +
         extents_.capacity() * sizeof(NodeExtent);
}

}  // namespace lumigrove
