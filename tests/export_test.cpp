// Scene -> file -> scene. A scene made by hand holds one of everything; the built-in scenes bring the sizes.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <nlohmann/json.hpp>

#include "lumigrove/scene.h"
#include "scene/image_encode.h"
#include "scene/import.h"
#include "temp_folder.h"

namespace lumigrove {
namespace {

// 3 x 2 texels with all kinds of alpha, colour under zero alpha included.
Image8or32 test_image(const std::string& name, bool srgb, std::uint8_t seed) {
  Image8or32 image{.name = name, .width = 3, .height = 2, .srgb = srgb, .texels8 = {}, .texels32 = {}};
  for (int i = 0; i < 3 * 2 * 4; ++i) image.texels8.push_back(static_cast<std::uint8_t>(seed + 41 * i));
  image.texels8[3] = 0;
  return image;
}

Mesh test_triangle(const std::string& name, int material, float z) {
  Mesh mesh;
  mesh.name = name;
  mesh.positions = {vec3(0, 0, z), vec3(1, 0, z), vec3(0, 1, z)};
  mesh.triangles = {uvec3(0, 1, 2)};
  mesh.material = material;
  return mesh;
}

// Nodes stand in depth-first order and show their meshes in order, so that reading back keeps all indices.
Scene rich_scene() {
  Scene s;
  s.name = "rich";
  s.images = {test_image("base", true, 7), test_image("surface", false, 90), test_image("normal", false, 130),
              test_image("glow", true, 200)};
  Material plain;
  plain.name = "plain";
  plain.base_color = vec3(0.1f, 0.2f, 0.3f);
  plain.roughness = 0.35f;
  Material full;
  full.name = "full";
  full.base_color = vec3(0.9f, 0.8f, 0.7f);
  full.alpha = 0.75f;
  full.metallic = 0.6f;
  full.roughness = 0.2f;
  full.emission = vec3(17.3f, 0.7f, 4001);
  full.normal_scale = 0.5f;
  full.alpha_mode = AlphaMode::kMask;
  full.alpha_cutoff = 0.3f;
  full.double_sided = true;
  full.base_color_texture = {.image = 0, .wrap_u = Wrap::kClamp, .wrap_v = Wrap::kMirror, .nearest = true};
  full.metallic_roughness_texture = {.image = 1, .uv_set = 1};
  full.normal_texture = {.image = 2, .offset = vec2(0.25f, -0.5f), .scale = vec2(2, 3), .rotation = 0.7f};
  full.emissive_texture = {.image = 3, .uv_set = 1, .scale = vec2(1, -1)};
  s.materials = {plain, full};

  Mesh detailed = test_triangle("detailed", 1, 0.3f);
  detailed.normals.assign(3, vec3(0, 0, 1));
  detailed.tangents.assign(3, vec4(1, 0, 0, -1));
  detailed.uv0 = {vec2(0.1f, 0.2f), vec2(1.5f, -2), vec2(0.3f, 0.9f)};
  detailed.uv1 = {vec2(0), vec2(1, 0), vec2(0, 1)};
  detailed.colors = {vec4(1, 0, 0, 1), vec4(0.25f, 0.5f, 1, 0.5f), vec4(1)};
  s.meshes = {test_triangle("first", 0, 0), detailed, test_triangle("third", 0, 2)};

  PunctualLight point{.name = "bulb", .color = vec3(800, 600, 0.1f), .range = 12.5f};
  PunctualLight spot{
      .name = "spot", .type = LightType::kSpot, .color = vec3(3), .inner_cone = 0.2f, .outer_cone = 0.4f};
  PunctualLight sun{.name = "sun", .type = LightType::kDirectional, .color = vec3(0.3f, 0.29f, 0.2f)};
  s.lights = {point, spot, sun};
  s.cameras = {{"wide", 1.1f, 0.05f}, {"tele", 0.2f, 0.5f}};

  const auto node = [&](const std::string& name, int parent) -> Node& {
    s.nodes.push_back({});
    s.nodes.back().name = name;
    s.nodes.back().parent = parent;
    return s.nodes.back();
  };
  Node& root = node("root", -1);
  root.translation = vec3(1, 2, 3);
  root.rotation = glm::normalize(vec4(0.1f, 0.2f, -0.3f, 0.9f));
  root.scale = vec3(1, 2, -0.5f);
  root.meshes = {0};
  Node& both = node("both", 0);
  both.has_matrix = true;
  both.matrix = glm::translate(mat4(1), vec3(4, 5, 6)) * mat4(mat3(1, 2, 0, 0, 1, 0.5f, 0, 0, 3));
  both.meshes = {1, 2};
  node("again", 1).meshes = {0};
  node("lamp", 0).light = 0;
  node("lamp again", -1).light = 0;
  node("spot", -1).light = 1;
  Node& sun_node = node("sun and camera", -1);
  sun_node.light = 2;
  sun_node.camera = 1;
  node("eye", -1).camera = 0;

  const float half = std::sqrt(0.5f);
  Animation animation{"all", {}};
  animation.channels = {
      {3,
       AnimatedProperty::kTranslation,
       Interpolation::kLinear,
       {0, 0.5f, 2},
       {vec4(0), vec4(1, 2, 3, 0), vec4(4, 0, 0, 0)}},
      {4,
       AnimatedProperty::kRotation,
       Interpolation::kStep,
       {0.25f, 1},
       {vec4(0, 0, 0, 1), vec4(half, 0, 0, half)}},
      {5,
       AnimatedProperty::kScale,
       Interpolation::kCubicSpline,
       {0, 1},
       {vec4(0), vec4(1, 1, 1, 0), vec4(3, 2, 1, 0), vec4(0.5f, 0.5f, 0.5f, 0), vec4(2, 2, 2, 0), vec4(0)}},
  };
  s.animations = {animation};
  validate(s);
  EXPECT_TRUE(s.warnings.empty());
  return s;
}

Scene round_trip(const Scene& scene, const std::string& name = "scene.glb") {
  const TempFolder folder;
  export_gltf(scene, folder / name);
  return import_gltf(folder / name);
}

void expect_equal(const TextureUse& a, const TextureUse& b) {
  EXPECT_EQ(a.image, b.image);
  if (a.image < 0) return;
  EXPECT_EQ(a.uv_set, b.uv_set);
  EXPECT_EQ(a.wrap_u, b.wrap_u);
  EXPECT_EQ(a.wrap_v, b.wrap_v);
  EXPECT_EQ(a.nearest, b.nearest);
  EXPECT_EQ(a.offset, b.offset);
  EXPECT_EQ(a.scale, b.scale);
  EXPECT_EQ(a.rotation, b.rotation);
}

void expect_equal(const Material& a, const Material& b) {
  SCOPED_TRACE(a.name);
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.base_color, b.base_color);
  EXPECT_EQ(a.alpha, b.alpha);
  EXPECT_EQ(a.metallic, b.metallic);
  EXPECT_EQ(a.roughness, b.roughness);
  EXPECT_EQ(a.emission, b.emission);
  EXPECT_EQ(a.alpha_mode, b.alpha_mode);
  if (a.alpha_mode == AlphaMode::kMask) {
    EXPECT_EQ(a.alpha_cutoff, b.alpha_cutoff);
  }
  EXPECT_EQ(a.double_sided, b.double_sided);
  if (a.normal_texture.image >= 0) {
    EXPECT_EQ(a.normal_scale, b.normal_scale);
  }
  expect_equal(a.base_color_texture, b.base_color_texture);
  expect_equal(a.metallic_roughness_texture, b.metallic_roughness_texture);
  expect_equal(a.normal_texture, b.normal_texture);
  expect_equal(a.emissive_texture, b.emissive_texture);
}

void expect_equal(const Mesh& a, const Mesh& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.tangents, b.tangents);
  EXPECT_EQ(a.uv0, b.uv0);
  EXPECT_EQ(a.uv1, b.uv1);
  EXPECT_EQ(a.colors, b.colors);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.material, b.material);
}

void expect_equal(const Node& a, const Node& b) {
  SCOPED_TRACE(a.name);
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.parent, b.parent);
  EXPECT_EQ(a.translation, b.translation);
  EXPECT_EQ(a.rotation, b.rotation);
  EXPECT_EQ(a.scale, b.scale);
  EXPECT_EQ(a.has_matrix, b.has_matrix);
  EXPECT_EQ(a.matrix, b.matrix);
  EXPECT_EQ(a.meshes, b.meshes);
  EXPECT_EQ(a.light, b.light);
  EXPECT_EQ(a.camera, b.camera);
}

TEST(GltfExport, RoundTripKeepsEveryBit) {
  const Scene a = rich_scene();
  for (const char* name : {"scene.glb", "scene.gltf"}) {
    SCOPED_TRACE(name);
    const Scene b = round_trip(a, name);
    EXPECT_TRUE(b.warnings.empty());
    ASSERT_EQ(a.nodes.size(), b.nodes.size());
    for (std::size_t i = 0; i < a.nodes.size(); ++i) expect_equal(a.nodes[i], b.nodes[i]);
    ASSERT_EQ(a.meshes.size(), b.meshes.size());
    for (std::size_t i = 0; i < a.meshes.size(); ++i) expect_equal(a.meshes[i], b.meshes[i]);
    ASSERT_EQ(a.materials.size(), b.materials.size());
    for (std::size_t i = 0; i < a.materials.size(); ++i) expect_equal(a.materials[i], b.materials[i]);
    ASSERT_EQ(a.images.size(), b.images.size());
    for (std::size_t i = 0; i < a.images.size(); ++i) {
      EXPECT_EQ(a.images[i].width, b.images[i].width);
      EXPECT_EQ(a.images[i].srgb, b.images[i].srgb);
      EXPECT_EQ(a.images[i].texels8, b.images[i].texels8);
    }
    ASSERT_EQ(a.lights.size(), b.lights.size());
    for (std::size_t i = 0; i < a.lights.size(); ++i) {
      EXPECT_EQ(a.lights[i].name, b.lights[i].name);
      EXPECT_EQ(a.lights[i].type, b.lights[i].type);
      EXPECT_EQ(a.lights[i].color, b.lights[i].color);
      EXPECT_EQ(a.lights[i].range, b.lights[i].range);
    }
    EXPECT_EQ(a.lights[1].inner_cone, b.lights[1].inner_cone);
    EXPECT_EQ(a.lights[1].outer_cone, b.lights[1].outer_cone);
    ASSERT_EQ(a.cameras.size(), b.cameras.size());
    for (std::size_t i = 0; i < a.cameras.size(); ++i) {
      EXPECT_EQ(a.cameras[i].name, b.cameras[i].name);
      EXPECT_EQ(a.cameras[i].vertical_fov, b.cameras[i].vertical_fov);
      EXPECT_EQ(a.cameras[i].znear, b.cameras[i].znear);
    }
    ASSERT_EQ(b.animations.size(), 1u);
    ASSERT_EQ(b.animations[0].channels.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      const AnimationChannel &x = a.animations[0].channels[i], &y = b.animations[0].channels[i];
      EXPECT_EQ(x.node, y.node);
      EXPECT_EQ(x.property, y.property);
      EXPECT_EQ(x.interpolation, y.interpolation);
      EXPECT_EQ(x.times, y.times);
      EXPECT_EQ(x.values, y.values);
    }
  }
}

TEST(GltfExport, MeshSharedByTwoGroupsStaysOne) {
  Scene scene;
  scene.materials.resize(1);
  scene.meshes = {test_triangle("rod", 0, 0), test_triangle("brackets", 0, 1)};
  scene.nodes.resize(2);
  scene.nodes[0].meshes = {0};
  scene.nodes[1].meshes = {0, 1};
  const Scene back = round_trip(scene);
  EXPECT_EQ(back.meshes.size(), 2u);
  EXPECT_EQ(content_hash(back), content_hash(scene));
}

TEST(GltfExport, SameSceneGivesSameBytes) {
  const TempFolder folder;
  const Scene scene = rich_scene();
  export_gltf(scene, folder / "a.glb");
  export_gltf(scene, folder / "b.glb");
  EXPECT_EQ(read_text(folder / "a.glb"), read_text(folder / "b.glb"));
  EXPECT_EQ(folder.entries(), (std::vector<std::string>{"a.glb", "b.glb"}));
}

TEST(GltfExport, FileObeysTheSpecificationsCheapRules) {
  const TempFolder folder;
  export_gltf(rich_scene(), folder / "a.gltf");
  const nlohmann::json json = nlohmann::json::parse(read_text(folder / "a.gltf"));
  EXPECT_EQ(json["asset"]["version"], "2.0");
  for (const auto& [key, value] : json.items()) EXPECT_FALSE(value.is_array() && value.empty()) << key;
  for (const auto& material : json["materials"])
    for (const float factor : material.value("emissiveFactor", std::vector<float>{0})) {
      EXPECT_GE(factor, 0);
      EXPECT_LE(factor, 1);
    }
  for (const auto& view : json["bufferViews"]) EXPECT_EQ(view["byteOffset"].get<int>() % 4, 0);
  for (const auto& mesh : json["meshes"])
    for (const auto& primitive : mesh["primitives"]) {
      const auto& accessor = json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
      EXPECT_EQ(accessor["min"].size(), 3u);
      EXPECT_EQ(accessor["max"].size(), 3u);
    }
  const std::vector<std::string> extensions = json["extensionsUsed"];
  EXPECT_EQ(extensions, (std::vector<std::string>{"KHR_lights_punctual", "KHR_materials_emissive_strength",
                                                  "KHR_texture_transform"}));
}

TEST(GltfExport, EnvironmentSurvivesInExtrasWithAWarning) {
  Scene scene = rich_scene();
  Image8or32 sky{.name = "sky", .width = 2, .height = 1, .srgb = false, .texels8 = {}, .texels32 = {}};
  sky.texels32 = {0.1f, 2000, 3e-5f, 1, 4, 5, 6, 1};
  scene.environment = {vec3(0.5f, 1, 2), static_cast<int>(scene.images.size())};
  scene.images.push_back(sky);
  const TempFolder folder;
  const std::vector<std::string> warnings = export_gltf(scene, folder / "a.glb");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("environment"), std::string::npos);
  const Scene back = import_gltf(folder / "a.glb");
  EXPECT_EQ(back.environment.radiance, scene.environment.radiance);
  ASSERT_GE(back.environment.image, 0);
  EXPECT_EQ(back.images[static_cast<std::size_t>(back.environment.image)].texels32, sky.texels32);
}

TEST(GltfExport, FloatTexturesKeepTheirLight) {
  Scene scene = rich_scene();
  Image8or32 bright{.name = "bright", .width = 2, .height = 1, .srgb = false, .texels8 = {}, .texels32 = {}};
  bright.texels32 = {100, 0.25f, 3, 1, 0.5f, 60, 7, 1};
  scene.images[3] = bright;
  const TempFolder folder;
  const std::vector<std::string> warnings = export_gltf(scene, folder / "a.glb");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("16 bits"), std::string::npos);
  const Scene back = import_gltf(folder / "a.glb");
  const Image8or32& image = back.images[static_cast<std::size_t>(back.materials[1].emissive_texture.image)];
  for (std::size_t i = 0; i < 8; ++i) {
    if (i % 4 == 3) continue;
    const float before = scene.materials[1].emission[static_cast<int>(i % 4)] * bright.texels32[i];
    const float after = back.materials[1].emission[static_cast<int>(i % 4)] * image.texels32[i];
    EXPECT_NEAR(after / before, 1, 2e-3) << i;
  }
}

TEST(GltfExport, MeshWithoutTrianglesIsLeftOutWithAWarning) {
  Scene scene = rich_scene();
  scene.meshes[2].triangles.clear();
  const TempFolder folder;
  EXPECT_EQ(export_gltf(scene, folder / "a.glb").size(), 1u);
  EXPECT_EQ(import_gltf(folder / "a.glb").meshes.size(), 2u);
}

TEST(GltfExport, EmptySceneIsAValidFile) {
  EXPECT_TRUE(round_trip(Scene{}).nodes.empty());
  EXPECT_TRUE(round_trip(Scene{}, "scene.gltf").nodes.empty());
}

TEST(GltfExport, RefusesOtherExtensionsAndUnwritablePlaces) {
  const TempFolder folder;
  EXPECT_NE(error_of([&] { export_gltf(rich_scene(), folder / "a.obj"); }).find("a.obj"), std::string::npos);
  EXPECT_NE(error_of([&] { export_gltf(rich_scene(), folder / "no/a.glb"); }).find("a.glb"),
            std::string::npos);
  EXPECT_TRUE(folder.entries().empty());
}

// Everything that a picture depends on, compared in world space: reading back may renumber meshes and nodes.
void expect_same_picture(const Scene& a, const Scene& b, double seconds) {
  const SceneState x = evaluate(a, seconds), y = evaluate(b, seconds);
  ASSERT_EQ(x.instances.size(), y.instances.size());
  ASSERT_EQ(x.lights.size(), y.lights.size());
  ASSERT_EQ(x.cameras.size(), y.cameras.size());
  EXPECT_EQ(x.bounds.lo, y.bounds.lo);
  EXPECT_EQ(x.bounds.hi, y.bounds.hi);
  std::map<std::string, int> difference;  // node name, triangles, emission -> surplus
  const auto count = [&](const Scene& scene, const SceneState& state, int sign) {
    for (const MeshInstance& instance : state.instances) {
      const Mesh& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
      const Material& material = scene.materials[static_cast<std::size_t>(mesh.material)];
      difference[scene.nodes[static_cast<std::size_t>(instance.node)].name + "/" + material.name + "/" +
                 std::to_string(mesh.triangles.size()) + "/" + std::to_string(instance.to_world[3].x) + "/" +
                 std::to_string(material.emission.x)] += sign;
    }
    for (const LightInstance& light : state.lights)
      difference[light.light.name + std::to_string(light.position.x) + std::to_string(light.direction.y) +
                 std::to_string(light.light.color.x)] += sign;
  };
  count(a, x, 1);
  count(b, y, -1);
  for (const auto& [what, surplus] : difference) EXPECT_EQ(surplus, 0) << what;
}

TEST(GltfExport, BuiltinScenesSurvive) {
  for (const BuiltinScene& builtin : builtin_scenes()) {
    SCOPED_TRACE(builtin.name);
    const Scene scene = make_builtin_scene(builtin.name == "fireflies" ? "fireflies?n=3000" : builtin.name);
    const Scene once = round_trip(scene), twice = round_trip(once);
    expect_same_picture(scene, once, 0);
    expect_same_picture(scene, once, 0.7);
    EXPECT_EQ(once.cameras.size(), scene.cameras.size());
    EXPECT_EQ(content_hash(once), content_hash(scene));
    EXPECT_EQ(content_hash(once), content_hash(twice));
  }
}

}  // namespace
}  // namespace lumigrove
