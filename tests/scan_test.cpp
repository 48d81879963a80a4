#include "device/scan.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstdint>
#include <random>

namespace lumigrove {
namespace {

TEST(Scan, AddsUpInOrder) {
  for (const int count : {0, 1, 2, 4095, 4096, 4097, 20000}) {
    const auto n = static_cast<std::size_t>(count);
    const auto value = [](int i) { return static_cast<std::uint32_t>(i % 7); };
    std::vector<std::uint32_t> inclusive(n), exclusive(n + 1, 99);
    const std::uint32_t total = inclusive_scan(count, value, inclusive.data());
    EXPECT_EQ(exclusive_scan(count, value, exclusive.data()), total);
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      ASSERT_EQ(exclusive[i], sum) << i;
      sum += value(static_cast<int>(i));
      ASSERT_EQ(inclusive[i], sum) << i;
    }
    EXPECT_EQ(exclusive[n], sum);
    EXPECT_EQ(total, sum);
  }
}

// What makes a binary search of the sums safe: they never fall, and rise only where there is something.
TEST(Scan, SumsOfNonNegativeNumbersNeverFall) {
  std::mt19937 random(1);
  std::vector<double> values(50000), sums(50000);
  for (double& v : values) v = random() % 3 == 0 ? 0.0 : std::ldexp(1.0, static_cast<int>(random() % 40));
  inclusive_scan(50000, [&](int i) { return values[static_cast<std::size_t>(i)]; }, sums.data());
  for (std::size_t i = 1; i < sums.size(); ++i) {
    ASSERT_GE(sums[i], sums[i - 1]);
    if (values[i] == 0) {
      ASSERT_EQ(sums[i], sums[i - 1]);
    }
  }
}

TEST(Scan, HasTheSameBitsForAnyThreadCount) {
  std::mt19937 random(2);
  std::vector<double> values(100000), first;
  for (double& v : values) v = static_cast<double>(random()) * 1e-3;
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    std::vector<double> sums(values.size());
    inclusive_scan(100000, [&](int i) { return values[static_cast<std::size_t>(i)]; }, sums.data());
    if (first.empty()) first = sums;
    EXPECT_EQ(sums, first);
  }
}

}  // namespace
}  // namespace lumigrove
