#include "frame/history.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "instance_fixtures.h"
#include "lumigrove/renderer.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

// Shared lamps, one of them textured, over a floor.
Scene lamps() {
  Scene scene = with_points(instances_of(16, [](Stream& r) { return turn(r) * stretch(vec3(-1, 2, 0.5f)); }));
  add_node(scene, {add_mesh(scene, add_material(scene, vec3(0)),
                            {vec3(-20, -7, -20), vec3(-20, -7, 20), vec3(20, -7, 20), vec3(-20, -7, -20),
                             vec3(20, -7, 20), vec3(20, -7, -20)})});
  scene.environment.radiance = vec3(0.1f);
  return scene;
}

Settings view_of_lamps() {
  Settings settings = make_preset("rtslc");
  settings.direct.hierarchy = Hierarchy::kTwoLevel;
  settings.width = settings.height = 16;
  settings.view = ViewSettings{vec3(0, 12, 16), vec3(0, -4, 0), vec3(0, 1, 0)};
  return settings;
}

struct RenderedFrame {
  Image image;
  bool built_meshes;
};

RenderedFrame frame_of(const Scene& scene, const Settings& settings, History* history) {
  RenderStats stats;
  Image image = render(scene, settings, &stats, {}, history);
  return {std::move(image), std::any_of(stats.structures.begin(), stats.structures.end(),
                                        [](const StructureStats& s) { return s.name == "bottom trees"; })};
}

// The frame is the same to the bit as without a history.
RenderedFrame expect_same_picture(const Scene& scene, const Settings& settings, History& history) {
  RenderedFrame with = frame_of(scene, settings, &history);
  const RenderedFrame without = frame_of(scene, settings, nullptr);
  EXPECT_EQ(with.image.layers.size(), without.image.layers.size());
  if (settings.light_scale > 0) {
    EXPECT_GT(*std::max_element(with.image.find("direct")->values.begin(), with.image.find("direct")->values.end()), 0);
  }
  for (std::size_t i = 0; i < with.image.layers.size(); ++i)
    EXPECT_EQ(with.image.layers[i].values, without.image.layers[i].values) << with.image.layers[i].name;
  return with;
}

TEST(History, MovingInstancesRebuildsTheTopLevelOnly) {
  Scene scene = lamps();
  Settings settings = view_of_lamps();
  History history;
  EXPECT_TRUE(expect_same_picture(scene, settings, history).built_meshes);
  EXPECT_EQ(history.kept().two_level.meshes_built(), 4);
  Stream random(4);
  for (settings.frame = 1; settings.frame < 4; ++settings.frame) {
    for (std::size_t i = 0; i < 16; ++i) scene.nodes[i].matrix[3] += vec4(random.direction(), 0);
    scene.nodes[3].matrix = scene.nodes[3].matrix * stretch(vec3(-1, 2, 1));
    EXPECT_FALSE(expect_same_picture(scene, settings, history).built_meshes);
    EXPECT_EQ(history.kept().two_level.meshes_built(), 4);
  }
}

// A scene that was changed in place, at the same addresses, is another scene.
TEST(History, SeesEveryChangeThatMatters) {
  const Scene original = lamps();
  const auto emissive_texels = [](Scene& s) -> std::vector<float>& { return s.images[0].texels32; };
  const std::vector<std::pair<const char*, std::function<void(Scene&)>>> changes = {
      {"a vertex", [](Scene& s) { s.meshes[1].positions[7].x += 0.3f; }},
      {"a triangle", [](Scene& s) { std::swap(s.meshes[0].triangles[2].x, s.meshes[0].triangles[2].y); }},
      {"emission", [](Scene& s) { s.materials[0].emission *= 1.7f; }},
      {"two sides", [](Scene& s) { s.materials[0].double_sided = true; }},
      {"another material", [](Scene& s) { s.meshes[0].material = s.meshes[1].material; }},
      {"a lamp put out", [](Scene& s) { s.materials[2].emission = vec3(0); }},
      {"texels", [&](Scene& s) { std::reverse(emissive_texels(s).begin(), emissive_texels(s).end()); }},
      {"texture coordinates", [](Scene& s) { s.meshes[3].uv0[3] = vec2(0.9f, 0.1f); }},
      {"texture placement", [](Scene& s) { s.materials[3].emissive_texture.offset.x = 0.4f; }},
      {"a mesh more", [](Scene& s) {
         s.meshes.push_back(s.meshes[1]);
         s.nodes[0].meshes = {static_cast<int>(s.meshes.size()) - 1};
       }}};
  const Settings settings = view_of_lamps();
  for (const auto& [what, change] : changes) {
    SCOPED_TRACE(what);
    Scene scene = original;
    History history;
    expect_same_picture(scene, settings, history);
    change(scene);
    EXPECT_TRUE(expect_same_picture(scene, settings, history).built_meshes);
    EXPECT_FALSE(expect_same_picture(scene, settings, history).built_meshes);
  }
}

TEST(History, SeesAnotherEnvironment) {
  Scene scene = lamps();
  Image8or32 sky;
  sky.width = 4, sky.height = 2;
  Stream random(3);
  for (int i = 0; i < 32; ++i) sky.texels32.push_back(random.next().x);
  scene.images.push_back(sky);
  scene.environment = {vec3(1), static_cast<int>(scene.images.size()) - 1};
  History history;
  expect_same_picture(scene, view_of_lamps(), history);
  scene.images.back().texels32[5] = 40;
  expect_same_picture(scene, view_of_lamps(), history);
  scene.environment = {};
  expect_same_picture(scene, view_of_lamps(), history);
}

TEST(History, ServesAnySettings) {
  const Scene scene = lamps();
  History history;
  Settings settings = view_of_lamps();
  expect_same_picture(scene, settings, history);
  settings.light_scale = 3;
  expect_same_picture(scene, settings, history);
  settings.light_scale = 0;
  expect_same_picture(scene, settings, history);
  settings.light_scale = 1;
  settings.direct.width = 4;
  EXPECT_TRUE(expect_same_picture(scene, settings, history).built_meshes);
  for (const char* preset : {"tree", "power", "ats", "path", "sst"}) {
    Settings other = make_preset(preset);
    other.width = other.height = 16;
    other.view = settings.view;
    other.indirect.vpls = 300;
    expect_same_picture(scene, other, history);
  }
  expect_same_picture(scene, settings, history);
}

TEST(History, SurvivesMovesAndErrors) {
  const Scene scene = lamps();
  const Settings settings = view_of_lamps();
  History history;
  expect_same_picture(scene, settings, history);
  const auto fail = [](const Progress&) -> bool { throw Error("stopped"); };
  EXPECT_THROW(render(scene, settings, nullptr, fail, &history), Error);
  EXPECT_TRUE(expect_same_picture(scene, settings, history).built_meshes);
  History other = std::move(history);
  EXPECT_FALSE(expect_same_picture(scene, settings, other).built_meshes);
  EXPECT_TRUE(expect_same_picture(scene, settings, history).built_meshes);  // moved from
}

}  // namespace
}  // namespace lumigrove
