// Parallel radix sort of (key, index) pairs by key: the first step of every Morton-ordered tree.
#pragma once

#include <cstdint>
#include <span>

#include "base/large_array.h"

namespace lumigrove {

struct KeyIndex {
  std::uint32_t key, index;
};

// Stable, ascending, by the low `bits` of key. `scratch` is resized as needed and may be reused between calls.
// The result does not depend on the number of threads.
void radix_sort(std::span<KeyIndex> pairs, int bits, LargeArray<KeyIndex>& scratch);

}  // namespace lumigrove
