// Reductions in a fixed order: blocks of fixed size, combined left to right, so that floating-point sums have the
// same bits for any thread count.
#pragma once

#include <algorithm>
#include <vector>

#include "device/device.h"

namespace lumigrove {

// combine(... combine(identity, value(0)) ..., value(count-1)) in blocks of kBlock.
template <class T, class Value, class Combine>
T reduce(int count, T identity, const Value& value, const Combine& combine) {
  constexpr int kBlock = 4096;
  const int blocks = (count + kBlock - 1) / kBlock;
  std::vector<T> partial(static_cast<std::size_t>(blocks), identity);
  launch(blocks, [&](int b) {
    T sum = identity;
    for (int i = b * kBlock; i < std::min(count, (b + 1) * kBlock); ++i) sum = combine(sum, value(i));
    partial[static_cast<std::size_t>(b)] = sum;
  }, 1);
  T sum = identity;
  for (const T& p : partial) sum = combine(sum, p);
  return sum;
}

}  // namespace lumigrove
