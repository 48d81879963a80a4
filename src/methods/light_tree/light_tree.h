// The perfect light tree: build and storage. light_tree_kernel.h holds the method and its header block.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/large_array.h"
#include "device/sort.h"
#include "lights/light_set.h"
#include "methods/light_tree/light_tree_kernel.h"

namespace lumigrove {

class LightTree {
 public:
  struct Options {
    int width = 16;            // children a node: 2, 4, 8 or 16 (Error otherwise)
    bool cones = true;         // weights bound the emitters' own cosine
    bool keep_leaves = false;  // also store each emitter's leaf, which pdf_light_tree needs: 4 bytes an emitter
  };
  // Buffers are reused by the next build.
  void build(const LightView& lights, const Options& options);

  LightTreeView view() const;
  std::size_t bytes() const;  // nodes and tables; not the buffers of the build
  double build_ms() const { return build_ms_; }

 private:
  template <int W>
  void build_levels(const LightView& lights);
  template <int W>
  int find_first_cones() const;

  LightTreeView view_;
  LargeArray<std::byte> nodes_;
  LargeArray<std::uint32_t> leaf_emitters_, emitter_leaves_;
  LargeArray<KeyIndex> keys_, scratch_;
  double build_ms_ = 0;
};

}  // namespace lumigrove
