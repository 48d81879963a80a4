#include "base/sampling.h"

#include <gtest/gtest.h>

#include <functional>

#include "base/rng.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using testing::chi_square_p_value;
using testing::mean_within;
using testing::RunningMean;

constexpr int kSamples = 40000;
constexpr double kSignificance = 1e-3;

vec4 random_of(int i) { return Rng{7, 0, static_cast<std::uint32_t>(i)}.uniform4(0); }

// p-value of directions against a density, on a grid of equal solid angles; the density is integrated over
// each cell.
double direction_p_value(const std::function<vec3(vec2)>& sample, const std::function<double(vec3)>& pdf) {
  constexpr int kRows = 16, kColumns = 16, kSub = 64;
  std::vector<double> observed(kRows * kColumns), expected(kRows * kColumns);
  for (int i = 0; i < kSamples; ++i) {
    const vec4 u = random_of(i);
    const vec3 w = sample(vec2(u.x, u.y));
    const double phi = std::atan2(w.y, w.x) / (2 * M_PI) + 0.5;
    const int row = std::min(kRows - 1, static_cast<int>((0.5 * w.z + 0.5) * kRows));
    observed[row * kColumns + std::min(kColumns - 1, static_cast<int>(phi * kColumns))] += 1;
  }
  for (int row = 0; row < kRows; ++row) {
    double sum = 0;
    for (int k = 0; k < kSub; ++k) {
      const double z = 2 * (row + (k + 0.5) / kSub) / kRows - 1;
      sum += pdf(vec3(std::sqrt(1 - z * z), 0, z)) / kSub;
    }
    for (int c = 0; c < kColumns; ++c)
      expected[row * kColumns + c] = kSamples * sum * 4 * M_PI / (kRows * kColumns);
  }
  return chi_square_p_value(observed, expected);
}

TEST(Statistics, ChiSquareTailHasTableValues) {
  EXPECT_NEAR(testing::chi_square_tail(3.841459, 1), 0.05, 1e-6);
  EXPECT_NEAR(testing::chi_square_tail(18.307038, 10), 0.05, 1e-6);
  EXPECT_NEAR(testing::chi_square_tail(149.449253, 100), 0.001, 1e-7);
  EXPECT_NEAR(testing::chi_square_tail(2, 2), std::exp(-1.0), 1e-12);
  EXPECT_NEAR(testing::chi_square_tail(70.064895, 100), 0.99, 1e-6);
}

TEST(Statistics, ChiSquareTellsWrongFrequenciesFromRightOnes) {
  const std::vector<double> expected{250, 250, 250, 250};
  EXPECT_GT(chi_square_p_value(std::vector<double>{262, 241, 255, 242}, expected), 0.1);
  EXPECT_LT(chi_square_p_value(std::vector<double>{320, 210, 240, 230}, expected), 1e-4);
  EXPECT_EQ(chi_square_p_value(std::vector<double>{999, 1}, std::vector<double>{1000, 0}), 0);
}

TEST(Sampling, CosineHemisphereFollowsItsPdf) {
  EXPECT_GT(direction_p_value([](vec2 u) { return sample_cosine_hemisphere(u); },
                              [](vec3 w) { return pdf_cosine_hemisphere(w.z); }),
            kSignificance);
}

TEST(Sampling, UniformSphereFollowsItsPdf) {
  EXPECT_GT(direction_p_value([](vec2 u) { return sample_uniform_sphere(u); },
                              [](vec3) { return pdf_uniform_sphere(); }),
            kSignificance);
}

TEST(Sampling, UniformConeFollowsItsPdf) {
  for (const float cos_max : {0.5f, -0.25f}) {  // at cell borders, so that the integral over cells is exact
    EXPECT_GT(direction_p_value([&](vec2 u) { return sample_uniform_cone(u, cos_max); },
                                [&](vec3 w) { return w.z > cos_max ? pdf_uniform_cone(cos_max) : 0; }),
              kSignificance);
  }
}

TEST(Sampling, ThinConeKeepsItsPrecision) {
  const float half_angle = 2e-3f, cos_max = std::cos(half_angle);
  const double max_sine = std::sqrt(1 - static_cast<double>(cos_max) * cos_max);
  RunningMean squared_sine;  // uniform in [0, max_sine^2] up to the fourth power of the angle
  for (int i = 0; i < kSamples; ++i) {
    const vec4 u = random_of(i);
    const vec3 w = sample_uniform_cone(vec2(u.x, u.y), cos_max);
    const double sine = std::hypot(w.x, w.y);
    EXPECT_LE(sine, max_sine * 1.001);
    squared_sine.add(sine * sine);
  }
  EXPECT_TRUE(mean_within(squared_sine, 0.5 * max_sine * max_sine, 4, 1e-12));
}

TEST(Sampling, DirectionsAreUnit) {
  for (int i = 0; i < 1000; ++i) {
    const vec4 u = random_of(i);
    for (const vec2 v : {vec2(u.x, u.y), vec2(0, u.y), vec2(1 - 0x1p-24f, u.y)}) {
      EXPECT_NEAR(glm::length(sample_cosine_hemisphere(v)), 1, 1e-6);
      EXPECT_NEAR(glm::length(sample_uniform_sphere(v)), 1, 1e-6);
      EXPECT_NEAR(glm::length(sample_uniform_cone(v, 0.9f)), 1, 1e-6);
    }
  }
}

TEST(Sampling, DiscIsUniformByArea) {
  constexpr int kGrid = 16;  // polar cells of equal area
  std::vector<double> observed(kGrid * kGrid), expected(kGrid * kGrid, kSamples / double(kGrid * kGrid));
  for (int i = 0; i < kSamples; ++i) {
    const vec4 u = random_of(i);
    const vec2 d = sample_disc(vec2(u.x, u.y));
    const double r2 = glm::dot(d, d), phi = std::atan2(d.y, d.x) / (2 * M_PI) + 0.5;
    ASSERT_LE(r2, 1.000001);
    observed[std::min(kGrid - 1, int(r2 * kGrid)) * kGrid + std::min(kGrid - 1, int(phi * kGrid))] += 1;
  }
  EXPECT_GT(chi_square_p_value(observed, expected), kSignificance);
  EXPECT_FLOAT_EQ(pdf_disc(), 1 / kPi);
}

TEST(Sampling, TriangleIsUniformByArea) {
  constexpr int kGrid = 20;  // squares of the unit triangle; diagonal cells count half
  std::vector<double> observed(kGrid * kGrid), expected(kGrid * kGrid);
  for (int i = 0; i < kSamples; ++i) {
    const vec4 u = random_of(i);
    const vec2 b = sample_uniform_triangle(vec2(u.x, u.y));
    ASSERT_GE(b.x, 0);
    ASSERT_GE(b.y, 0);
    ASSERT_LE(b.x + b.y, 1.000001f);
    const int x = std::min(kGrid - 1, int(b.x * kGrid)), y = std::min(kGrid - 1 - x, int(b.y * kGrid));
    observed[y * kGrid + x] += 1;
  }
  const float density = pdf_uniform_triangle(0.5f);
  for (int y = 0; y < kGrid; ++y)
    for (int x = 0; x + y < kGrid; ++x)
      expected[y * kGrid + x] = kSamples * density / double(kGrid * kGrid) * (x + y == kGrid - 1 ? 0.5 : 1);
  EXPECT_GT(chi_square_p_value(observed, expected), kSignificance);
}

}  // namespace
}  // namespace lumigrove
