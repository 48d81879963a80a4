// Stream compaction: the indices that pass a test, in ascending order whatever the number of threads.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "device/scan.h"

namespace lumigrove {

// kept = all i in [0, count) with keep(i), ascending; `keep` must be a pure function (it is asked twice).
template <class Keep>
void compact(int count, const Keep& keep, std::vector<std::uint32_t>& kept) {
  constexpr int kBlock = 1024, kGrain = 4;
  const int blocks = (count + kBlock - 1) / kBlock;
  std::vector<std::uint32_t> first(static_cast<std::size_t>(blocks) + 1);
  const auto kept_in_block = [&](int b) {
    std::uint32_t n = 0;
    for (int i = b * kBlock; i < std::min(count, (b + 1) * kBlock); ++i) n += keep(i) ? 1 : 0;
    return n;
  };
  kept.resize(exclusive_scan(blocks, kept_in_block, first.data(), kGrain));
  launch(
      blocks,
      [&](int b) {
        std::uint32_t at = first[static_cast<std::size_t>(b)];
        for (int i = b * kBlock; i < std::min(count, (b + 1) * kBlock); ++i)
          if (keep(i)) kept[at++] = static_cast<std::uint32_t>(i);
      },
      kGrain);
}

}  // namespace lumigrove
