#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "base/srgb.h"
#include "base/vec.h"
#include "scene/import.h"
#include "scene/texture.h"

namespace lumigrove {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

std::string base64(const std::string& bytes) { return OIIO::Strutil::base64_encode(bytes); }

template <class T>
std::string as_bytes(const std::vector<T>& values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

constexpr int kByte = 5120, kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;

// A glTF asset under construction: JSON and the bytes of its only buffer.
struct Asset {
  Json json = {{"asset", {{"version", "2.0"}}}};
  std::string bytes;

  int view(const std::string& data, int stride = 0) {
    bytes.resize((bytes.size() + 3) / 4 * 4);
    Json view = {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", data.size()}};
    if (stride > 0) view["byteStride"] = stride;
    bytes += data;
    return add("bufferViews", view);
  }
  int add(const char* array, const Json& element) {
    json[array].push_back(element);
    return static_cast<int>(json[array].size()) - 1;
  }
  template <class T>
  int accessor(const std::vector<T>& values, int component_type, const char* type, std::size_t count,
               const Json& more = Json::object()) {
    Json accessor = {{"bufferView", view(as_bytes(values))},
                     {"componentType", component_type},
                     {"type", type},
                     {"count", count}};
    accessor.update(more);
    return add("accessors", accessor);
  }
  int vec3s(const std::vector<float>& values) { return accessor(values, kFloat, "VEC3", values.size() / 3); }
  int scalars(const std::vector<float>& values) { return accessor(values, kFloat, "SCALAR", values.size()); }

  // A unit right triangle as mesh 0 and accessor 0.
  int triangle(const Json& more = Json::object()) {
    Json primitive = {{"attributes", {{"POSITION", vec3s({0, 0, 0, 1, 0, 0, 0, 1, 0})}}}};
    primitive.update(more);
    return add("meshes", {{"primitives", {primitive}}});
  }
  Json& primitive() { return json["meshes"][0]["primitives"][0]; }

  std::string gltf() const {
    Json all = json;
    if (!bytes.empty())
      all["buffers"] = {
          {{"byteLength", bytes.size()}, {"uri", "data:application/octet-stream;base64," + base64(bytes)}}};
    return all.dump();
  }
  std::string glb() const {
    Json all = json;
    all["buffers"] = {{{"byteLength", bytes.size()}}};
    std::string text = all.dump(), data = bytes;
    text.resize((text.size() + 3) / 4 * 4, ' ');
    data.resize((data.size() + 3) / 4 * 4);
    const auto u32 = [](std::size_t v) {
      return as_bytes(std::vector<std::uint32_t>{static_cast<std::uint32_t>(v)});
    };
    return "glTF" + u32(2) + u32(12 + 8 + text.size() + 8 + data.size()) + u32(text.size()) + "JSON" + text +
           u32(data.size()) + std::string("BIN\0", 4) + data;
  }
};

// PNG file in memory; `bits` 8 or 16.
std::string png(int width, int height, int channels, const std::vector<std::uint16_t>& values, int bits = 8) {
  std::vector<unsigned char> file;
  OIIO::Filesystem::IOVecOutput memory(file);
  OIIO::ImageSpec spec(width, height, channels, bits == 8 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16);
  spec["oiio:UnassociatedAlpha"] = 1;
  auto output = OIIO::ImageOutput::create("memory.png", &memory);
  EXPECT_TRUE(output && output->open("memory.png", spec));
  if (bits == 8) {
    const std::vector<std::uint8_t> narrow(values.begin(), values.end());
    EXPECT_TRUE(output->write_image(OIIO::TypeDesc::UINT8, narrow.data()));
  } else {
    EXPECT_TRUE(output->write_image(OIIO::TypeDesc::UINT16, values.data()));
  }
  output->close();
  return std::string(file.begin(), file.end());
}
std::string png_uri(const std::string& file) { return "data:image/png;base64," + base64(file); }

class Gltf : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "lumigrove_gltf_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    outer_ = name;
    folder_ = outer_ / "scene";
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(outer_); }

  void write(const fs::path& file, const std::string& content) {
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << content;
  }
  Scene load_text(const std::string& text, const char* name = "scene.gltf") {
    write(folder_ / name, text);
    return import_gltf(folder_ / name);
  }
  Scene load(const Asset& asset) { return load_text(asset.gltf()); }

  // The message of the error, which must name the file and be one line.
  std::string error_of(const std::string& text, const char* name = "scene.gltf") {
    try {
      load_text(text, name);
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(name), std::string::npos) << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      return message;
    }
    ADD_FAILURE() << "no error";
    return "";
  }
  std::string error_of(const Asset& asset) { return error_of(asset.gltf()); }

  fs::path outer_, folder_;
};

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}
int count_warnings(const Scene& scene, const std::string& part) {
  return static_cast<int>(std::count_if(scene.warnings.begin(), scene.warnings.end(),
                                        [&](const std::string& w) { return contains(w, part); }));
}
void expect_vector(vec3 a, vec3 b) {
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], 1e-5f) << "component " << k;
}

// One node that shows mesh 0.
Asset shown_triangle(const Json& primitive = Json::object()) {
  Asset asset;
  asset.triangle(primitive);
  asset.add("nodes", {{"mesh", 0}});
  return asset;
}

TEST_F(Gltf, ThreeNodesSharingOneLightGiveThreeLights) {
  Asset asset;
  asset.json["extensionsUsed"] = {"KHR_lights_punctual"};
  asset.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "point"}, {"color", {1, 0.5, 0.25}}, {"intensity", 8}, {"range", 20}, {"name", "lamp"}}};
  for (int i = 0; i < 3; ++i)
    asset.add("nodes", {{"translation", {i, 0, 0}},
                        {"scale", {3, 3, 3}},
                        {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  const Scene scene = load(asset);
  EXPECT_TRUE(scene.warnings.empty());
  const SceneState state = evaluate(scene, 0);
  ASSERT_EQ(state.lights.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    const LightInstance& light = state.lights[static_cast<std::size_t>(i)];
    expect_vector(light.position, vec3(i, 0, 0));
    expect_vector(light.light.color, vec3(8, 4, 2));
    EXPECT_EQ(light.light.range, 20);
  }
}

TEST_F(Gltf, SpotConesAndDirectionalLightsAreKept) {
  Asset asset;
  asset.json["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "spot"}, {"spot", {{"innerConeAngle", 0.25}, {"outerConeAngle", 0.5}}}},
      {{"type", "spot"}, {"spot", Json::object()}},
      {{"type", "directional"}, {"intensity", 3}}};
  for (int i = 0; i < 3; ++i) asset.add("nodes", {{"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
  asset.json["nodes"][2]["rotation"] = {-0.70710678, 0, 0, 0.70710678};  // -Z to -Y
  const SceneState state = evaluate(load(asset), 0);
  ASSERT_EQ(state.lights.size(), 3u);
  EXPECT_EQ(state.lights[0].light.type, LightType::kSpot);
  EXPECT_FLOAT_EQ(state.lights[0].light.inner_cone, 0.25f);
  EXPECT_FLOAT_EQ(state.lights[0].light.outer_cone, 0.5f);
  EXPECT_FLOAT_EQ(state.lights[1].light.inner_cone, 0.0f);
  EXPECT_FLOAT_EQ(state.lights[1].light.outer_cone, kPi / 4);
  EXPECT_EQ(state.lights[2].light.type, LightType::kDirectional);
  expect_vector(state.lights[2].light.color, vec3(3));
  expect_vector(state.lights[2].direction, vec3(0, -1, 0));
}

TEST_F(Gltf, EmissiveStrengthMultipliesTheFactor) {
  Asset asset = shown_triangle({{"material", 0}});
  asset.json["extensionsUsed"] = {"KHR_materials_emissive_strength"};
  asset.json["extensionsRequired"] = {"KHR_materials_emissive_strength"};
  asset.add("materials", {{"emissiveFactor", {1, 0.5, 0}},
                          {"doubleSided", true},
                          {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 40}}}}}});
  const Material material = load(asset).materials[0];
  expect_vector(material.emission, vec3(40, 20, 0));
  EXPECT_TRUE(material.double_sided);
}

TEST_F(Gltf, MaterialsAndTheirDefaultsFollowTheSpecification) {
  Asset asset = shown_triangle();
  asset.add(
      "materials",
      {{"pbrMetallicRoughness",
        {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0.5}, {"roughnessFactor", 0.25}}},
       {"alphaMode", "MASK"},
       {"alphaCutoff", 0.75},
       {"name", "m"}});
  const Scene scene = load(asset);
  ASSERT_EQ(scene.materials.size(), 2u);
  expect_vector(scene.materials[0].base_color, vec3(0.1f, 0.2f, 0.3f));
  EXPECT_FLOAT_EQ(scene.materials[0].alpha, 0.4f);
  EXPECT_FLOAT_EQ(scene.materials[0].metallic, 0.5f);
  EXPECT_FLOAT_EQ(scene.materials[0].roughness, 0.25f);
  EXPECT_EQ(scene.materials[0].alpha_mode, AlphaMode::kMask);
  EXPECT_FLOAT_EQ(scene.materials[0].alpha_cutoff, 0.75f);
  EXPECT_EQ(scene.meshes[0].material, 1);  // the primitive names none
  expect_vector(scene.materials[1].base_color, vec3(1));
  EXPECT_FLOAT_EQ(scene.materials[1].metallic, 1);
  EXPECT_FLOAT_EQ(scene.materials[1].roughness, 1);
}

TEST_F(Gltf, BlendIsCutOutWithOneWarning) {
  Asset asset = shown_triangle({{"material", 0}});
  for (int i = 0; i < 2; ++i) asset.add("materials", {{"alphaMode", "BLEND"}});
  const Scene scene = load(asset);
  EXPECT_EQ(scene.materials[1].alpha_mode, AlphaMode::kMask);
  EXPECT_EQ(count_warnings(scene, "BLEND"), 1);
  asset.json["materials"][0]["alphaMode"] = "GLASS";
  EXPECT_TRUE(contains(error_of(asset), "GLASS"));
}

TEST_F(Gltf, SharedMeshesAreInstancesAndMirroringIsKept) {
  Asset asset = shown_triangle();
  asset.add("nodes", {{"mesh", 0}, {"scale", {-1, 1, 1}}});
  asset.add("nodes", {{"mesh", 0}, {"matrix", {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 6, 7, 1}}});
  const Scene scene = load(asset);
  EXPECT_EQ(scene.meshes.size(), 1u);
  const SceneState state = evaluate(scene, 0);
  ASSERT_EQ(state.instances.size(), 3u);
  expect_vector(state.instances[1].to_world[0], vec3(-1, 0, 0));
  expect_vector(transform_point(state.instances[2].to_world, vec3(1, 0, 0)), vec3(7, 6, 7));
}

TEST_F(Gltf, OnlyTheDefaultSceneIsKept) {
  Asset asset = shown_triangle();
  asset.add("nodes", {{"children", {2}}, {"translation", {0, 5, 0}}});
  asset.add("nodes", {{"mesh", 0}});
  asset.json["scenes"] = {{{"nodes", {0}}}, {{"nodes", {1}}}};
  EXPECT_EQ(load(asset).nodes.size(), 1u);
  asset.json["scene"] = 1;
  const SceneState state = evaluate(load(asset), 0);
  ASSERT_EQ(state.instances.size(), 1u);
  expect_vector(state.instances[0].to_world[3], vec3(0, 5, 0));
  asset.json["scene"] = 2;
  EXPECT_TRUE(contains(error_of(asset), "scene 2"));
  asset.json.erase("scene");
  asset.json.erase("scenes");  // no scenes: all roots
  EXPECT_EQ(evaluate(load(asset), 0).instances.size(), 2u);
}

TEST_F(Gltf, NodesKeepTheOrderOfTheFile) {
  Asset asset = shown_triangle();
  asset.json["nodes"] = {
      {{"mesh", 0}, {"name", "child"}}, {{"name", "apart"}}, {{"name", "root"}, {"children", {0}}}};
  asset.json["scenes"] = {{{"nodes", {2}}}};
  const Scene scene = load(asset);
  ASSERT_EQ(scene.nodes.size(), 2u);
  EXPECT_EQ(scene.nodes[0].name, "child");
  EXPECT_EQ(scene.nodes[0].parent, 1);
  EXPECT_EQ(scene.nodes[1].name, "root");
  EXPECT_EQ(scene.nodes[1].parent, -1);
}

TEST_F(Gltf, CyclesAndSharedChildrenAreErrors) {
  Asset asset;
  asset.json["nodes"] = {{{"children", {1}}}, {{"children", {0}}}};
  EXPECT_TRUE(contains(error_of(asset), "child of another"));
  asset.json["scenes"] = {{{"nodes", {0}}}};
  EXPECT_TRUE(contains(error_of(asset), "appears twice"));
  asset.json["nodes"] = {{{"children", {2}}}, {{"children", {2}}}, Json::object()};
  asset.json["scenes"] = {{{"nodes", {0, 1}}}};
  EXPECT_TRUE(contains(error_of(asset), "appears twice"));
  asset.json["nodes"] = {{{"children", {17}}}};
  asset.json["scenes"] = {{{"nodes", {0}}}};
  EXPECT_TRUE(contains(error_of(asset), "node 17"));
}

TEST_F(Gltf, CamerasKeepTheirFieldOfViewAndName) {
  Asset asset;
  asset.json["cameras"] = {
      {{"type", "orthographic"}, {"orthographic", {{"xmag", 1}, {"ymag", 1}, {"zfar", 2}, {"znear", 1}}}},
      {{"type", "perspective"}, {"perspective", {{"yfov", 0.7}, {"znear", 0.2}}}}};
  asset.json["nodes"] = {{{"camera", 0}}, {{"camera", 1}, {"name", "hero"}, {"translation", {1, 2, 3}}}};
  const Scene scene = load(asset);
  EXPECT_EQ(count_warnings(scene, "orthographic"), 1);
  const SceneState state = evaluate(scene, 0);
  ASSERT_EQ(state.cameras.size(), 1u);
  EXPECT_EQ(state.cameras[0].camera.name, "hero");
  EXPECT_FLOAT_EQ(state.cameras[0].camera.vertical_fov, 0.7f);
  expect_vector(state.cameras[0].position, vec3(1, 2, 3));
  expect_vector(state.cameras[0].forward, vec3(0, 0, -1));
}

TEST_F(Gltf, AnimationsKeepTheirInterpolation) {
  Asset asset = shown_triangle();
  const int times = asset.scalars({0, 1});
  const int linear = asset.vec3s({0, 0, 0, 2, 0, 0});
  const int spline = asset.vec3s({0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0, 3, 3, 3, 0, 0, 0});
  // Normalized bytes: 90 degrees about z.
  const int turns = asset.accessor(std::vector<std::int8_t>{0, 0, 0, 127, 0, 0, 90, 90}, kByte, "VEC4", 2,
                                   {{"normalized", true}});
  asset.add("nodes", {{"mesh", 0}});
  asset.json["animations"] = {{{"samplers",
                                {{{"input", times}, {"output", linear}, {"interpolation", "STEP"}},
                                 {{"input", times}, {"output", spline}, {"interpolation", "CUBICSPLINE"}},
                                 {{"input", times}, {"output", turns}},
                                 {{"input", times}, {"output", linear}}}},
                               {"channels",
                                {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}},
                                 {{"sampler", 1}, {"target", {{"node", 0}, {"path", "scale"}}}},
                                 {{"sampler", 2}, {"target", {{"node", 1}, {"path", "rotation"}}}},
                                 {{"sampler", 3}, {"target", {{"node", 1}, {"path", "translation"}}}}}}}};
  const Scene scene = load(asset);
  EXPECT_EQ(duration(scene), 1.0);
  const SceneState half = evaluate(scene, 0.5);
  expect_vector(half.instances[0].to_world[3], vec3(0));        // STEP
  expect_vector(half.instances[0].to_world[0], vec3(2, 0, 0));  // CUBICSPLINE with flat tangents
  const float c = std::cos(kPi / 4);
  expect_vector(half.instances[1].to_world[0], vec3(c, c, 0));  // slerp
  expect_vector(half.instances[1].to_world[3], vec3(1, 0, 0));  // LINEAR
  expect_vector(evaluate(scene, 1).instances[0].to_world[3], vec3(2, 0, 0));
}

TEST_F(Gltf, ChannelsThatMoveNoNodeWarnAndLeaveTheOthers) {
  Asset asset = shown_triangle();
  const int times = asset.scalars({0, 1});
  const int values = asset.vec3s({0, 0, 0, 2, 0, 0});
  asset.json["extensionsUsed"] = {"KHR_animation_pointer"};
  asset.json["animations"] = {
      {{"samplers", {{{"input", times}, {"output", values}}}},
       {"channels",
        {{{"sampler", 0},
          {"target",
           {{"path", "pointer"},
            {"extensions", {{"KHR_animation_pointer", {{"pointer", "/nodes/0/scale"}}}}}}}},
         {{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}},
         {{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
  const Scene scene = load(asset);
  ASSERT_EQ(scene.animations.size(), 1u);
  ASSERT_EQ(scene.animations[0].channels.size(), 1u);
  EXPECT_EQ(scene.animations[0].channels[0].property, AnimatedProperty::kTranslation);
  EXPECT_EQ(count_warnings(scene, "KHR_animation_pointer"), 1);
  EXPECT_EQ(count_warnings(scene, "other than a node"), 1);
  EXPECT_EQ(count_warnings(scene, "morph targets"), 1);
}

TEST_F(Gltf, UnknownExtensionsWarnOnceAndRequiredOnesAreRefused) {
  Asset asset = shown_triangle();
  asset.json["extensionsUsed"] = {"KHR_materials_sheen", "KHR_materials_sheen", "KHR_lights_punctual"};
  const Scene scene = load(asset);
  EXPECT_EQ(scene.warnings.size(), 1u);
  EXPECT_EQ(count_warnings(scene, "KHR_materials_sheen"), 1);
  asset.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  EXPECT_TRUE(contains(error_of(asset), "KHR_draco_mesh_compression"));
}

TEST_F(Gltf, SkinsAndMorphTargetsWarnOnceAndKeepTheBaseShape) {
  Asset asset = shown_triangle();
  asset.primitive()["targets"] = {{{"POSITION", 0}}, {{"POSITION", 0}}};
  asset.add("skins", {{"joints", {0}}});
  asset.json["nodes"][0]["skin"] = 0;
  const Scene scene = load(asset);
  EXPECT_EQ(count_warnings(scene, "skins"), 1);
  EXPECT_EQ(count_warnings(scene, "morph"), 1);
  expect_vector(scene.meshes[0].positions[1], vec3(1, 0, 0));
}

TEST_F(Gltf, IndicesOfEveryWidthStripsAndFans) {
  const std::vector<float> square = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  Asset asset;
  const int positions = asset.vec3s(square);
  const int u8 = asset.accessor(std::vector<std::uint8_t>{0, 1, 3, 2}, kUnsignedByte, "SCALAR", 4);
  const int u16 = asset.accessor(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3}, kUnsignedShort, "SCALAR", 6);
  const int u32 = asset.accessor(std::vector<std::uint32_t>{0, 1, 2, 3}, kUnsignedInt, "SCALAR", 4);
  const Json attributes = {{"POSITION", positions}};
  asset.json["meshes"] = {{{"primitives",
                            {{{"attributes", attributes}, {"indices", u8}, {"mode", 5}},
                             {{"attributes", attributes}, {"indices", u16}},
                             {{"attributes", attributes}, {"indices", u32}, {"mode", 6}},
                             {{"attributes", attributes}, {"mode", 1}}}}}};
  asset.add("nodes", {{"mesh", 0}});
  const Scene scene = load(asset);
  ASSERT_EQ(scene.meshes.size(), 3u);
  EXPECT_EQ(scene.nodes[0].meshes.size(), 3u);
  EXPECT_EQ(count_warnings(scene, "points and lines"), 1);
  for (const Mesh& mesh : scene.meshes) {
    ASSERT_EQ(mesh.triangles.size(), 2u);
    float area = 0;
    for (const uvec3 t : mesh.triangles) {
      const vec3 n =
          glm::cross(mesh.positions[t.y] - mesh.positions[t.x], mesh.positions[t.z] - mesh.positions[t.x]);
      EXPECT_GT(n.z, 0);  // the winding survives
      area += n.z / 2;
    }
    EXPECT_FLOAT_EQ(area, 1);
  }
}

TEST_F(Gltf, StridedNormalizedAndSparseAttributes) {
  Asset asset;
  // Interleaved: position (3 floats), colour (4 normalized bytes).
  struct Vertex {
    float position[3];
    std::uint8_t color[4];
  };
  const std::vector<Vertex> vertices = {
      {{0, 0, 0}, {255, 0, 0, 255}}, {{1, 0, 0}, {0, 255, 0, 0}}, {{0, 1, 0}, {0, 0, 51, 255}}};
  const int view = asset.view(as_bytes(vertices), 16);
  const int positions = asset.add(
      "accessors", {{"bufferView", view}, {"componentType", kFloat}, {"type", "VEC3"}, {"count", 3}});
  const int colors = asset.add("accessors", {{"bufferView", view},
                                             {"byteOffset", 12},
                                             {"componentType", kUnsignedByte},
                                             {"normalized", true},
                                             {"type", "VEC4"},
                                             {"count", 3}});
  // Sparse without a base: zeros, but the third element is replaced.
  const int indices = asset.view(as_bytes(std::vector<std::uint16_t>{2})),
            values = asset.view(as_bytes(std::vector<float>{0.5f, 0.25f}));
  const int uvs =
      asset.add("accessors", {{"componentType", kFloat},
                              {"type", "VEC2"},
                              {"count", 3},
                              {"sparse",
                               {{"count", 1},
                                {"indices", {{"bufferView", indices}, {"componentType", kUnsignedShort}}},
                                {"values", {{"bufferView", values}}}}}});
  asset.add("meshes",
            {{"primitives",
              {{{"attributes", {{"POSITION", positions}, {"COLOR_0", colors}, {"TEXCOORD_0", uvs}}}}}}});
  asset.add("nodes", {{"mesh", 0}});
  const Mesh mesh = load(asset).meshes[0];
  expect_vector(mesh.positions[2], vec3(0, 1, 0));
  EXPECT_EQ(mesh.colors[1], vec4(0, 1, 0, 0));
  EXPECT_FLOAT_EQ(mesh.colors[2].z, 0.2f);
  EXPECT_EQ(mesh.uv0[1], vec2(0));
  EXPECT_EQ(mesh.uv0[2], vec2(0.5f, 0.25f));
}

TEST_F(Gltf, QuantizedPositionsAreReadAsTheyAre) {
  Asset asset;
  asset.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  const int positions =
      asset.add("accessors",
                {{"bufferView",
                  asset.view(as_bytes(std::vector<std::int8_t>{0, 0, 0, 0, 100, 0, 0, 0, 0, -50, 0, 0}), 4)},
                 {"componentType", kByte},
                 {"type", "VEC3"},
                 {"count", 3}});
  asset.add("meshes", {{"primitives", {{{"attributes", {{"POSITION", positions}}}}}}});
  asset.add("nodes", {{"mesh", 0}});
  const Mesh mesh = load(asset).meshes[0];
  expect_vector(mesh.positions[1], vec3(100, 0, 0));
  expect_vector(mesh.positions[2], vec3(0, -50, 0));
}

TEST_F(Gltf, TexturesKeepTexelsSamplersAndTransforms) {
  Asset asset = shown_triangle({{"material", 0}});
  asset.json["images"] = {
      {{"uri", png_uri(png(2, 1, 4, {10, 20, 30, 0, 200, 100, 50, 128}))}, {"name", "stripes"}}};
  asset.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
  asset.json["textures"] = {{{"source", 0}, {"sampler", 0}}, {{"source", 0}}};
  // The specification's own example: the lower left quadrant, turned by 90 degrees.
  const Json transform = {
      {"offset", {0, 1}}, {"rotation", 1.57079632679}, {"scale", {0.5, 0.5}}, {"texCoord", 1}};
  asset.add("materials",
            {{"pbrMetallicRoughness",
              {{"baseColorTexture", {{"index", 0}}}, {"metallicRoughnessTexture", {{"index", 1}}}}},
             {"normalTexture", {{"index", 1}, {"scale", 0.5}}},
             {"emissiveTexture", {{"index", 1}, {"extensions", {{"KHR_texture_transform", transform}}}}}});
  const Scene scene = load(asset);
  const Material& m = scene.materials[0];
  ASSERT_EQ(scene.images.size(), 2u);  // as colour and as data
  const Image8or32& color = scene.images[static_cast<std::size_t>(m.base_color_texture.image)];
  EXPECT_EQ(color.name, "stripes");
  EXPECT_TRUE(color.srgb);
  EXPECT_EQ(color.texels8,
            (std::vector<std::uint8_t>{10, 20, 30, 0, 200, 100, 50, 128}));  // alpha not multiplied in
  EXPECT_FALSE(scene.images[static_cast<std::size_t>(m.normal_texture.image)].srgb);
  EXPECT_EQ(m.emissive_texture.image, m.base_color_texture.image);
  EXPECT_EQ(m.base_color_texture.wrap_u, Wrap::kClamp);
  EXPECT_EQ(m.base_color_texture.wrap_v, Wrap::kMirror);
  EXPECT_TRUE(m.base_color_texture.nearest);
  EXPECT_EQ(m.normal_texture.wrap_u, Wrap::kRepeat);
  EXPECT_FLOAT_EQ(m.normal_scale, 0.5f);
  EXPECT_EQ(m.emissive_texture.uv_set, 1);
  const vec2 corner = transform_uv(m.emissive_texture, vec2(1, 1));
  EXPECT_NEAR(corner.x, 0.5f, 1e-6);
  EXPECT_NEAR(corner.y, 0.5f, 1e-6);
  EXPECT_NEAR(transform_uv(m.emissive_texture, vec2(1, 0)).y, 0.5f, 1e-6);
  EXPECT_NEAR(transform_uv(m.emissive_texture, vec2(1, 0)).x, 0.0f, 1e-6);
}

TEST_F(Gltf, SixteenBitGreyTexturesBecomeLinearFloats) {
  Asset asset = shown_triangle({{"material", 0}});
  asset.json["images"] = {{{"uri", png_uri(png(1, 2, 1, {0, 32768}, 16))}}};
  asset.json["textures"] = {{{"source", 0}}};
  asset.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  const Scene scene = load(asset);
  ASSERT_EQ(scene.images[0].texels32.size(), 8u);
  EXPECT_NEAR(scene.images[0].texels32[4], srgb_to_linear(32768 / 65535.0f), 1e-5);
  EXPECT_EQ(scene.images[0].texels32[4], scene.images[0].texels32[6]);
  EXPECT_EQ(scene.images[0].texels32[7], 1.0f);
}

// A textured triangle whose image lies at `uri`.
Asset textured(const std::string& uri) {
  Asset asset = shown_triangle({{"material", 0}});
  asset.json["images"] = {{{"uri", uri}}};
  asset.json["textures"] = {{{"source", 0}}};
  asset.add("materials", {{"emissiveTexture", {{"index", 0}}}});
  return asset;
}

TEST_F(Gltf, TexturesAreReadFromTheSceneFolderAndNowhereElse) {
  const std::string image = png(1, 1, 3, {1, 2, 3});
  write(folder_ / "tex" / "a +b.png", image);
  write(outer_ / "secret.png", image);
  fs::create_symlink(outer_ / "secret.png", folder_ / "link.png");
  EXPECT_EQ(load(textured("tex/a%20+b.png")).images[0].texels8[1], 2);
  EXPECT_EQ(load(textured("tex/../tex/a%20+b.png")).images[0].width, 1);
  for (const std::string& uri :
       {std::string("../secret.png"), std::string("%2e%2e/secret.png"), std::string("tex/../../secret.png"),
        std::string("..\\secret.png"), (outer_ / "secret.png").string(), std::string("link.png"),
        std::string("C:/secret.png")})
    EXPECT_TRUE(contains(error_of(textured(uri)), "leaves the scene's folder")) << uri;
  EXPECT_TRUE(contains(error_of(textured("gone.png")), "gone.png"));
  EXPECT_TRUE(contains(error_of(textured("tex")), "not a regular file"));
  EXPECT_TRUE(contains(error_of(textured("%zz.png")), "percent"));
}

TEST_F(Gltf, DamagedImagesAreRefused) {
  const std::string image = png(64, 64, 3, std::vector<std::uint16_t>(64 * 64 * 3, 77));
  ::testing::internal::CaptureStderr();
  EXPECT_TRUE(contains(error_of(textured(png_uri(image.substr(0, image.size() / 2)))), "cut short"));
  std::string flipped = image;
  flipped[flipped.size() / 2] ^= 0x55;
  EXPECT_TRUE(contains(error_of(textured(png_uri(flipped))), "checksum"));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  error_of(textured("data:image/png;base64,AAAA"));
  error_of(textured("data:image/png;base64,!!!!"));
  error_of(textured("data:image/png,plain"));
}

TEST_F(Gltf, BuffersOutsideTheFolderAreRefused) {
  Asset asset = shown_triangle();
  write(folder_ / "data.bin", asset.bytes + "padding");
  write(outer_ / "data.bin", asset.bytes);
  Json json = asset.json;
  json["buffers"] = {{{"byteLength", asset.bytes.size()}, {"uri", "data.bin"}}};
  EXPECT_EQ(load_text(json.dump()).meshes.size(), 1u);
  json["buffers"][0]["byteLength"] = asset.bytes.size() + 100;
  EXPECT_TRUE(contains(error_of(json.dump()), "buffer 0"));
  json["buffers"][0]["uri"] = "../data.bin";
  EXPECT_TRUE(contains(error_of(json.dump()), "leaves the scene's folder"));
}

TEST_F(Gltf, GlbLoadsAndEveryTruncationIsRefused) {
  Asset asset = textured("");
  asset.json["images"] = {{{"bufferView", asset.view(png(1, 1, 3, {9, 8, 7}))}, {"mimeType", "image/png"}}};
  const std::string glb = asset.glb();
  const Scene scene = load_text(glb, "scene.glb");
  EXPECT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(scene.images[0].texels8[0], 9);
  EXPECT_EQ(scene.name, (folder_ / "scene.glb").string());
  for (std::size_t length = 0; length < glb.size(); length += 7) error_of(glb.substr(0, length), "scene.glb");
}

// Each change alone must end in one sentence, never in a crash.
TEST_F(Gltf, MalformedAssetsAreRefused) {
  const std::vector<void (*)(Json&)> faults = {
      [](Json& j) { j["accessors"][0]["count"] = 4; },
      [](Json& j) { j["accessors"][0]["count"] = 1ull << 62; },
      [](Json& j) { j["accessors"][0]["byteOffset"] = 4; },
      [](Json& j) { j["accessors"][0]["byteOffset"] = ~0ull; },
      [](Json& j) { j["accessors"][0]["bufferView"] = 5; },
      [](Json& j) { j["accessors"][0]["type"] = "VEC2"; },
      [](Json& j) { j["accessors"][0]["componentType"] = 5130; },
      [](Json& j) { j["accessors"][0].erase("componentType"); },
      [](Json& j) {
        j["accessors"][0] = {{"componentType", kFloat}, {"type", "VEC3"}, {"count", 1ull << 40}};
      },
      [](Json& j) { j["bufferViews"][0]["byteLength"] = 1000; },
      [](Json& j) { j["bufferViews"][0]["byteOffset"] = ~0ull; },
      [](Json& j) { j["bufferViews"][0]["buffer"] = 1; },
      [](Json& j) { j["bufferViews"][0]["byteStride"] = 8; },
      [](Json& j) { j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = -3; },
      [](Json& j) { j["meshes"][0]["primitives"][0].erase("attributes"); },
      [](Json& j) { j["meshes"][0]["primitives"][0]["indices"] = 0; },
      [](Json& j) { j["meshes"][0]["primitives"][0]["mode"] = 9; },
      [](Json& j) { j["meshes"][0]["primitives"][0]["material"] = 3; },
      [](Json& j) { j["meshes"] = 7; },
      [](Json& j) {
        j["meshes"] = {1, 2};
      },
      [](Json& j) { j["nodes"][0]["mesh"] = 1; },
      [](Json& j) { j["nodes"][0]["camera"] = 0; },
      [](Json& j) { j["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0; },
      [](Json& j) {
        j["nodes"][0]["rotation"] = {0, 0, 0, 0};
      },
      [](Json& j) {
        j["nodes"][0]["translation"] = {1e39, 0, 0};
      },
      [](Json& j) { j["asset"]["version"] = "1.0"; },
      [](Json& j) { j["asset"]["minVersion"] = "2.1"; },
      [](Json& j) { j.erase("asset"); },
      [](Json& j) { j["buffers"][0].erase("uri"); },
      [](Json& j) { j["buffers"][0]["uri"] = 3; },
      [](Json& j) { j["extensionsRequired"] = {1}; },
      [](Json& j) { j["images"] = {Json::object()}; },
      [](Json& j) {
        j["animations"] = {{{"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}}}}};
      },
  };
  const Json good = Json::parse(shown_triangle().gltf());
  for (std::size_t i = 0; i < faults.size(); ++i) {
    SCOPED_TRACE(i);
    Json json = good;
    faults[i](json);
    error_of(json.dump());
  }
}

TEST_F(Gltf, WhatIsNoGltfIsRefused) {
  error_of("");
  error_of("{");
  error_of("[]");
  error_of("{\"asset\":{\"version\":\"2.0\"},\"x\":1e999}");
  EXPECT_TRUE(contains(error_of(std::string(100000, '[')), "deep"));
  EXPECT_THROW(import_gltf(folder_), Error);
  EXPECT_THROW(import_gltf(folder_ / "gone.glb"), Error);
}

TEST_F(Gltf, LoadSceneChoosesByNameAndExtension) {
  write(folder_ / "UPPER.GLB", shown_triangle().glb());
  EXPECT_EQ(load_scene((folder_ / "UPPER.GLB").string()).meshes.size(), 1u);
  EXPECT_EQ(load_scene("single").name, "single");
  try {
    load_scene("nowhere.glb");
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_TRUE(contains(error.what(), "'nowhere.glb'") && contains(error.what(), "night-city"))
        << error.what();
  }
}

TEST_F(Gltf, IndicesOutOfRangeAreRefusedAndNaNVerticesDropTheirTriangles) {
  Asset asset = shown_triangle();
  const int indices = asset.accessor(std::vector<std::uint8_t>{0, 1, 3}, kUnsignedByte, "SCALAR", 3);
  asset.primitive()["indices"] = indices;
  EXPECT_TRUE(contains(error_of(asset), "out of range"));
  Asset broken;
  broken.add("meshes",
             {{"primitives",
               {{{"attributes", {{"POSITION", broken.vec3s({0, 0, std::nanf(""), 1, 0, 0, 0, 1, 0})}}}}}}});
  broken.add("nodes", {{"mesh", 0}});
  const Scene scene = load(broken);
  EXPECT_TRUE(scene.meshes[0].triangles.empty());
  EXPECT_EQ(count_warnings(scene, "dropped"), 1);
}

}  // namespace
}  // namespace lumigrove
