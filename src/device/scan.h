// Prefix sums in a fixed order: blocks of fixed size, combined left to right, so that floating-point sums have the
// same bits for any thread count.
#pragma once

#include <algorithm>
#include <vector>

#include "device/device.h"

namespace lumigrove {

inline constexpr int kScanBlock = 4096;

// out[i] = value(0) + ... + value(i); returns the last of them, or T{} when count is 0. Asks for each value once.
// Sums of non-negative values never fall from one to the next, and a value of zero leaves the sum as it is.
template <class T, class Value>
T inclusive_scan(int count, const Value& value, T* out, int block = kScanBlock) {
  const int blocks = (count + block - 1) / block;
  std::vector<T> first(static_cast<std::size_t>(blocks));  // sum of all blocks before
  launch(
      blocks,
      [&](int b) {
        T sum{};
        for (int i = b * block; i < std::min(count, (b + 1) * block); ++i) out[i] = sum += value(i);
        first[static_cast<std::size_t>(b)] = sum;
      },
      1);
  T total{};
  for (T& sum : first) {
    const T before = total;
    total += sum;
    sum = before;
  }
  launch(
      blocks - 1,
      [&](int previous) {
        const int b = previous + 1;
        for (int i = b * block; i < std::min(count, (b + 1) * block); ++i)
          out[i] = first[static_cast<std::size_t>(b)] + out[i];
      },
      1);
  return total;
}

// out[i] = value(0) + ... + value(i-1), out[0] = T{}; returns the sum of all. `out` has count + 1 entries, the last of
// which is that sum.
template <class T, class Value>
T exclusive_scan(int count, const Value& value, T* out, int block = kScanBlock) {
  out[0] = T{};
  return inclusive_scan(count, value, out + 1, block);
}

}  // namespace lumigrove
