#include <tbb/parallel_sort.h>

#include "base/rng.h"
#include "bench.h"
#include "device/sort.h"

namespace lumigrove::bench {

Result sort_radix_1m(const Options& options) {
  constexpr std::uint32_t kCount = 1000000;
  LargeArray<KeyIndex> input(kCount), pairs, scratch;
  for (std::uint32_t i = 0; i < kCount; ++i) input[i] = {pcg4d(uvec4(i, 0, 0, 0)).x & 0x3fffffffu, i};
  const auto less = [](KeyIndex a, KeyIndex b) { return a.key < b.key; };
  const PairTimes times = time_in_turns(
      options.runs, [&] { radix_sort(pairs, 30, scratch); },
      [&] { tbb::parallel_sort(pairs.begin(), pairs.end(), less); }, [&] { pairs = input; });
  return {times.ratio,
          {{"radix_ms", times.a_ms},
           {"parallel_sort_ms", times.b_ms},
           {"lowest_ratio", times.lowest_ratio},
           {"highest_ratio", times.highest_ratio}}};
}

}  // namespace lumigrove::bench
