// The executor: runs a kernel struct once for every index. Work is split over oneTBB; what a kernel writes must
// depend on its index only, so that any thread count gives the same bits.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstddef>

namespace lumigrove {

// Indices of one task: a tile of an image is one, so that its steps stay on one thread and in that core's cache.
inline constexpr int kLaunchGrain = 4096;

// kernel(i) for i in [0, count).
template <class Kernel>
void launch(int count, const Kernel& kernel, int grain = kLaunchGrain) {
  if (count <= grain) {
    for (int i = 0; i < count; ++i) kernel(i);
    return;
  }
  tbb::parallel_for(tbb::blocked_range<int>(0, count, static_cast<std::size_t>(grain)),
                    [&](const tbb::blocked_range<int>& range) {
                      for (int i = range.begin(); i != range.end(); ++i) kernel(i);
                    });
}

}  // namespace lumigrove
