#include "base/direction_code.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "light_fixtures.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

constexpr std::uint32_t kCodes = 1u << kDirectionBits;

TEST(DirectionCode, OctantComesFirstThenCornersYZXAndTheMiddle) {
  EXPECT_EQ(direction_code(vec3(0, 1, 0)), 7u << 6);
  EXPECT_EQ(direction_code(vec3(0, 0, 1)), 7u << 6 | 1u << 4 | 1u << 2 | 1u);
  EXPECT_EQ(direction_code(vec3(1, 0, 0)), 7u << 6 | 2u << 4 | 2u << 2 | 2u);
  EXPECT_EQ(direction_code(vec3(1, 1, 1)), 7u << 6 | 3u << 4 | 3u << 2 | 3u);
  EXPECT_EQ(direction_code(vec3(-1, 1, 1)) >> 6, 3u);
  EXPECT_EQ(direction_code(vec3(1, -1, 1)) >> 6, 5u);
  EXPECT_EQ(direction_code(vec3(1, 1, -1)) >> 6, 6u);
}

TEST(DirectionCode, CentreOfEveryCellHasItsCode) {
  for (std::uint32_t code = 0; code < kCodes; ++code) EXPECT_EQ(direction_code(direction_of_code(code)), code);
}

TEST(DirectionCode, EveryCellIsUsedAndLiesNearItsCentre) {
  std::vector<int> used(kCodes, 0);
  Stream random(1);
  float least_cosine = 1;
  for (int i = 0; i < 400000; ++i) {
    const vec3 n = random.direction();
    const std::uint32_t code = direction_code(n);
    ASSERT_LT(code, kCodes);
    ++used[code];
    least_cosine = std::min(least_cosine, glm::dot(n, direction_of_code(code)));
  }
  // Cells of equal size would have 781 hits; these differ in size by a factor of about five.
  EXPECT_GT(*std::min_element(used.begin(), used.end()), 200);
  EXPECT_GT(glm::degrees(std::acos(least_cosine)), 5.0f);
  EXPECT_LT(glm::degrees(std::acos(least_cosine)), kDirectionCodeDegrees);
}

TEST(DirectionCode, LengthDoesNotMatterAndNoDirectionIsZero) {
  Stream random(2);
  for (int i = 0; i < 1000; ++i) {
    const vec3 n = random.direction();
    EXPECT_EQ(direction_code(n), direction_code(n * 1024.0f));
  }
  EXPECT_EQ(direction_code(vec3(0)), 0u);
  EXPECT_EQ(direction_code(vec3(std::numeric_limits<float>::quiet_NaN(), 1, 0)), 0u);
  EXPECT_EQ(direction_code(vec3(kInfinity, 1, 0)), 0u);
}

}  // namespace
}  // namespace lumigrove
