#include "methods/reference/path.h"

#include <gtest/gtest.h>

#include <memory>

#include "device/compact.h"
#include "frame/explain.h"
#include "frame/frame.h"
#include "light_scenes.h"
#include "lumigrove/renderer.h"

namespace lumigrove {
namespace {

using testing::image_mean;
using testing::ImageMean;
using testing::mean_within;
using testing::pixel;
using testing::point_on_floor;
using testing::RunningMean;
using testing::SceneBuilder;
using testing::square_view;

// --- one batch of paths, below the public API
// -------------------------------------------------------------------

enum class Strategy { kLightSampling, kBsdfSampling, kBoth };

struct Light {
  std::vector<vec3> direct, indirect;
};

// Light at the first hits of a small image, one camera sample at a time.
class PathBatch {
 public:
  PathBatch(Scene scene, const Settings& settings)
      : scene_(std::move(scene)),
        settings_(settings),
        world_(make_world(scene_, settings_with_mis(settings), stats_)) {}

  Light sample(Strategy strategy, int sample_number) {
    DirectLighting lighting = make_direct_lighting(*world_, settings_, sample_number);
    lighting.mis = strategy == Strategy::kBoth;
    const auto [surfaces, pixels] = see_surfaces(*world_, settings_, {0, 0, settings_.width, settings_.height}, false);
    const std::vector<vec3> black(surfaces.size(), vec3(0));
    Light light{black, black};
    PathTracing tracing;
    tracing.lighting = lighting;
    tracing.first_spp = lighting.spp;
    tracing.max_bounces = settings_.indirect.max_bounces;
    tracing.roulette_start = settings_.indirect.roulette_start;
    tracing.force_diffuse = settings_.force_diffuse;
    tracing.bsdf_only = strategy == Strategy::kBsdfSampling;
    if (!tracing.bsdf_only)
      add_direct_light(lighting, surfaces, pixels, kDimLight, direct_buffers_, light.direct);
    add_path_light(tracing, surfaces, pixels, buffers_, light.direct, light.indirect);
    return light;
  }

  const PathBuffers& buffers() const { return buffers_; }

 private:
  static Settings settings_with_mis(Settings settings) {  // pdf_light needs tables of its own
    settings.direct.mis = true;
    return settings;
  }

  const Scene scene_;
  Settings settings_;
  RenderStats stats_;
  std::unique_ptr<World> world_;
  DirectBuffers direct_buffers_;
  PathBuffers buffers_;
};

// --- device/compact.h
// --------------------------------------------------------------------------------------------

TEST(Compact, KeepsWhatPassesInOrder) {
  for (const int count : {0, 1, 1023, 1024, 1025, 10000}) {
    std::vector<std::uint32_t> kept{7, 7, 7}, expected;
    const auto keep = [](int i) { return i % 3 == 1 || i % 7 == 0; };
    for (int i = 0; i < count; ++i)
      if (keep(i)) expected.push_back(static_cast<std::uint32_t>(i));
    compact(count, keep, kept);
    EXPECT_EQ(kept, expected) << count;
  }
}

// --- furnaces
// ------------------------------------------------------------------------------------------------------

// A closed room whose walls emit 1 and reflect rho everywhere shows 1 + rho + rho^2 + ... on every ray.
Scene furnace(float rho) {
  SceneBuilder b;
  b.room(vec3(-1, -1, -1), vec3(1, 1.5f, 2), b.material(vec3(rho), vec3(1)));
  return b.scene;
}

Settings furnace_view(int size) {
  return square_view("path", size, vec3(0.1f, 0.2f, 0.3f), vec3(0.5f, 0, -1));
}

double geometric_sum(double rho, int first, int last) {
  double sum = 0;
  for (int k = first; k <= last; ++k) sum += std::pow(rho, k);
  return sum;
}

TEST(PathTracer, FurnaceIsAGeometricSumUpToTheBounceLimit) {
  for (const int bounces : {0, 1, 4}) {
    Settings settings = furnace_view(8);
    settings.spp = 64;
    settings.indirect.max_bounces = bounces;
    settings.indirect.roulette_start = 100;
    const Image image = render(furnace(0.5f), settings);
    const double error = image_mean(image, "").standard_error;
    EXPECT_NEAR(image_mean(image, "emission").mean, 1, 1e-5);
    EXPECT_TRUE(mean_within(image_mean(image, "direct").mean, error, 0.5)) << bounces;
    EXPECT_TRUE(mean_within(image_mean(image, "indirect").mean, error, geometric_sum(0.5, 2, bounces + 1)))
        << bounces;
    EXPECT_LT(error, 0.02);
  }
}

TEST(PathTracer, FurnaceByBsdfSamplingAloneHasNoNoise) {
  Settings settings = furnace_view(6);
  settings.indirect.max_bounces = 5;
  settings.indirect.roulette_start = 100;
  PathBatch batch(furnace(0.5f), settings);
  const Light light = batch.sample(Strategy::kBsdfSampling, 0);
  for (std::size_t i = 0; i < light.direct.size(); ++i) {
    EXPECT_NEAR(light.direct[i].x, 0.5, 1e-5);
    EXPECT_NEAR(light.indirect[i].x, geometric_sum(0.5, 2, 6), 1e-5);
  }
}

TEST(PathTracer, RouletteKeepsTheMean) {
  Settings settings = furnace_view(8);
  settings.spp = 150;
  settings.indirect.max_bounces = 40;
  settings.indirect.roulette_start = 1;
  const Image image = render(furnace(0.6f), settings);
  const ImageMean total = image_mean(image, "");
  EXPECT_TRUE(mean_within(total.mean, total.standard_error, 1 / (1 - 0.6)));
  EXPECT_LT(total.standard_error, 0.05);
}

TEST(PathTracer, RouletteMakesRaysFollowLivePaths) {
  Settings settings = furnace_view(16);
  settings.indirect.max_bounces = 30;
  settings.indirect.roulette_start = 1;
  PathBatch batch(furnace(0.5f), settings);
  batch.sample(Strategy::kBsdfSampling, 0);
  EXPECT_LT(batch.buffers().path_rays, 16u * 16u * 2);  // sum of 0.5^k, not 31 rays a pixel
  EXPECT_GT(batch.buffers().path_rays, 16u * 16u / 2);
}

TEST(PathTracer, ConstantEnvironmentLightsAPlaneExactly) {
  SceneBuilder b;
  b.quad(vec3(-5, 0, -5), vec3(0, 0, 10), vec3(10, 0, 0), b.material(vec3(0.25f, 0.5f, 0.75f)));
  b.scene.environment.radiance = vec3(2);
  for (const char* preset : {"path", "tree"}) {
    Settings settings = square_view(preset, 8, vec3(0, 1, 0), vec3(0, 0, -0.1f), 40);
    settings.spp = 2;
    const Image image = render(b.scene, settings);
    for (int i = 0; i < 64; ++i) {
      const vec3 direct = pixel(image, "direct", i);
      EXPECT_LT(glm::length(direct - vec3(0.5f, 1, 1.5f)), 1e-4f) << preset;
      EXPECT_EQ(pixel(image, "indirect", i), vec3(0));
    }
  }
}

TEST(PathTracer, ConvexShapeInAConstantEnvironmentReflectsItsAlbedo) {
  SceneBuilder b;
  b.room(vec3(1, 1, 1), vec3(-1, -1, -1), b.material(vec3(0.5f)));  // corners swapped: fronts outside
  b.scene.environment.radiance = vec3(3);
  Settings settings = square_view("path", 8, vec3(2, 3, 4), vec3(0, 0, 0), 70);
  settings.spp = 4;
  const Image image = render(b.scene, settings);
  for (int i = 0; i < 64; ++i) {
    const bool hit = pixel(image, "albedo", i).x > 0;
    EXPECT_NEAR(pixel(image, "", i).x, hit ? 1.5f : 3.0f, 1e-4f);
  }
}

// --- closed forms
// --------------------------------------------------------------------------------------------------

constexpr float kFloorAlbedo = 0.6f;

void add_floor(SceneBuilder& b) {
  b.quad(vec3(-20, 0, -20), vec3(0, 0, 40), vec3(40, 0, 0), b.material(vec3(kFloorAlbedo)));
}
Settings floor_view(const std::string& preset) {
  return square_view(preset, 12, vec3(0.3f, 3, 4), vec3(0, 0, 0), 50);
}

TEST(PathTracer, EmissiveTriangleOverAPlaneFollowsLambertsFormula) {
  const std::array<vec3, 3> light{vec3(-0.8f, 1.2f, -0.5f), vec3(1, 1.5f, -0.7f), vec3(0.1f, 1.1f, 1)};
  SceneBuilder b;
  add_floor(b);
  b.triangle(light[0], light[1], light[2], b.material(vec3(0), vec3(5)));  // front below
  for (const char* preset : {"path", "tree", "power", "uniform"}) {
    Settings settings = floor_view(preset);
    settings.spp = 200;
    const Image image = render(b.scene, settings);
    double chi = 0;
    for (int i = 0; i < 144; ++i) {
      const int x = i % 12, y = i / 12;
      if (pixel(image, "albedo", i).x < 0.5f * kFloorAlbedo) continue;  // the light's black back
      const double expected =
          5 * kFloorAlbedo / M_PI * testing::polygon_irradiance(point_on_floor(settings, x, y), vec3(0, 1, 0), light);
      const double error = std::sqrt(pixel(image, "variance", i).y);
      const double direct = pixel(image, "direct", i).y;
      EXPECT_TRUE(mean_within(direct, error, expected, 4.5, 1e-5)) << preset << " " << x << "," << y;
      chi += (direct - expected) * (direct - expected) / (error * error) / 144;
    }
    EXPECT_GT(chi, 0.5) << preset;  // the standard error is not an idle upper bound
    EXPECT_LT(chi, 1.6) << preset;
  }
}

PunctualLight punctual_light(LightType type, vec3 color) {
  PunctualLight light;
  light.type = type;
  light.color = color;
  return light;
}

// Every pixel of the floor against `irradiance(p)`, which has no noise with one light.
template <class Irradiance>
void expect_floor(const Scene& scene, const Irradiance& irradiance) {
  for (const char* preset : {"path", "tree", "exhaustive"}) {
    const Settings settings = floor_view(preset);
    const Image image = render(scene, settings);
    for (int i = 0; i < 144; ++i) {
      const double expected = kFloorAlbedo / M_PI * irradiance(point_on_floor(settings, i % 12, i / 12));
      EXPECT_NEAR(pixel(image, "direct", i).y, expected, 2e-4 * expected + 1e-6)
          << preset << " " << i % 12 << "," << i / 12;
    }
  }
}

TEST(PathTracer, PointLightFollowsTheInverseSquare) {
  const vec3 at(0.5f, 2, -0.3f);
  SceneBuilder b;
  add_floor(b);
  b.punctual(punctual_light(LightType::kPoint, vec3(7)), at, vec3(0, -1, 0));
  expect_floor(b.scene, [&](vec3 p) { return 7 * 2 / std::pow(double(glm::length(at - p)), 3); });
}

TEST(PathTracer, RangeEndsAPointLight) {
  const vec3 at(0.5f, 2, -0.3f);
  SceneBuilder b;
  add_floor(b);
  PunctualLight light = punctual_light(LightType::kPoint, vec3(7));
  light.range = 2.5f;
  b.punctual(light, at, vec3(0, -1, 0));
  expect_floor(b.scene, [&](vec3 p) {
    const double d = glm::length(at - p);
    return 7 * 2 / (d * d * d) * std::clamp(1 - std::pow(d / 2.5, 4), 0.0, 1.0);
  });
}

TEST(PathTracer, SpotLightFadesBetweenItsCones) {
  const vec3 at(0, 3, 0), axis = glm::normalize(vec3(0.2f, -1, 0.1f));
  SceneBuilder b;
  add_floor(b);
  PunctualLight light = punctual_light(LightType::kSpot, vec3(7));
  light.inner_cone = 0.2f;
  light.outer_cone = 0.5f;
  b.punctual(light, at, axis);
  int bright = 0, dark = 0;
  expect_floor(b.scene, [&](vec3 p) {
    const double d = glm::length(p - at), cosine = glm::dot(p - at, axis) / d;
    const double ramp = std::clamp((cosine - std::cos(0.5)) / (std::cos(0.2) - std::cos(0.5)), 0.0, 1.0);
    bright += ramp == 1;
    dark += ramp == 0;
    return 7 * 3 / (d * d * d) * ramp * ramp;
  });
  EXPECT_GT(bright, 0);
  EXPECT_GT(dark, 0);
}

TEST(PathTracer, DirectionalLightIsTheSameEverywhere) {
  const vec3 direction = glm::normalize(vec3(0.4f, -1, 0.3f));
  SceneBuilder b;
  add_floor(b);
  b.punctual(punctual_light(LightType::kDirectional, vec3(2)), vec3(0), direction);
  expect_floor(b.scene, [&](vec3) { return 2 * -direction.y; });
}

// A point light between a floor and a panel above it: what the panel sends down, by quadrature over the
// panel.
TEST(PathTracer, OneBounceMatchesQuadrature) {
  constexpr double kPanel = 0.8, kHeight = 1.6;
  const glm::dvec3 light(0.2, 0.7, 0.1);
  SceneBuilder b;
  add_floor(b);
  b.quad(vec3(-1, kHeight, -1), vec3(2, 0, 0), vec3(0, 0, 2), b.material(vec3(0.8f)));
  b.punctual(punctual_light(LightType::kPoint, vec3(5)), vec3(light), vec3(0, -1, 0));
  Settings settings = floor_view("path");
  settings.spp = 200;
  settings.indirect.max_bounces = 1;
  const Image image = render(b.scene, settings);
  int compared = 0;
  for (int i = 0; i < 144; ++i) {
    if (pixel(image, "albedo", i).x > kFloorAlbedo + 0.01f) continue;  // the panel's back
    const glm::dvec3 x = point_on_floor(settings, i % 12, i / 12);
    if (glm::length(x) > 2.5) continue;  // too few paths meet the panel for a mean to be normal
    ++compared;
    double sum = 0;
    constexpr int kGrid = 60;
    for (int k = 0; k < kGrid * kGrid; ++k) {
      const glm::dvec3 y((k % kGrid + 0.5) / kGrid * 2 - 1, kHeight, (k / kGrid + 0.5) / kGrid * 2 - 1);
      const double to_light = glm::length(light - y), down = glm::length(x - y);
      const double radiance = kPanel / M_PI * 5 * (kHeight - light.y) / std::pow(to_light, 3);
      sum += radiance * kHeight * kHeight / std::pow(down, 4) * 4 / (kGrid * kGrid);
    }
    const double expected = kFloorAlbedo / M_PI * sum, error = std::sqrt(pixel(image, "variance", i).y);
    EXPECT_TRUE(mean_within(pixel(image, "indirect", i).y, error, expected, 4.5, 2e-3 * expected))
        << i % 12 << "," << i / 12;
  }
  EXPECT_GT(compared, 30);
}

// --- strategies
// ----------------------------------------------------------------------------------------------------

Image8or32 float_image(const std::string& name, int width, int height) {
  Image8or32 image;
  image.name = name;
  image.width = width;
  image.height = height;
  image.texels32.assign(static_cast<std::size_t>(4 * width * height), 1.0f);
  return image;
}

// Everything that light sampling and hits may see differently: a glossy floor, a textured lamp in a mirrored
// instance, a lamp of many triangles that shines to both sides, a lamp with holes, a screen, and a sky with a
// picture.
Scene mixed_room() {
  SceneBuilder b;
  const int wall = b.material(vec3(0.6f, 0.5f, 0.4f)),
            floor = b.material(vec3(0.7f, 0.6f, 0.3f), vec3(0), 1, 0.4f);
  const int plain = b.material(vec3(0.2f), vec3(3, 2, 1)), textured = b.material(vec3(0), vec3(6));
  const int holed = b.material(vec3(0.1f), vec3(1, 5, 2));
  b.quad(vec3(-2, 0, -2), vec3(0, 0, 4), vec3(4, 0, 0), floor);
  b.quad(vec3(-2, 0, -2), vec3(4, 0, 0), vec3(0, 3, 0), wall);
  b.quad(vec3(-2, 0, -2), vec3(0, 3, 0), vec3(0, 0, 4), wall);
  b.quad(vec3(0.5f, 0.3f, -1), vec3(0, 0, 1), vec3(-0.1f, 0.9f, 0), plain, 4, 4);
  b.quad(vec3(-0.6f, 0.01f, 0.3f), vec3(0.7f, 0, 0), vec3(0, 0.8f, 0.1f), wall);
  b.quad(vec3(0.6f, 1.6f, 0), vec3(0.9f, 0, 0), vec3(0, 0.1f, 0.9f), holed);
  b.quad(vec3(0.2f, 2, -1), vec3(1, 0, 0), vec3(0, 0, 1), textured, 2, 2);
  b.scene.nodes.back().scale = vec3(-1, 1, 1);
  Image8or32 checker = float_image("checker", 4, 4), sky = float_image("sky", 8, 4);
  for (int i = 0; i < 16; ++i) {
    const float v = (i + i / 4) % 2 ? 1.0f : 0.1f;
    checker.texels32[static_cast<std::size_t>(4 * i + 1)] = v;
    checker.texels32[static_cast<std::size_t>(4 * i + 3)] = v;
    sky.texels32[static_cast<std::size_t>(4 * i + 2)] = 10 * v;
  }
  b.scene.images = {checker, sky};
  b.scene.materials[static_cast<std::size_t>(textured)].emissive_texture.image = 0;
  b.scene.materials[static_cast<std::size_t>(plain)].double_sided = true;
  Material& holes = b.scene.materials[static_cast<std::size_t>(holed)];
  holes.base_color_texture.image = 0;
  holes.alpha_mode = AlphaMode::kMask;
  b.scene.environment = {vec3(0.05f, 0.1f, 0.2f), 1};
  return b.scene;
}

// Means of a picture's blocks under one strategy.
struct BlockMeans {
  static constexpr int kSize = 12, kBlock = 4, kPerRow = kSize / kBlock, kBlocks = kPerRow * kPerRow;
  RunningMean direct[kBlocks], indirect[kBlocks];

  void add(const Light& light) {
    double sums[2][kBlocks] = {};
    for (std::size_t i = 0; i < light.direct.size(); ++i) {
      const Pixel p = pixel_of_index({0, 0, kSize, kSize}, static_cast<int>(i));
      const int block = p.y / kBlock * kPerRow + p.x / kBlock;
      sums[0][block] += luminance(light.direct[i]);
      sums[1][block] += luminance(light.indirect[i]);
    }
    for (int k = 0; k < kBlocks; ++k) {
      direct[k].add(sums[0][k]);
      indirect[k].add(sums[1][k]);
    }
  }
};

// p-value of the hypothesis that both have the same means.
double agreement(const RunningMean (&a)[BlockMeans::kBlocks], const RunningMean (&b)[BlockMeans::kBlocks]) {
  double chi = 0;
  for (int k = 0; k < BlockMeans::kBlocks; ++k) {
    const double error2 = std::pow(a[k].standard_error(), 2) + std::pow(b[k].standard_error(), 2);
    chi += std::pow(a[k].mean() - b[k].mean(), 2) / error2;
  }
  return testing::chi_square_tail(chi, BlockMeans::kBlocks);
}

TEST(PathTracer, LightSamplingBsdfSamplingAndBothAgree) {
  Settings settings =
      square_view("path", BlockMeans::kSize, vec3(0.8f, 1.6f, 2.6f), vec3(-0.2f, 0.7f, 0), 65);
  settings.force_diffuse = false;
  settings.indirect.max_bounces = 2;
  settings.indirect.roulette_start = 2;
  const auto run = [&](Selection selection, Strategy strategy, int samples) {
    settings.direct.selection = selection;
    PathBatch batch(mixed_room(), settings);
    BlockMeans means;
    for (int s = 0; s < samples; ++s)
      means.add(batch.sample(strategy, s + 10000 * static_cast<int>(strategy)));
    return means;
  };
  const BlockMeans bsdf = run(Selection::kRoot, Strategy::kBsdfSampling, 1500);
  for (const Selection selection :
       {Selection::kRoot, Selection::kPower, Selection::kUniform, Selection::kAll}) {
    const int samples = selection == Selection::kAll ? 100 : 500, name = static_cast<int>(selection);
    const BlockMeans light = run(selection, Strategy::kLightSampling, samples);
    const BlockMeans both = run(selection, Strategy::kBoth, samples);
    EXPECT_GT(agreement(light.direct, both.direct), 1e-3) << name;
    EXPECT_GT(agreement(light.indirect, both.indirect), 1e-3) << name;
    EXPECT_GT(agreement(bsdf.direct, both.direct), 1e-3) << name;
    EXPECT_GT(agreement(bsdf.indirect, both.indirect), 1e-3) << name;
  }
  // The weights count the light samples.
  settings.direct.spp = 3;
  const BlockMeans three = run(Selection::kRoot, Strategy::kBoth, 300);
  EXPECT_GT(agreement(bsdf.direct, three.direct), 1e-3);
  EXPECT_GT(agreement(bsdf.indirect, three.indirect), 1e-3);
}

TEST(PathTracer, BalanceWeightsOfBothStrategiesAddToOne) {
  for (const float p : {1e-20f, 0.1f, 1.0f, 3e5f, kInfinity})
    for (const float q : {0.0f, 1e-20f, 0.7f, 2e8f})
      EXPECT_NEAR(balance_weight(p, q) + balance_weight(q, p), 1, 1e-6f) << p << " " << q;
  EXPECT_EQ(balance_weight(0, 0), 0);
}

// --- film
// ----------------------------------------------------------------------------------------------------------

TEST(PathTracer, NoBouncesMeansNoIndirectLight) {
  Settings settings = square_view("path", 8, vec3(0.8f, 1.6f, 2.6f), vec3(-0.2f, 0.7f, 0), 65);
  settings.indirect.max_bounces = 0;
  settings.spp = 4;
  const Image image = render(mixed_room(), settings);
  EXPECT_EQ(image_mean(image, "indirect").mean, 0);
  EXPECT_GT(image_mean(image, "direct").mean, 0);
}

TEST(PathTracer, LayersAddUpToTheBeauty) {
  Settings settings = square_view("path", 8, vec3(0.8f, 1.6f, 2.6f), vec3(-0.2f, 0.7f, 0), 65);
  settings.spp = 4;
  const Image image = render(mixed_room(), settings);
  for (int i = 0; i < 64; ++i) {
    const vec3 sum = pixel(image, "direct", i) + pixel(image, "indirect", i) + pixel(image, "emission", i);
    EXPECT_LT(glm::length(sum - pixel(image, "", i)), 1e-5f * (1 + glm::length(sum)));
  }
}

TEST(PathTracer, StandardErrorIsThatOfRepeatedRenders) {
  constexpr int kSize = 6, kSeeds = 60;
  std::vector<RunningMean> means(kSize * kSize);
  double claimed = 0, found = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Settings settings = square_view("path", kSize, vec3(0.8f, 1.6f, 2.6f), vec3(-0.2f, 0.7f, 0), 65);
    settings.spp = 8;
    settings.seed = static_cast<std::uint32_t>(seed);
    const Image image = render(mixed_room(), settings);
    for (int i = 0; i < kSize * kSize; ++i) {
      means[static_cast<std::size_t>(i)].add(pixel(image, "", i).y);
      claimed += pixel(image, "variance", i).y / kSeeds;
    }
  }
  for (const RunningMean& m : means) found += m.variance();
  EXPECT_NEAR(claimed / found, 1, 0.15);
}

TEST(PathTracer, LightScaleScalesEverything) {
  Settings settings = square_view("path", 8, vec3(0.8f, 1.6f, 2.6f), vec3(-0.2f, 0.7f, 0), 65);
  settings.spp = 2;
  const Image one = render(mixed_room(), settings);
  settings.light_scale = 4;
  const Image four = render(mixed_room(), settings);
  for (int i = 0; i < 64; ++i) {
    const vec3 a = pixel(one, "", i) * 4.0f, b = pixel(four, "", i);
    EXPECT_LT(glm::length(a - b), 1e-5f * glm::length(a));
  }
}

Scene scaled(Scene scene, float factor) {
  for (Mesh& mesh : scene.meshes)
    for (vec3& p : mesh.positions) p *= factor;
  for (Node& node : scene.nodes) node.translation *= factor;
  return scene;
}

TEST(PathTracer, ScalingTheSceneChangesNoPixel) {
  Settings settings = square_view("path", 16, vec3(0.8f, 1.6f, 2.6f), vec3(-0.2f, 0.7f, 0), 65);
  settings.force_diffuse = false;
  settings.spp = 4;
  const auto render_scaled = [&](float factor) {
    Settings view = settings;
    view.view->position *= factor;
    view.view->look_at *= factor;
    return render(scaled(mixed_room(), factor), view);
  };
  const Image small = render_scaled(1);
  EXPECT_EQ(small.find("")->values, render_scaled(1024).find("")->values);
  // By 1000 coordinates are rounded otherwise, so that a few random choices fall the other way.
  const Image thousand = render_scaled(1000);
  int same = 0;
  for (int i = 0; i < 256; ++i) {
    const vec3 a = pixel(small, "", i), b = pixel(thousand, "", i);
    same += glm::length(a - b) <= 1e-3f * glm::length(a);
  }
  EXPECT_GE(same, 250);
}

TEST(PathTracer, SameBitsForAnyNumberOfThreads) {
  Settings settings = square_view("path", 80, vec3(0.8f, 1.6f, 2.6f), vec3(-0.2f, 0.7f, 0), 65);
  settings.force_diffuse = false;
  settings.threads = 1;
  const Image one = render(mixed_room(), settings);
  for (const int threads : {2, 4}) {
    settings.threads = threads;
    const Image several = render(mixed_room(), settings);
    EXPECT_EQ(one.find("")->values, several.find("")->values) << threads;
    EXPECT_EQ(one.find("indirect")->values, several.find("indirect")->values) << threads;
  }
}

// --- how finely an emitter is cut
// ----------------------------------------------------------------------------------

double noise_of_quad(const std::string& preset, int cells) {
  SceneBuilder b;
  add_floor(b);
  b.quad(vec3(-0.5f, 1, -0.5f), vec3(1, 0, 0), vec3(0, 0, 1), b.material(vec3(0), vec3(5)), cells, cells);
  Settings settings = square_view(preset, 12, vec3(0.1f, 0.8f, 3), vec3(0, 0, 0), 40);
  settings.spp = 100;
  const Image image = render(b.scene, settings);
  double variance = 0;
  for (int i = 0; i < 144; ++i) variance += pixel(image, "variance", i).y;
  return variance;
}

TEST(PathTracer, FinelyCutQuadIsNoNoisierThanACoarseOne) {
  const double power = noise_of_quad("power", 32) / noise_of_quad("power", 1);  // 2048 and 2 triangles
  EXPECT_NEAR(power, 1, 0.15);
  EXPECT_LT(noise_of_quad("tree", 32) / noise_of_quad("tree", 1), 1.15);
}

}  // namespace
}  // namespace lumigrove
