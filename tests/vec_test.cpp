#include "base/vec.h"

#include <gtest/gtest.h>

namespace lumigrove {
namespace {

TEST(Frame, IsOrthonormalAndRightHandedInAllDirections) {
  for (int i = 0; i < 1000; ++i) {
    const float z = 1 - 2 * (static_cast<float>(i) + 0.5f) / 1000;
    const float r = std::sqrt(1 - z * z), phi = 2.399963f * static_cast<float>(i);
    const vec3 n(r * std::cos(phi), r * std::sin(phi), z);
    const Frame f = make_frame(n);
    EXPECT_NEAR(glm::dot(f.x, f.y), 0, 1e-5);
    EXPECT_NEAR(glm::dot(f.x, f.z), 0, 1e-5);
    EXPECT_NEAR(glm::length(f.x), 1, 1e-5);
    EXPECT_NEAR(glm::dot(glm::cross(f.x, f.y), f.z), 1, 1e-5);
  }
}

TEST(Box3, EmptyBoxIsTheIdentityOfUnite) {
  const Box3 empty, box{vec3(-1), vec3(2)};
  EXPECT_TRUE(empty.empty());
  EXPECT_EQ(unite(empty, box).lo, box.lo);
  EXPECT_EQ(unite(box, empty).hi, box.hi);
}

}  // namespace
}  // namespace lumigrove
