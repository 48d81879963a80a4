// The pbrt-v4 files read back by a small parser of their structure. pbrt itself is not among Debian's
// packages, so that what the numbers mean to it rests on its documentation.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <map>
#include <sstream>

#include "base/vec.h"
#include "lumigrove/scene.h"
#include "scene/asset_files.h"
#include "scene/image_decode.h"
#include "scene/import.h"
#include "temp_folder.h"

namespace lumigrove {
namespace {

Mesh quad(const std::string& name, int material) {
  Mesh mesh;
  mesh.name = name;
  mesh.positions = {vec3(0, 0, 0), vec3(1, 0, 0), vec3(1, 1, 0), vec3(0, 1, 0)};
  mesh.triangles = {uvec3(0, 1, 2), uvec3(0, 2, 3)};
  mesh.material = material;
  return mesh;
}

int add_node(Scene& scene, const mat4& matrix) {
  Node node;
  node.has_matrix = true;
  node.matrix = matrix;
  scene.nodes.push_back(node);
  return static_cast<int>(scene.nodes.size()) - 1;
}
int add_mesh_node(Scene& scene, int mesh, const mat4& matrix = mat4(1)) {
  const int node = add_node(scene, matrix);
  scene.nodes.back().meshes = {mesh};
  return node;
}

// A floor shown three times, an emissive quad shown twice (once mirrored), a camera, one light of each kind.
Scene small_scene() {
  Scene s;
  s.name = "small";
  Material floor, lamp;
  floor.base_color = vec3(0.5f, 0.25f, 0.125f);
  lamp.base_color = vec3(0);
  lamp.emission = vec3(12, 6, 3);
  s.materials = {floor, lamp};
  s.meshes = {quad("floor", 0), quad("lamp", 1)};
  add_mesh_node(s, 0);
  add_mesh_node(s, 0, glm::translate(mat4(1), vec3(5, 0, 0)));
  add_mesh_node(s, 0, glm::scale(mat4(1), vec3(2, 3, 4)));
  add_mesh_node(s, 1, glm::translate(mat4(1), vec3(0, 0, 7)));
  add_mesh_node(s, 1, glm::scale(mat4(1), vec3(-1, 1, 1)));
  s.cameras = {{"eye", 1.0f, 0.01f}};
  add_node(s, glm::translate(mat4(1), vec3(1, 2, 10)));
  s.nodes.back().camera = 0;
  s.lights = {
      {.name = "p", .color = vec3(9, 8, 7)},
      {.name = "s", .type = LightType::kSpot, .color = vec3(5), .inner_cone = 0.1f, .outer_cone = 0.5f},
      {.name = "d", .type = LightType::kDirectional, .color = vec3(2)}};
  for (int light = 0; light < 3; ++light) {
    add_node(s, glm::translate(mat4(1), vec3(0, 3, 4)));
    s.nodes.back().light = light;
  }
  validate(s);
  return s;
}

struct PbrtFile {
  TempFolder folder;
  std::string text;
  std::vector<std::string> warnings;

  explicit PbrtFile(const Scene& scene, int width = 640, int height = 360, bool force_diffuse = false) {
    warnings = export_pbrt(scene, 0, scene.cameras.empty() ? -1 : 0, width, height, 16, folder / "s.pbrt",
                           force_diffuse);
    text = read_text(folder / "s.pbrt");
  }
  // Times that a line starts with this (after spaces).
  int count(const std::string& start) const {
    std::istringstream lines(text);
    int found = 0;
    for (std::string line; std::getline(lines, line);) {
      line.erase(0, line.find_first_not_of(' '));
      found += line.rfind(start, 0) == 0;
    }
    return found;
  }
  // What stands between quotes and is the name of a mesh or an image.
  std::vector<std::string> quoted_files() const {
    std::istringstream in(text);
    std::vector<std::string> names;
    for (std::string outside, name; std::getline(in, outside, '"') && std::getline(in, name, '"');)
      if (name.ends_with(".ply") || name.ends_with(".png") || name.ends_with(".exr")) names.push_back(name);
    return names;
  }
  // The numbers in the brackets, or up to the end of the line, after the first occurrence of `key`.
  std::vector<float> numbers_after(const std::string& key) const {
    const std::size_t at = text.find(key);
    EXPECT_NE(at, std::string::npos) << key;
    if (at == std::string::npos) return {};
    std::string rest = text.substr(at + key.size(), text.find('\n', at) - at - key.size());
    if (const std::size_t open = rest.find('['); open != std::string::npos)
      rest = rest.substr(open + 1, rest.find(']') - open - 1);
    std::istringstream in(rest);
    std::vector<float> numbers;
    for (float x; in >> x;) numbers.push_back(x);
    return numbers;
  }
};

TEST(PbrtExport, CountsShapesInstancesAndLights) {
  const PbrtFile file(small_scene());
  EXPECT_EQ(file.count("ObjectBegin"), 1);  // the floor, which is shared
  EXPECT_EQ(file.count("ObjectInstance"), 3);
  EXPECT_EQ(file.count("AreaLightSource"), 2);  // one for each showing of the lamp
  EXPECT_EQ(file.count("Shape"), 3);
  EXPECT_EQ(file.count("LightSource \"point\""), 1);
  EXPECT_EQ(file.count("LightSource \"spot\""), 1);
  EXPECT_EQ(file.count("LightSource \"distant\""), 1);
  EXPECT_EQ(file.count("MakeNamedMaterial"), 2);
  EXPECT_EQ(file.count("WorldBegin"), 1);
  EXPECT_EQ(file.count("AttributeBegin"), file.count("AttributeEnd"));
}

TEST(PbrtExport, LightNumbersAreOurs) {
  const PbrtFile file(small_scene());
  EXPECT_EQ(file.numbers_after("\"point\" \"rgb I\""), (std::vector<float>{9, 8, 7}));
  EXPECT_EQ(file.numbers_after("\"distant\" \"rgb L\""), (std::vector<float>{2, 2, 2}));
  EXPECT_EQ(file.numbers_after("AreaLightSource \"diffuse\" \"rgb L\""), (std::vector<float>{12, 6, 3}));
  EXPECT_NEAR(file.numbers_after("\"float coneangle\"").at(0), 0.5f * 180 / kPi, 1e-4);
  EXPECT_NEAR(file.numbers_after("\"float conedeltaangle\"").at(0), 0.4f * 180 / kPi, 1e-4);
  EXPECT_NE(file.text.find("\"point3 from\" [ 0 3 4 ] \"point3 to\" [ 0 3 3 ]"), std::string::npos);  // -Z
}

TEST(PbrtExport, CameraLooksWhereOursDoes) {
  const PbrtFile file(small_scene());
  EXPECT_LT(file.text.find("Scale -1 1 1"), file.text.find("LookAt"));
  EXPECT_EQ(file.numbers_after("LookAt "), (std::vector<float>{1, 2, 10, 1, 2, 9, 0, 1, 0}));
}

TEST(PbrtExport, FieldOfViewIsThatOfTheShorterSide) {
  const float vertical = 1.0f;
  EXPECT_NEAR(PbrtFile(small_scene(), 640, 360).numbers_after("\"float fov\"").at(0), vertical * 180 / kPi,
              1e-4);
  const float portrait = PbrtFile(small_scene(), 300, 600).numbers_after("\"float fov\"").at(0);
  EXPECT_NEAR(std::tan(0.5f * portrait * kPi / 180), 0.5f * std::tan(0.5f * vertical), 1e-5);
}

TEST(PbrtExport, FilmKeepsSizeAndSamples) {
  const PbrtFile file(small_scene(), 123, 45);
  EXPECT_EQ(file.numbers_after("\"integer xresolution\""), std::vector<float>{123});
  EXPECT_EQ(file.numbers_after("\"integer yresolution\""), std::vector<float>{45});
  EXPECT_EQ(file.numbers_after("\"integer pixelsamples\""), std::vector<float>{16});
}

TEST(PbrtExport, InstanceMatrixListsColumns) {
  const PbrtFile file(small_scene());
  EXPECT_NE(file.text.find("ConcatTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 5 0 0 1 ]"), std::string::npos);
  EXPECT_NE(file.text.find("ConcatTransform [ 2 0 0 0 0 3 0 0 0 0 4 0 0 0 0 1 ]"), std::string::npos);
}

// Area and emitting side of every emissive triangle, computed here from the PLY files.
TEST(PbrtExport, EmissiveInstancesKeepPlaceAndSideUnderMirroring) {
  const PbrtFile file(small_scene());
  int found = 0;
  for (const auto& entry : std::filesystem::directory_iterator(file.folder / "s_files")) {
    if (entry.path().filename().string().rfind("emitter", 0) != 0) continue;
    ++found;
    const Scene ply = import_assimp(entry.path());
    ASSERT_EQ(ply.meshes.at(0).triangles.size(), 2u);
    for (const uvec3 t : ply.meshes[0].triangles) {
      const std::vector<vec3>& p = ply.meshes[0].positions;
      const vec3 n = 0.5f * glm::cross(p[t.y] - p[t.x], p[t.z] - p[t.x]);
      EXPECT_NEAR(n.z, 0.5f, 1e-6);  // both shine along +Z
    }
  }
  EXPECT_EQ(found, 2);
}

TEST(PbrtExport, NormalsThatDisagreeWithTheWindingDoNotTurnAnEmitter) {
  Scene scene = small_scene();
  scene.meshes[1].normals.assign(4, vec3(0, 0, -1));
  const PbrtFile file(scene);
  for (const auto& entry : std::filesystem::directory_iterator(file.folder / "s_files"))
    if (entry.path().filename().string().rfind("emitter", 0) == 0) {
      EXPECT_EQ(read_text(entry.path()).find("property float nx"), std::string::npos);
    }
}

TEST(PbrtExport, TexturesAlphaAndTextureCoordinatesFollow) {
  Scene scene = small_scene();
  Image8or32 image{.name = "leaf", .width = 2, .height = 1, .srgb = true, .texels8 = {}, .texels32 = {}};
  image.texels8 = {10, 20, 30, 0, 200, 150, 100, 255};
  scene.images = {image};
  scene.materials[0].base_color = vec3(1);
  scene.materials[0].alpha_mode = AlphaMode::kMask;
  scene.materials[0].base_color_texture = {.image = 0, .offset = vec2(0.5f, 0)};
  scene.meshes[0].uv0 = {vec2(0, 0), vec2(1, 0), vec2(1, 0.25f), vec2(0, 1)};
  const PbrtFile file(scene);
  EXPECT_EQ(file.count("Texture \"color0\" \"spectrum\" \"imagemap\""), 1);
  EXPECT_EQ(file.count("Texture \"alpha0\" \"float\" \"imagemap\""), 1);
  EXPECT_NE(file.text.find("\"texture alpha\" \"alpha0\""), std::string::npos);
  const auto decode = [&](const char* name, bool srgb) {
    return decode_image(read_file(file.folder / ("s_files/" + std::string(name))), name, srgb);
  };
  EXPECT_EQ(decode("color0.png", true).texels8, image.texels8);
  EXPECT_EQ(decode("alpha0.png", false).texels8,
            (std::vector<std::uint8_t>{0, 0, 0, 255, 255, 255, 255, 255}));
  const Scene ply = import_assimp(file.folder / "s_files/mesh0.ply");  // flips v once more
  ASSERT_EQ(ply.meshes.at(0).uv0.size(), 4u);
  EXPECT_EQ(ply.meshes[0].uv0[2], vec2(1.5f, 0.25f));
}

TEST(PbrtExport, ForceDiffuseWritesOnlyDiffuseMaterials) {
  Scene scene = small_scene();
  scene.materials[0].metallic = 1;
  scene.materials[0].roughness = 0.1f;
  const PbrtFile glossy(scene), diffuse(scene, 640, 360, true);
  EXPECT_NE(glossy.text.find("\"conductor\""), std::string::npos);
  EXPECT_EQ(glossy.warnings.size(), 1u);
  EXPECT_EQ(diffuse.text.find("\"conductor\""), std::string::npos);
  EXPECT_EQ(diffuse.count("# approximate"), 1);  // the spot light
  EXPECT_TRUE(diffuse.warnings.empty());
}

// The equal-area image must hold the light of the equirectangular one: a sky that is bright above and one
// direction.
TEST(PbrtExport, EnvironmentImageKeepsDirections) {
  Scene scene = small_scene();
  Image8or32 sky{.name = "sky", .width = 64, .height = 32, .srgb = false, .texels8 = {}, .texels32 = {}};
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 64; ++x) {
      const bool right = x >= 32;  // column centre is -Z, u grows towards +X
      sky.texels32.insert(sky.texels32.end(), {y < 16 ? 3.0f : 0.0f, right ? 1.0f : 0.0f, 0.5f, 1});
    }
  scene.images = {sky};
  scene.environment = {vec3(2), 0};
  const PbrtFile file(scene);
  EXPECT_EQ(file.count("LightSource \"infinite\" \"string filename\" \"s_files/environment.exr\""), 1);
  const Image8or32 square =
      decode_image(read_file(file.folder / "s_files/environment.exr"), "environment.exr", false);
  ASSERT_EQ(square.width, square.height);
  vec3 mean(0);
  for (std::size_t i = 0; i < square.texels32.size(); i += 4)
    mean += vec3(square.texels32[i], square.texels32[i + 1], square.texels32[i + 2]);
  mean /= static_cast<float>(square.texels32.size() / 4);
  EXPECT_NEAR(mean.x, 3.0f, 0.02f);  // equal areas: the mean is that over the sphere, here half of 2 * 3
  EXPECT_NEAR(mean.y, 1.0f, 0.02f);
  EXPECT_NEAR(mean.z, 1.0f, 1e-4);
  // pbrt's square: (u,v) = (1, 1/2) is +X, (1/2, 1) is +Y, the centre +Z.
  const auto at = [&](float u, float v) {
    const int x = static_cast<int>(u * static_cast<float>(square.width)),
              y = static_cast<int>(v * static_cast<float>(square.height));
    return &square.texels32[4 * static_cast<std::size_t>(y * square.width + x)];
  };
  EXPECT_NEAR(at(0.80f, 0.70f)[0], 6, 1e-4);  // +X and +Y: above, right
  EXPECT_NEAR(at(0.80f, 0.70f)[1], 2, 1e-4);
  EXPECT_NEAR(at(0.20f, 0.30f)[0], 0, 1e-4);  // -X and -Y: below, left
  EXPECT_NEAR(at(0.20f, 0.30f)[1], 0, 1e-4);
}

TEST(PbrtExport, BuiltinScenesAreComplete) {
  for (const char* name : {"cornell-lights", "single", "fireflies?n=2000"}) {
    SCOPED_TRACE(name);
    const Scene scene = make_builtin_scene(name);
    const PbrtFile file(scene);
    const SceneState state = evaluate(scene, 0);
    int emissive = 0;
    for (const MeshInstance& i : state.instances) {
      const Mesh& mesh = scene.meshes[static_cast<std::size_t>(i.mesh)];
      emissive += max_component(scene.materials[static_cast<std::size_t>(mesh.material)].emission) > 0;
    }
    EXPECT_EQ(file.count("AreaLightSource"), emissive);
    EXPECT_EQ(file.count("LightSource"), static_cast<int>(state.lights.size()));
    for (const std::string& quoted : file.quoted_files())
      if (quoted != "s.exr") {
        EXPECT_TRUE(std::filesystem::exists(file.folder / quoted)) << quoted;
      }
  }
}

TEST(PbrtExport, RefusesBadArgumentsAndLeavesNothing) {
  const TempFolder folder;
  const Scene scene = small_scene();
  error_of([&] { export_pbrt(scene, 0, 0, 64, 64, 1, folder / "a.txt"); });
  error_of([&] { export_pbrt(scene, 0, 0, 0, 64, 1, folder / "a.pbrt"); });
  error_of([&] { export_pbrt(scene, 0, 3, 64, 64, 1, folder / "a.pbrt"); });
  error_of([&] { export_pbrt(scene, 0, 0, 64, 64, 1, folder / "no/a.pbrt"); });
  std::filesystem::create_directories(folder / "taken.pbrt/x");
  error_of([&] { export_pbrt(scene, 0, 0, 64, 64, 1, folder / "taken.pbrt"); });
  EXPECT_EQ(folder.entries(), std::vector<std::string>{"taken.pbrt"});
}

}  // namespace
}  // namespace lumigrove
