// The perfect light tree: build and storage. light_tree_kernel.h holds the method and its header block.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/large_array.h"
#include "device/sort.h"
#include "lights/light_set.h"
#include "methods/light_tree/light_tree_kernel.h"

namespace lumigrove {

struct BoxLeaves;  // light_tree_build_kernel.h

class LightTree {
 public:
  struct Options {
    int width = 16;            // children a node: 2, 4, 8 or 16 (Error otherwise)
    bool cones = true;         // weights bound the emitters' own cosine
    bool keep_leaves = false;  // also store each emitter's leaf, which pdf_light_tree needs: 4 bytes an emitter
    Weights weights = Weights::kMinMax;  // or kYuksel
    float floor = 0;           // metres, least distance in the weights; above 0 also to boxes that hold the point
  };
  // Buffers are reused by the next build.
  void build(const LightView& lights, const Options& options);
  // The same over boxes, which then are the tree's emitters. `bounds` holds all boxes, `diagonal` is the size of
  // what they are in, metres.
  void build(const BoxLeaves& leaves, const Box3& bounds, float diagonal, const Options& options);
  void free_buffers();  // of the build; for trees that last

  LightTreeView view() const;
  std::size_t bytes() const;  // nodes and tables; not the buffers of the build
  double build_ms() const { return build_ms_; }

 private:
  template <class Leaves>
  void build_over(const Leaves& leaves, std::size_t count, const Box3& bounds, float diagonal, const Options& options);
  template <int W, class Leaves>
  void build_levels(const Leaves& leaves);
  template <int W>
  int find_first_cones() const;

  LightTreeView view_;
  LargeArray<std::byte> nodes_;
  LargeArray<std::uint32_t> leaf_emitters_, emitter_leaves_;
  LargeArray<KeyIndex> keys_, scratch_;
  double build_ms_ = 0;
};

}  // namespace lumigrove
