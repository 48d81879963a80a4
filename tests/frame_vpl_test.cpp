#include "frame/frame.h"

#include <gtest/gtest.h>

#include <cstring>

#include "light_scenes.h"
#include "lumigrove/renderer.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

// A room with a lamp of no noise, a glossy floor and a box.
Scene small_room() {
  SceneBuilder b;
  b.room(vec3(-2, 0, -2), vec3(2, 3, 2), b.material(vec3(0.7f, 0.6f, 0.5f)));
  b.quad(vec3(-2, 0.01f, -2), vec3(0, 0, 4), vec3(4, 0, 0), b.material(vec3(0.5f), vec3(0), 0.3f, 0.5f));
  b.room(vec3(1, 1, 0.5f), vec3(0.2f, 0.02f, -0.4f), b.material(vec3(0.3f, 0.6f, 0.4f)));  // fronts outside
  PunctualLight lamp;
  lamp.type = LightType::kPoint;
  lamp.color = vec3(4);
  b.punctual(lamp, vec3(-0.6f, 2.3f, 0.4f), vec3(0, -1, 0));
  return b.scene;
}

// The same, lit by a quad, whose light does not depend on the unit of length.
Scene scaled_room(float factor) {
  Scene scene = small_room();
  scene.lights.clear();
  for (Node& node : scene.nodes) node.light = -1;
  SceneBuilder b;
  b.scene = std::move(scene);
  b.quad(vec3(-0.3f, 2.9f, -0.3f), vec3(0.6f, 0, 0), vec3(0, 0, 0.6f), b.material(vec3(0), vec3(12)));
  for (Mesh& mesh : b.scene.meshes)
    for (vec3& p : mesh.positions) p *= factor;
  for (Node& node : b.scene.nodes) node.translation *= factor;
  return b.scene;
}

Settings room_view(const std::string& preset, int size = 12, float factor = 1) {
  Settings settings = square_view(preset, size, vec3(0.3f, 1.7f, 1.8f) * factor, vec3(0, 0.7f, -1) * factor, 75);
  settings.force_diffuse = false;
  settings.indirect.vpls = 600;
  settings.indirect.keep_vpls = true;
  return settings;
}

// Luminance-like mean (green) of the indirect layer. The lamp has no noise, so that the variance is this layer's.
ImageMean indirect_mean(const Settings& settings) { return image_mean(render(small_room(), settings), "indirect"); }

double mean_of_all(Settings settings) {
  settings.indirect.selection = Selection::kAll;
  settings.indirect.stop = Stop::kLeaf;
  settings.indirect.correction = 0;
  settings.spp = 1;  // no noise
  return indirect_mean(settings).mean;
}

TEST(FrameVpl, EveryPresetHasTheMeanOfAllLights) {
  const double truth = mean_of_all(room_view("sst"));
  EXPECT_GT(truth, 0.01);
  Settings slc = room_view("slc"), sst = room_view("sst"), corrected = sst, uniform = sst;
  corrected.indirect.correction = 0.25f;
  uniform.indirect.selection = Selection::kUniform;
  uniform.indirect.hierarchy = Hierarchy::kNone;
  for (Settings* settings : {&slc, &corrected, &uniform}) {
    settings->spp = 150;
    const ImageMean found = indirect_mean(*settings);
    EXPECT_TRUE(mean_within(found.mean, found.standard_error, truth, 4, 1e-4 * truth));
    EXPECT_LT(found.standard_error, 0.03 * truth);
  }
  sst.spp = 150;
  EXPECT_NEAR(indirect_mean(sst).mean / truth, 1, 0.05);  // substitutes are biased
}

TEST(FrameVpl, NewLightsForEverySampleApproachThePathTracer) {
  Settings vpl = room_view("slc"), path = room_view("path");
  vpl.spp = path.spp = 300;
  vpl.force_diffuse = path.force_diffuse = true;
  vpl.indirect.keep_vpls = false;
  vpl.indirect.clamp = 0;
  vpl.indirect.bounces = path.indirect.max_bounces = 2;
  path.indirect.roulette_start = vpl.indirect.roulette_start = 100;
  const ImageMean a = indirect_mean(vpl), b = indirect_mean(path);
  // All pixels of a sample share its lights, so that the variance says too little of their mean.
  EXPECT_NEAR(a.mean / b.mean, 1, 0.03);
}

std::vector<std::string> variants() { return {"sst", "slc", "corrected", "gathered", "power"}; }
Settings variant(const std::string& name) {
  Settings settings = room_view(name == "slc" ? "slc" : "sst");
  settings.jitter = true;
  settings.indirect.keep_vpls = name == "slc";
  settings.spp = 2;
  if (name == "corrected") settings.indirect.correction = 0.25f;
  if (name == "power") settings.indirect.selection = Selection::kPower;
  if (name == "gathered") {
    settings.indirect.compensate = true;
    settings.indirect.mirror_roughness = 0.6f;
  }
  return settings;
}

void expect_same_image(const Image& a, const Image& b) {
  ASSERT_EQ(a.layers.size(), b.layers.size());
  for (std::size_t i = 0; i < a.layers.size(); ++i) {
    const Layer &p = a.layers[i], &q = b.layers[i];
    ASSERT_EQ(p.values.size(), q.values.size());
    ASSERT_EQ(p.ids, q.ids) << p.name;
    if (p.values.empty()) continue;
    ASSERT_EQ(std::memcmp(p.values.data(), q.values.data(), p.values.size() * sizeof(float)), 0) << p.name;
  }
}

TEST(FrameVpl, AFrameDoesNotDependOnThoseBefore) {
  for (const std::string& name : variants()) {
    SCOPED_TRACE(name);
    Settings settings = variant(name);
    settings.frame = 5;
    const Image alone = render(small_room(), settings);
    Image last;
    for (settings.frame = 0; settings.frame <= 5; ++settings.frame) {
      const Image image = render(small_room(), settings);
      if (settings.frame > 0) {
        EXPECT_NE(image.find("indirect")->values, last.find("indirect")->values);
      }
      last = image;
    }
    expect_same_image(last, alone);
  }
}

// The world's buffers are used again for every sample.
TEST(FrameVpl, LightsOfASampleDoNotDependOnThoseBefore) {
  const Scene scene = small_room();
  Settings settings = variant("sst");
  RenderStats stats;
  const std::unique_ptr<World> used = make_world(scene, settings, stats), fresh = make_world(scene, settings, stats);
  for (const int vpls : {5000, 10, 3000}) {
    Settings other = settings;
    other.indirect.vpls = vpls;
    trace_vpls(*used, other, vpls, stats);
  }
  trace_vpls(*used, settings, 3, stats);
  trace_vpls(*fresh, settings, 3, stats);
  const SubstituteTreeView a = used->substitutes.view(), b = fresh->substitutes.view();
  ASSERT_EQ(a.count, b.count);
  EXPECT_GT(a.count, 300u);
  EXPECT_EQ(std::memcmp(a.vpls.data(), b.vpls.data(), a.vpls.size_bytes()), 0);
  EXPECT_EQ(std::memcmp(a.nodes, b.nodes, (a.count - 1) * sizeof(SubstituteNode)), 0);
  EXPECT_EQ(std::memcmp(a.distributions, b.distributions, (a.count - 1) * sizeof(Distribution)), 0);
  EXPECT_EQ(a.root_usable, b.root_usable);
}

TEST(FrameVpl, SameBitsForAnyNumberOfThreads) {
  for (const std::string& name : variants()) {
    SCOPED_TRACE(name);
    Settings settings = variant(name);
    settings.width = settings.height = 80;  // more than one tile
    settings.indirect.show = true;
    settings.threads = 1;
    const Image one = render(small_room(), settings);
    for (const int threads : {2, 4}) {
      settings.threads = threads;
      expect_same_image(render(small_room(), settings), one);
    }
  }
}

TEST(FrameVpl, CroppingChangesNoPixel) {
  Settings settings = variant("corrected");
  settings.width = settings.height = 40;
  const Image whole = render(small_room(), settings);
  settings.pixel_bounds = {7, 33, 11, 22};
  const Image part = render(small_room(), settings);
  for (int y = 11; y < 22; ++y)
    for (int x = 7; x < 33; ++x) EXPECT_EQ(pixel(part, "", y * 40 + x), pixel(whole, "", y * 40 + x)) << x << "," << y;
}

TEST(FrameVpl, ShowAddsALayerOfTheWalks) {
  Settings settings = variant("sst");
  const Image hidden = render(small_room(), settings);
  EXPECT_EQ(hidden.find("walk"), nullptr);
  settings.indirect.show = true;
  const Image shown = render(small_room(), settings);
  const Layer* walk = shown.find("walk");
  ASSERT_NE(walk, nullptr);
  EXPECT_EQ(walk->channels, (std::vector<std::string>{"steps", "size", "substitute", "boxed", "clamped"}));
  ASSERT_EQ(walk->values.size(), 144u * 5);
  EXPECT_EQ(hidden.find("")->values, shown.find("")->values);
  float steps = 0, substitutes = 0;
  for (std::size_t i = 0; i < 144; ++i) {
    const float* v = walk->values.data() + 5 * i;
    for (int c = 0; c < 5; ++c) EXPECT_GE(v[c], 0);
    EXPECT_LE(v[0], 40);
    EXPECT_LE(v[1], 6.5f);  // the room's diagonal
    for (int c = 2; c < 5; ++c) EXPECT_LE(v[c], 1);
    EXPECT_LE(v[3], v[2]);
    EXPECT_EQ(v[1] > 0, v[2] > 0);
    steps += v[0] / 144;
    substitutes += v[2] / 144;
  }
  EXPECT_GT(steps, 2);
  EXPECT_LT(steps, 15);
  EXPECT_GT(substitutes, 0.2f);
  // To leaves no substitute is seen, and more steps are gone.
  settings.indirect.stop = Stop::kLeaf;
  const Image leaves = render(small_room(), settings);
  float leaf_steps = 0;
  for (std::size_t i = 0; i < 144; ++i) {
    EXPECT_EQ(leaves.find("walk")->values[5 * i + 2], 0);
    leaf_steps += leaves.find("walk")->values[5 * i] / 144;
  }
  EXPECT_GT(leaf_steps, steps);
}

TEST(FrameVpl, ScalingTheSceneChangesNoPixel) {
  for (const Weights weight : {Weights::kDistanceBounded, Weights::kInBox, Weights::kYuksel}) {
    for (const bool leaf : {false, true}) {
      SCOPED_TRACE(std::to_string(static_cast<int>(weight)) + (leaf ? ", leaf" : ", substitute"));
      const auto render_scaled = [&](float factor) {
        Settings settings = room_view("sst", 16, factor);
        settings.indirect.weights = weight;
        settings.indirect.stop = leaf ? Stop::kLeaf : Stop::kSubstitute;
        settings.indirect.cones = leaf;
        settings.indirect.max_diagonal = leaf ? 0 : 0.3f;
        settings.indirect.compensate = true;
        settings.indirect.mirror_roughness = leaf ? 0 : 0.6f;
        settings.spp = 2;
        return render(scaled_room(factor), settings);
      };
      const Image small = render_scaled(1);
      EXPECT_GT(image_mean(small, "indirect").mean, 0.01);
      EXPECT_EQ(small.find("")->values, render_scaled(1024).find("")->values);
      // By 1000 coordinates and boxes are rounded otherwise, so that some random choices fall the other way.
      const Image thousand = render_scaled(1000);
      int same = 0;
      for (int i = 0; i < 256; ++i) {
        const vec3 a = pixel(small, "", i), b = pixel(thousand, "", i);
        same += glm::length(a - b) <= 0.02f * glm::length(a);
      }
      EXPECT_GE(same, 215);
      EXPECT_NEAR(image_mean(thousand, "indirect").mean / image_mean(small, "indirect").mean, 1, 0.05);
    }
  }
}

TEST(FrameVpl, NoLightAtAllIsBlack) {
  Scene dark = small_room();
  dark.lights[0].color = vec3(0);
  for (const std::string& name : variants()) {
    const Image image = render(dark, variant(name));
    for (int i = 0; i < 144; ++i) EXPECT_EQ(pixel(image, "", i), vec3(0)) << name;
  }
}

// --- what makes no sense -----------------------------------------------------------------------------------------

void expect_refused(const Settings& settings, const std::string& word) {
  try {
    check(settings);
    ADD_FAILURE() << "accepted: " << word;
  } catch (const Error& error) {
    const std::string sentence = error.what();
    EXPECT_NE(sentence.find(word), std::string::npos) << sentence;
    EXPECT_GT(sentence.size(), 30u) << sentence;
  }
}

TEST(FrameVpl, CombinationsWithoutSenseAreRefused) {
  Settings settings = make_preset("sst");
  EXPECT_NO_THROW(check(settings));
  settings.indirect.hierarchy = Hierarchy::kNone;
  expect_refused(settings, "indirect.hierarchy");
  EXPECT_THROW(render(small_room(), settings), Error);
  settings.indirect.selection = Selection::kPower;
  EXPECT_NO_THROW(check(settings));
  settings.indirect.correction = 0.5f;
  expect_refused(settings, "indirect.correction");

  settings = make_preset("slc");
  settings.indirect.correction = 0.5f;
  expect_refused(settings, "indirect.correction");
  settings.indirect.stop = Stop::kSubstitute;
  EXPECT_NO_THROW(check(settings));
  settings.indirect.transport = Transport::kPath;  // says nothing of lights that are not traced
  settings.indirect.hierarchy = Hierarchy::kNone;
  EXPECT_NO_THROW(check(settings));
}

TEST(FrameVpl, NumbersOutOfRangeAreRefused) {
  const auto refuse = [](const std::string& key, const auto& change) {
    Settings settings = make_preset("sst");
    change(settings.indirect);
    expect_refused(settings, key);
  };
  refuse("indirect.vpls", [](auto& s) { s.vpls = 0; });
  refuse("indirect.bounces", [](auto& s) { s.bounces = 0; });
  refuse("indirect.clamp", [](auto& s) { s.clamp = -1; });
  refuse("indirect.clamp", [](auto& s) { s.clamp = std::nanf(""); });
  refuse("indirect.distance_floor", [](auto& s) { s.distance_floor = 2; });
  refuse("indirect.spp", [](auto& s) { s.spp = 0; });
  refuse("indirect.min_nu", [](auto& s) { s.min_nu = 1.5f; });
  refuse("indirect.max_sigma", [](auto& s) { s.max_sigma = -0.1f; });
  refuse("indirect.correction", [](auto& s) { s.correction = 1.5f; });
  refuse("indirect.mirror_roughness", [](auto& s) { s.mirror_roughness = -1; });
}

}  // namespace
}  // namespace lumigrove
