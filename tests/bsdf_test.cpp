#include "scene/bsdf.h"

#include <gtest/gtest.h>

#include "base/rng.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using testing::chi_square_p_value;
using testing::mean_within;
using testing::RunningMean;

vec4 random(int i, std::uint32_t dimension = 0) {
  return Rng{11, 0, static_cast<std::uint32_t>(i)}.uniform4(dimension);
}

vec3 direction(float theta, float phi) {
  return vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
}

// A surface with a tilted frame, seen `theta` from its shading normal. `tilt` turns the geometric normal
// away.
Surface make_surface(vec3 diffuse, vec3 specular, float roughness, float theta, float tilt = 0) {
  const Frame frame = make_frame(glm::normalize(vec3(0.3f, -0.5f, 0.8f)));
  Surface s;
  s.normal = frame.z;
  s.geometric_normal = frame.to_world(direction(tilt, 2));
  s.wo = frame.to_world(direction(theta, 0.7f));
  s.diffuse = diffuse;
  s.specular = specular;
  s.roughness = roughness;
  return s;
}

struct Case {
  const char* name;
  Surface surface;
};
std::vector<Case> cases() {
  const vec3 red(0.7f, 0.2f, 0.1f), dielectric(0.04f), gold(1, 0.78f, 0.34f), none(0);
  return {{"diffuse", make_surface(red, none, 1, 0.6f)},
          {"plastic", make_surface(red, dielectric, 0.4f, 0.9f)},
          {"grazing plastic", make_surface(red, dielectric, 0.3f, 1.5f)},
          {"rough metal", make_surface(none, gold, 0.9f, 0.4f)},
          {"grazing metal", make_surface(none, gold, 0.5f, 1.45f)},
          {"tilted", make_surface(red, gold, 0.6f, 0.8f, 0.5f)},
          {"viewed from below its normal", make_surface(red, gold, 0.6f, 1.7f, 0.5f)}};
}

// Directions on a sphere grid in the frame of the surface; cells of equal solid angle.
constexpr int kCellRows = 32, kCellColumns = 32;
int cell_of(const Frame& frame, vec3 w) {
  const vec3 local = frame.to_local(w);
  const int row = std::clamp(int((0.5f * local.z + 0.5f) * kCellRows), 0, kCellRows - 1);
  const int column =
      std::clamp(int((std::atan2(local.y, local.x) / (2 * kPi) + 0.5f) * kCellColumns), 0, kCellColumns - 1);
  return row * kCellColumns + column;
}
template <class F>
double integrate_cell(const Frame& frame, int cell, int sub, const F& f) {
  const int row = cell / kCellColumns, column = cell % kCellColumns;
  double sum = 0;
  for (int i = 0; i < sub * sub; ++i) {
    const float z = 2 * (float(row) + (float(i / sub) + 0.5f) / float(sub)) / kCellRows - 1;
    const float phi = 2 * kPi * ((float(column) + (float(i % sub) + 0.5f) / float(sub)) / kCellColumns - 0.5f);
    const float r = safe_sqrt(1 - z * z);
    sum += f(frame.to_world(vec3(r * std::cos(phi), r * std::sin(phi), z)));
  }
  return sum / (sub * sub) * 4 * M_PI / (kCellRows * kCellColumns);
}

TEST(Bsdf, SamplesFollowTheirPdf) {
  constexpr int kSamples = 60000;
  for (const Case& c : cases()) {
    const Frame frame = make_frame(c.surface.normal);
    std::vector<double> observed(kCellRows * kCellColumns + 1), expected(kCellRows * kCellColumns + 1);
    for (int i = 0; i < kSamples; ++i) {
      const BsdfSample s = bsdf_sample(c.surface, vec3(random(i)));
      observed[s.pdf > 0 ? cell_of(frame, s.wi) : kCellRows * kCellColumns] += 1;
    }
    double above = 0;
    for (int cell = 0; cell < kCellRows * kCellColumns; ++cell) {
      expected[cell] =
          kSamples * integrate_cell(frame, cell, 12, [&](vec3 w) { return bsdf_pdf(c.surface, w); });
      above += expected[cell];
    }
    EXPECT_LE(above, kSamples * 1.002) << c.name;
    expected.back() = kSamples - above;  // drawn below a plane
    if (expected.back() < 0.002 * kSamples)
      expected.back() = observed.back();  // less than the quadrature's error
    EXPECT_GT(chi_square_p_value(observed, expected), 1e-3) << c.name;
  }
}

TEST(Bsdf, PdfOfADiffuseSurfaceIntegratesToOne) {
  const Surface s = make_surface(vec3(0.5f), vec3(0), 1, 0.3f);
  const Frame frame = make_frame(s.normal);
  double sum = 0;
  for (int cell = 0; cell < kCellRows * kCellColumns; ++cell)
    sum += integrate_cell(frame, cell, 8, [&](vec3 w) { return bsdf_pdf(s, w); });
  EXPECT_NEAR(sum, 1, 1e-4);
}

// The narrowest lobe is thinner than the sphere's cells: compare the mean of 1/pdf-weighted samples in the
// lobe.
TEST(Bsdf, NarrowestLobeIsSampledByItsPdf) {
  const Surface s = make_surface(vec3(0), vec3(0.9f), 0.08f, 0.7f);
  const vec3 mirror = 2 * glm::dot(s.normal, s.wo) * s.normal - s.wo;
  const float cos_max = std::cos(0.02f);
  RunningMean solid_angle;
  for (int i = 0; i < 100000; ++i) {
    const BsdfSample sample = bsdf_sample(s, vec3(random(i)));
    const bool inside =
        sample.pdf > 0 && glm::dot(sample.wi, mirror) > cos_max;  // the tail may dip below the plane
    solid_angle.add(inside ? 1 / double(sample.pdf) : 0);
  }
  EXPECT_TRUE(mean_within(solid_angle, 2 * M_PI * (1 - double(cos_max)), 4));
}

TEST(Bsdf, WeightIsEvalTimesCosineOverPdf) {
  for (const Case& c : cases()) {
    for (int i = 0; i < 2000; ++i) {
      const BsdfSample s = bsdf_sample(c.surface, vec3(random(i)));
      if (s.pdf == 0) {
        EXPECT_EQ(s.weight, vec3(0));
        continue;
      }
      EXPECT_NEAR(glm::length(s.wi), 1, 1e-5) << c.name;
      EXPECT_EQ(s.pdf, bsdf_pdf(c.surface, s.wi)) << c.name;
      const vec3 expected = bsdf_eval(c.surface, s.wi) * glm::dot(c.surface.normal, s.wi) / s.pdf;
      EXPECT_LT(glm::length(s.weight - expected), 1e-5f * (1 + glm::length(expected))) << c.name;
      EXPECT_LT(max_component(s.weight), 12) << c.name;  // visible normals and both lobes keep it bounded
    }
  }
}

TEST(Bsdf, WhereLightIsReflectedThereIsDensity) {
  for (const Case& c : cases()) {
    for (int i = 0; i < 5000; ++i) {
      const vec4 u = random(i);
      const vec3 wi = sample_uniform_sphere(vec2(u.x, u.y));
      const vec3 f = bsdf_eval(c.surface, wi);
      EXPECT_GE(glm::min(f.x, glm::min(f.y, f.z)), 0);
      EXPECT_EQ(max_component(f) > 0, bsdf_pdf(c.surface, wi) > 0) << c.name;
    }
  }
}

TEST(Bsdf, NoLightPassesThroughEitherPlane) {
  const Surface s = make_surface(vec3(0.5f), vec3(0.5f), 0.5f, 0.5f, 0.9f);
  for (int i = 0; i < 5000; ++i) {
    const vec4 u = random(i);
    const vec3 wi = sample_uniform_sphere(vec2(u.x, u.y));
    if (glm::dot(wi, s.normal) > 0 && glm::dot(wi, s.geometric_normal) > 0) continue;
    EXPECT_EQ(bsdf_eval(s, wi), vec3(0));
    EXPECT_EQ(bsdf_pdf(s, wi), 0);
  }
}

TEST(Bsdf, IsReciprocal) {
  for (const float roughness : {0.08f, 0.3f, 1.0f}) {
    const Surface s = make_surface(vec3(0.3f, 0.5f, 0.7f), vec3(0.04f, 0.5f, 0.9f), roughness, 0.8f);
    for (int i = 0; i < 1000; ++i) {
      const vec4 u = random(i);
      const vec3 wi = make_frame(s.normal).to_world(sample_cosine_hemisphere(vec2(u.x, u.y)));
      Surface swapped = s;
      swapped.wo = wi;
      const vec3 a = bsdf_eval(s, wi), b = bsdf_eval(swapped, s.wo);
      EXPECT_LT(glm::length(a - b), 1e-4f * glm::length(a) + 1e-7f);
    }
  }
}

TEST(Bsdf, MatchesTheWrittenFormula) {
  const Surface s = make_surface(vec3(0.6f), vec3(0.2f), 0.5f, 0.5f);
  const vec3 wi = make_frame(s.normal).to_world(direction(0.9f, 2.5f));
  const double a2 = 0.0625, k = 0.5 * a2;  // alpha = 0.25
  const vec3 h = glm::normalize(wi + s.wo);
  const double nl = glm::dot(s.normal, wi), nv = glm::dot(s.normal, s.wo), nh = glm::dot(s.normal, h);
  const double d = a2 / (M_PI * std::pow(nh * nh * (a2 - 1) + 1, 2));
  const double g = nl / (nl * (1 - k) + k) * nv / (nv * (1 - k) + k);
  const double f = 0.2 + 0.8 * std::pow(1 - double(glm::dot(wi, h)), 5);
  EXPECT_NEAR(bsdf_eval(s, wi).x, 0.6 / M_PI + d * g * f / (4 * nl * nv), 1e-5);
}

double albedo(const Surface& s) {  // of the green channel, by sampling
  RunningMean mean;
  for (int i = 0; i < 20000; ++i) mean.add(bsdf_sample(s, vec3(random(i))).weight.y);
  return mean.mean();
}

TEST(Bsdf, DiffuseAlbedoIsExact) {
  for (int i = 0; i < 1000; ++i) {
    const BsdfSample s = bsdf_sample(make_surface(vec3(0.25f, 0.5f, 1), vec3(0), 1, 1.2f), vec3(random(i)));
    ASSERT_GT(s.pdf, 0);
    EXPECT_LT(glm::length(s.weight - vec3(0.25f, 0.5f, 1)), 1e-5f);
  }
}

// What leaves a white gloss lobe, lit from everywhere: at most all of it towards viewers up to 1.3 rad off
// the normal; at 1.5 rad the sheet's G, weaker than Smith's, lets one of middling roughness gain by half.
TEST(Bsdf, GlossEnergyStaysWithinItsStatedBounds) {
  for (const float roughness : {0.08f, 0.3f, 0.5f, 0.7f, 1.0f}) {
    for (const float theta : {0.0f, 0.5f, 1.0f, 1.3f, 1.5f}) {
      const double energy = albedo(make_surface(vec3(0), vec3(1), roughness, theta));
      EXPECT_GT(energy, 0.2) << roughness << " " << theta;
      EXPECT_LT(energy, theta <= 1.3f ? 1.001 : 1.6) << roughness << " " << theta;
    }
  }
}

TEST(Bsdf, GlossOfRoughDielectricAddsLittle) {
  for (const float theta : {0.0f, 0.8f, 1.2f})
    EXPECT_LT(albedo(make_surface(vec3(0.8f), vec3(0.04f), 0.5f, theta)), 1.0) << theta;
}

TEST(Bsdf, BlackAndBackfacingSurfacesReflectNothing) {
  const Surface black = make_surface(vec3(0), vec3(0), 0.5f, 0.5f);
  Surface metal = make_surface(vec3(0), vec3(1), 0.5f, 1.8f);
  for (int i = 0; i < 1000; ++i) {
    for (const Surface& s : {black, metal}) {
      const BsdfSample sample = bsdf_sample(s, vec3(random(i)));
      EXPECT_EQ(sample.weight, vec3(0));
      EXPECT_FALSE(sample.pdf < 0);
    }
  }
}

}  // namespace
}  // namespace lumigrove
