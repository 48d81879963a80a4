// The table of all measurements.
#include "bench.h"

namespace lumigrove::bench {

const std::vector<Benchmark>& benchmarks() {
  static const std::vector<Benchmark> table = {
      {"sort.radix.1m", "ratio", "radix sort / tbb::parallel_sort of 1,000,000 (30-bit key, index) pairs",
       0.5, sort_radix_1m},
  };
  return table;
}

}  // namespace lumigrove::bench
