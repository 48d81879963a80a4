// The substitute tree: build and storage. substitute_build_kernel.h holds the method and its header block.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/large_array.h"
#include "device/sort.h"
#include "lumigrove/settings.h"
#include "methods/substitute_tree/substitute_node.h"

namespace lumigrove {

class SubstituteTree {
 public:
  struct Options {
    Topology topology = Topology::kRadix;
    float min_nu = 0.5f;               // least agreement of normals of a usable node
    float max_sigma = 0;               // most standard deviation along the normal of a usable node, metres
    float max_diagonal = kInfinity;    // most diagonal of a usable node's box, metres
  };
  // Keeps a reference to the lights. Lights of no intensity are left out. Buffers are reused by the next build.
  void build(const VplView& lights, const Options& options);

  SubstituteTreeView view() const;
  std::size_t bytes() const;          // nodes, distributions and leaves; not the buffers of the build
  std::size_t scratch_bytes() const;  // the buffers of the build
  double build_ms() const { return build_ms_; }

 private:
  void sort_lights(const VplView& lights);
  void link_leaves(Topology topology);
  void merge(const Options& options);

  SubstituteTreeView view_;
  LargeArray<SubstituteNode> nodes_;
  LargeArray<Distribution> distributions_;
  LargeArray<std::uint32_t> leaves_;
  // Of the build only.
  LargeArray<KeyIndex> keys_, sort_scratch_;
  LargeArray<std::uint32_t> morton_, arrivals_;
  LargeArray<std::uint16_t> direction_;
  LargeArray<std::uint8_t> common_;
  LargeArray<NodeExtent> extents_;
  double build_ms_ = 0;
};

}  // namespace lumigrove
