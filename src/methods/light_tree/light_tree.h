// The perfect light tree: build and storage. light_tree_kernel.h holds the method and its header block.
#pragma once

#include <tbb/cache_aligned_allocator.h>

#include <cstdint>
#include <vector>

#include "device/sort.h"
#include "lights/light_set.h"
#include "methods/light_tree/light_tree_kernel.h"

namespace lumigrove {

class LightTree {
 public:
  // `width`: children a node, one of 2, 4, 8, 16 (Error otherwise). `keep_leaves`: also store where each
  // emitter's leaf is, which pdf_light_tree needs (4 bytes an emitter). Buffers are reused by the next build.
  void build(const LightView& lights, int width, bool keep_leaves);

  LightTreeView view() const;
  std::size_t bytes() const;  // nodes and tables; not the buffers of the build
  double build_ms() const { return build_ms_; }

 private:
  template <int W>
  void build_levels(const LightView& lights);

  LightTreeView view_;
  std::vector<float, tbb::cache_aligned_allocator<float>> nodes_;
  std::vector<std::uint32_t> leaf_emitters_, emitter_leaves_;
  std::vector<KeyIndex> keys_, scratch_;
  double build_ms_ = 0;
};

}  // namespace lumigrove
