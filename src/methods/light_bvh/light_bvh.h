// Light BVHs: build and storage. light_bvh_kernel.h holds the method and its header block.
//
// `saoh` is built from the top: 12 bins on each axis, the split of least surface-area-orientation cost.
// `agglomerative` is built from the bottom: pairs of clusters each of which is the other's nearest under pair_cost are
// merged until one is left. The search for the nearest is exact (branch and bound over all clusters). As the cost of a
// pair never falls when either grows, these are the merges that picking the cheapest of all pairs, one after another,
// would make, except among pairs of the same cost.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/large_array.h"
#include "lights/light_set.h"
#include "methods/light_bvh/light_bvh_kernel.h"

namespace lumigrove {

class LightBvh {
 public:
  struct Options {
    Hierarchy builder = Hierarchy::kSaoh;  // kSaoh or kAgglomerative
    Weights weights = Weights::kMinMax;
    bool cones = true;  // not of kSaoh
    float floor = 0;    // as LightTree::Options
  };
  // Buffers are reused by the next build.
  void build(const LightView& lights, const Options& options);

  LightBvhView view() const;
  std::size_t bytes() const;  // nodes and tables; not the buffers of the build
  double build_ms() const { return build_ms_; }

 private:
  LightBvhView view_;
  LargeArray<LightBvhNode> nodes_;
  LargeArray<std::uint32_t> emitter_leaves_;
  double build_ms_ = 0;
};

}  // namespace lumigrove
