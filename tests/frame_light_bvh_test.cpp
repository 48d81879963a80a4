#include <gtest/gtest.h>

#include <algorithm>

#include "light_scenes.h"
#include "lumigrove/renderer.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

// A floor and boxes under many small quads, lamps, a sun and a sky.
Scene many_lights() {
  SceneBuilder b;
  const int floor = b.material(vec3(0.6f)), bright = b.material(vec3(0), vec3(30)), dim = b.material(vec3(0), vec3(3));
  b.quad(vec3(-3, 0, -3), vec3(0, 0, 6), vec3(6, 0, 0), floor);
  b.room(vec3(0.8f, 0.7f, 0.5f), vec3(0.1f, 0, -0.4f), floor);  // fronts outside
  for (int i = 0; i < 60; ++i) {
    const auto at = [&](int k) { return static_cast<float>((i * k) % 61) / 61; };
    const vec3 p(at(7) * 5 - 2.5f, 0.4f + 2 * at(23), at(31) * 5 - 2.5f);
    b.quad(p, vec3(0.06f, 0, 0), vec3(0, 0.02f * at(5), 0.06f), i % 9 == 0 ? bright : dim);
  }
  PunctualLight lamp;
  lamp.type = LightType::kPoint;
  lamp.color = vec3(1);
  for (int i = 0; i < 4; ++i) b.punctual(lamp, vec3(static_cast<float>(i) - 1.5f, 1.3f, 0.7f), vec3(0, -1, 0));
  lamp.type = LightType::kDirectional;
  b.punctual(lamp, vec3(0, 5, 0), vec3(0.3f, -1, 0.2f));
  b.scene.environment.radiance = vec3(0.2f);
  return b.scene;
}

Settings view_of(const std::string& preset, int spp) {
  Settings settings = square_view(preset, 14, vec3(0.4f, 1.9f, 3.4f), vec3(0, 0.2f, -0.4f), 60);
  settings.spp = spp;
  return settings;
}

ImageMean direct_mean(const Settings& settings) { return image_mean(render(many_lights(), settings), "direct"); }

TEST(FrameLightBvh, EveryTreeHasTheMeanOfAllLights) {
  const ImageMean truth = direct_mean(view_of("exhaustive", 30));
  Settings ats = view_of("ats", 100), capped = ats, averaged = ats, whole = ats, agglomerative = ats, min_max = ats,
           yuksel = ats;
  capped.direct.split = 0.95f, capped.direct.split_cap = 3;
  averaged.direct.spp = 3, averaged.spp = 40;
  whole.direct.split = 0, whole.spp = 600;
  agglomerative.direct.hierarchy = Hierarchy::kAgglomerative;
  min_max.direct.weights = Weights::kMinMax;
  yuksel.direct.weights = Weights::kYuksel;
  for (const Settings* settings : {&ats, &capped, &averaged, &whole, &agglomerative, &min_max, &yuksel}) {
    const ImageMean found = direct_mean(*settings);
    const double error = std::hypot(found.standard_error, truth.standard_error);
    // 7 comparisons: 4 standard errors keep false alarms below one in two thousand.
    EXPECT_TRUE(mean_within(found.mean, error, truth.mean, 4, 1e-4 * truth.mean));
    EXPECT_LT(error, 0.02 * truth.mean);
  }
}

TEST(FrameLightBvh, PartsHaveTheMeanOfAllLightsBesideBsdfSamples) {
  Scene scene = many_lights();
  for (Material& material : scene.materials)
    if (max_component(material.emission) == 0) material.metallic = 1, material.roughness = 0.3f;
  const auto mean_of = [&](const char* preset, bool mis, int samples, int spp) {
    Settings settings = view_of(preset, spp);
    settings.force_diffuse = false;
    settings.direct.mis = mis;
    settings.direct.spp = samples;
    return image_mean(render(scene, settings), "direct");
  };
  const ImageMean truth = mean_of("exhaustive", true, 1, 40);
  for (const int samples : {1, 3}) {
    const ImageMean both = mean_of("ats", true, samples, 120), light = mean_of("ats", false, samples, 120);
    const double error = std::hypot(both.standard_error, truth.standard_error);
    EXPECT_TRUE(mean_within(both.mean, error, truth.mean, 4, 1e-4 * truth.mean));
    EXPECT_LT(error, 0.02 * truth.mean);
    EXPECT_LT(both.standard_error, light.standard_error);
  }
}

TEST(FrameLightBvh, ItServesPathsToo) {
  Settings tree = view_of("path", 150), bvh = tree;
  bvh.direct.hierarchy = Hierarchy::kSaoh;
  bvh.direct.weights = Weights::kSaoh;
  const Image a = render(many_lights(), tree), b = render(many_lights(), bvh);
  for (const char* layer : {"direct", "indirect"}) {
    const ImageMean p = image_mean(a, layer), q = image_mean(b, layer);
    EXPECT_TRUE(mean_within(q.mean, std::hypot(p.standard_error, q.standard_error), p.mean)) << layer;
  }
}

TEST(FrameLightBvh, SplittingLessensTheError) {
  Settings split = view_of("ats", 40), whole = split;
  whole.direct.split = 0;
  EXPECT_LT(direct_mean(split).standard_error, 0.7 * direct_mean(whole).standard_error);
}

TEST(FrameLightBvh, SameBitsForAnyNumberOfThreadsAndTheTreeIsNamed) {
  Settings settings = view_of("ats", 2);
  settings.width = settings.height = 70;  // four tiles
  settings.threads = 1;
  RenderStats stats;
  const Image one = render(many_lights(), settings, &stats);
  EXPECT_TRUE(std::any_of(stats.structures.begin(), stats.structures.end(),
                          [](const StructureStats& s) { return s.name == "SAOH tree"; }));
  settings.threads = 4;
  EXPECT_EQ(one.find("")->values, render(many_lights(), settings).find("")->values);
}

}  // namespace
}  // namespace lumigrove
