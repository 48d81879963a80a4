#include "device/sort.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <random>

namespace lumigrove {
namespace {

LargeArray<KeyIndex> random_pairs(std::size_t count, std::uint32_t mask, unsigned seed) {
  std::mt19937 random(seed);
  LargeArray<KeyIndex> pairs(count);
  for (std::size_t i = 0; i < count; ++i) {
    pairs[i] = {static_cast<std::uint32_t>(random()) & mask, static_cast<std::uint32_t>(i)};
  }
  return pairs;
}

void expect_sorted_like_stable_sort(LargeArray<KeyIndex> pairs, int bits) {
  const std::uint32_t mask = bits == 32 ? ~0u : (1u << bits) - 1u;
  LargeArray<KeyIndex> expected = pairs, scratch;
  std::stable_sort(expected.begin(), expected.end(),
                   [&](KeyIndex a, KeyIndex b) { return (a.key & mask) < (b.key & mask); });
  radix_sort(pairs, bits, scratch);
  const bool same = std::equal(pairs.begin(), pairs.end(), expected.begin(), expected.end(),
                               [](KeyIndex a, KeyIndex b) { return a.key == b.key && a.index == b.index; });
  EXPECT_TRUE(same) << pairs.size() << " pairs, " << bits << " bits";
}

TEST(RadixSort, AgreesWithStableSortForAllSizes) {
  for (const std::size_t count : {0, 1, 2, 3, 31, 1000, 4095, 4096, 8192, 8193, 100003, 1000000}) {
    expect_sorted_like_stable_sort(random_pairs(count, 0x3fffffffu, 1), 30);
  }
}

TEST(RadixSort, LooksAtTheLowBitsOnly) {
  for (const int bits : {0, 1, 4, 5, 6, 13, 29, 30, 31, 32}) {
    expect_sorted_like_stable_sort(random_pairs(20001, ~0u, static_cast<unsigned>(bits)), bits);
  }
}

TEST(RadixSort, KeepsTheOrderOfEqualKeys) {
  expect_sorted_like_stable_sort(random_pairs(50000, 0u, 2), 30);
  expect_sorted_like_stable_sort(random_pairs(50000, 0x20000001u, 3), 30);
}

TEST(RadixSort, SortsAscendingAndDescendingInput) {
  LargeArray<KeyIndex> up, down;
  for (std::uint32_t i = 0; i < 30000; ++i) {
    up.push_back({i * 7, i});
    down.push_back({(30000 - i) * 7, i});
  }
  expect_sorted_like_stable_sort(up, 30);
  expect_sorted_like_stable_sort(down, 30);
}

TEST(RadixSort, ReusesScratchOfAnySize) {
  LargeArray<KeyIndex> scratch(7), large = random_pairs(9000, ~0u, 4), small = random_pairs(100, ~0u, 5);
  radix_sort(large, 32, scratch);
  radix_sort(small, 32, scratch);
  const auto less = [](KeyIndex a, KeyIndex b) { return a.key < b.key; };
  EXPECT_TRUE(std::is_sorted(large.begin(), large.end(), less));
  EXPECT_TRUE(std::is_sorted(small.begin(), small.end(), less));
}

TEST(RadixSort, HasTheSameResultForAnyThreadCount) {
  const LargeArray<KeyIndex> input = random_pairs(200000, 0xffu, 6);
  LargeArray<KeyIndex> first, scratch;
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    LargeArray<KeyIndex> pairs = input;
    radix_sort(pairs, 8, scratch);
    if (first.empty()) first = pairs;
    for (std::size_t i = 0; i < pairs.size(); ++i) ASSERT_EQ(pairs[i].index, first[i].index);
  }
}

}  // namespace
}  // namespace lumigrove
