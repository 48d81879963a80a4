// Hostile and damaged scene files: every one loads or is refused with an Error; none crashes, hangs or reads
// elsewhere. Mutations are drawn from fixed seeds, so that a failure repeats.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <cstring>
#include <random>

#include "lumigrove/scene.h"
#include "temp_folder.h"

namespace lumigrove {
namespace {

// A textured, lit, animated asset of a few kilobytes.
Scene small_asset() {
  Scene s;
  s.images.push_back({.name = "texture",
                      .width = 2,
                      .height = 2,
                      .srgb = true,
                      .texels8 = {1, 2, 3, 255, 4, 5, 6, 255, 7, 8, 9, 255, 10, 11, 12, 255},
                      .texels32 = {}});
  s.materials.resize(1);
  s.materials[0].emission = vec3(3);
  s.materials[0].base_color_texture.image = 0;
  Mesh mesh;
  mesh.positions = {vec3(0), vec3(1, 0, 0), vec3(0, 1, 0), vec3(1, 1, 0)};
  mesh.normals.assign(4, vec3(0, 0, 1));
  mesh.uv0.assign(4, vec2(0.5f));
  mesh.triangles = {uvec3(0, 1, 2), uvec3(2, 1, 3)};
  s.meshes.push_back(mesh);
  s.lights.resize(1);
  s.cameras.resize(1);
  s.nodes.resize(3);
  s.nodes[0].meshes = {0};
  s.nodes[1].parent = 0;
  s.nodes[1].light = 0;
  s.nodes[2].camera = 0;
  s.animations.push_back(
      {"a",
       {{1, AnimatedProperty::kTranslation, Interpolation::kLinear, {0, 1}, {vec4(0), vec4(1, 2, 3, 0)}}}});
  validate(s);
  return s;
}

std::string exported_bytes(const std::string& name) {
  const TempFolder folder;
  export_gltf(small_asset(), folder / name);
  return read_text(folder / name);
}

// True when the file loads; then it must also be usable. False when it is refused in one sentence.
bool loads(const std::filesystem::path& file) {
  try {
    const Scene scene = load_scene(file.string());
    const SceneState state = evaluate(scene, 0.5);
    EXPECT_TRUE(std::isfinite(state.diagonal) && state.diagonal > 0);
    return true;
  } catch (const Error& error) {
    const std::string sentence = error.what();
    EXPECT_NE(sentence.find(file.filename().string()), std::string::npos) << sentence;
    EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
  } catch (const std::exception& error) {
    ADD_FAILURE() << "threw something other than Error: " << error.what();
  }
  return false;
}

// Replaces one to eight bytes; `text` draws the new ones from characters that parsers care about. Random numbers are the
// standard library's: those of base/rng.h, unoptimised here, would be linked into the built-in scenes too.
std::string mutate(std::string bytes, std::uint32_t seed, bool text) {
  static constexpr char kTelling[] = "0123456789-.eE+/ \n\"{}[],:#";
  std::mt19937 random(seed);
  const std::size_t count = 1 + random() % 8;
  for (std::size_t i = 0; i < count; ++i) {
    char& byte = bytes[random() % bytes.size()];
    byte = text ? kTelling[random() % (sizeof(kTelling) - 1)] : static_cast<char>(random() & 0xff);
  }
  return bytes;
}

int loaded_mutations(const std::string& original, const std::string& name, int count, bool text) {
  const TempFolder folder;
  int loaded = 0;
  for (int i = 0; i < count; ++i) {
    SCOPED_TRACE(i);
    loaded += loads(folder.write(name, mutate(original, static_cast<std::uint32_t>(i), text)));
  }
  return loaded;
}

constexpr const char* kObj =
    "mtllib a.mtl\no thing\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nusemtl "
    "m\n"
    "f 1/1/1 2/2/1 3/3/1\nf 2/2/1 4/1/1 3/3/1\n";
constexpr const char* kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 3 2\n";

TEST(Fuzz, UnchangedFilesLoad) {
  const TempFolder folder;
  EXPECT_TRUE(loads(folder.write("a.glb", exported_bytes("a.glb"))));
  EXPECT_TRUE(loads(folder.write("a.gltf", exported_bytes("a.gltf"))));
  EXPECT_TRUE(loads(folder.write("a.obj", kObj)));
  EXPECT_TRUE(loads(folder.write("a.ply", kPly)));
}

TEST(Fuzz, EveryTruncationOfAGlbIsRefused) {
  const TempFolder folder;
  const std::string glb = exported_bytes("a.glb");
  for (std::size_t size = 0; size < glb.size(); size += 5) {
    SCOPED_TRACE(size);
    EXPECT_FALSE(loads(folder.write("a.glb", glb.substr(0, size))));
  }
  EXPECT_FALSE(loads(folder.write("a.glb", glb.substr(0, glb.size() - 1))));
}

TEST(Fuzz, EveryTruncationOfAGltfIsRefused) {
  const TempFolder folder;
  std::string gltf = exported_bytes("a.gltf");
  for (std::size_t size = 0; size + 2 < gltf.size(); size += 11) {
    SCOPED_TRACE(size);
    EXPECT_FALSE(loads(folder.write("a.gltf", gltf.substr(0, size))));
  }
}

TEST(Fuzz, DamagedGlbLoadsOrIsRefused) {
  const int loaded = loaded_mutations(exported_bytes("a.glb"), "a.glb", 600, false);
  EXPECT_GT(loaded, 0);
  EXPECT_LT(loaded, 600);
}

TEST(Fuzz, DamagedGltfJsonLoadsOrIsRefused) {
  const int loaded = loaded_mutations(exported_bytes("a.gltf"), "a.gltf", 600, true);
  EXPECT_GT(loaded, 0);
  EXPECT_LT(loaded, 600);
}

TEST(Fuzz, DamagedObjAndPlyLoadOrAreRefused) {
  EXPECT_GT(loaded_mutations(kObj, "a.obj", 40, true), 0);
  loaded_mutations(kObj, "a.obj", 20, false);
  EXPECT_GT(loaded_mutations(kPly, "a.ply", 40, true), 0);
}

TEST(Fuzz, DamagedFbxLoadsOrIsRefused) {
  const std::string file = "/usr/share/assimp/models/FBX/box.fbx";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "package assimp-testmodels is not installed";
  loaded_mutations(read_text(file), "a.fbx", 30, false);
}

TEST(Fuzz, EmptyFilesFoldersAndPipesAreRefused) {
  const TempFolder folder;
  for (const char* name : {"a.glb", "a.gltf", "a.obj", "a.ply", "a.fbx"}) {
    SCOPED_TRACE(name);
    EXPECT_FALSE(loads(folder.write(name, "")));
    EXPECT_FALSE(loads(folder.write(std::string("b") + name, std::string(1, '\0'))));
    const std::filesystem::path as_folder = folder / ("folder_" + std::string(name));
    std::filesystem::create_directories(as_folder);
    EXPECT_FALSE(loads(as_folder));
    const std::filesystem::path pipe = folder / ("pipe_" + std::string(name));
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_FALSE(loads(pipe));  // must not wait for a writer
  }
}

// The .glb of the asset with `count` floats at the start of its positions replaced.
std::string with_positions(float value, int count) {
  std::string glb = exported_bytes("a.glb");
  const float corner[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};  // positions as they lie in the buffer
  const std::string pattern(reinterpret_cast<const char*>(corner), sizeof(corner));
  const std::size_t at = glb.find(pattern);
  EXPECT_NE(at, std::string::npos);
  for (int i = 0; i < count; ++i) std::memcpy(&glb[at + 4 * static_cast<std::size_t>(i)], &value, 4);
  return glb;
}

TEST(Fuzz, VerticesThatAreNotFiniteLoseTheirTrianglesOnly) {
  const TempFolder folder;
  for (const float value : {std::nanf(""), kInfinity, -kInfinity}) {
    const Scene scene = load_scene(folder.write("a.glb", with_positions(value, 1)).string());
    EXPECT_EQ(scene.meshes.at(0).triangles.size(), 1u);  // the one that does not use vertex 0
    EXPECT_EQ(scene.warnings.size(), 1u);
    EXPECT_TRUE(std::isfinite(evaluate(scene, 0).diagonal));
  }
}

TEST(Fuzz, SceneOfNothingButDamagedTrianglesLoadsEmpty) {
  const TempFolder folder;
  const Scene scene = load_scene(folder.write("a.glb", with_positions(std::nanf(""), 12)).string());
  EXPECT_TRUE(scene.meshes.at(0).triangles.empty());
  EXPECT_EQ(evaluate(scene, 0).diagonal, 1.0f);
}

TEST(Fuzz, ObjWithNanAndZeroAreaEmissiveTrianglesLoads) {
  const TempFolder folder;
  folder.write("a.mtl", "newmtl m\nKe 5 5 5\n");
  const Scene scene = load_scene(folder
                                     .write("a.obj",
                                            "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf "
                                            "1 2 3\nf 1 1 1\nf 1 2 2\nf 1 2 4\n")
                                     .string());
  std::size_t triangles = 0;
  for (const Mesh& mesh : scene.meshes) triangles += mesh.triangles.size();
  EXPECT_EQ(triangles, 1u);
  EXPECT_FALSE(scene.warnings.empty());
}

TEST(Fuzz, NegativeAndNanEmissionIsRepairedOrRefused) {
  const TempFolder folder;
  for (const char* emission : {"-1 2 3", "nan 1 1", "1e39 1 1", "inf 0 0"}) {
    SCOPED_TRACE(emission);
    folder.write("a.mtl", std::string("newmtl m\nKe ") + emission + "\n");
    const auto file = folder.write("a.obj", "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    if (!loads(file)) continue;
    for (const Material& m : load_scene(file.string()).materials)
      for (int c = 0; c < 3; ++c) EXPECT_TRUE(m.emission[c] >= 0 && m.emission[c] < kInfinity);
  }
}

TEST(Fuzz, AbsurdCountsAreRefusedWithoutAllocatingThem) {
  const TempFolder folder;
  EXPECT_FALSE(loads(folder.write("a.gltf",
                                  R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4000000000000}],
          "bufferViews":[{"buffer":0,"byteLength":4000000000000}],
          "accessors":[{"bufferView":0,"componentType":5126,"count":300000000000,"type":"VEC3"}],
          "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],
          "scenes":[{"nodes":[0]}]})")));
  EXPECT_FALSE(
      loads(folder.write("a.ply",
                         "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float "
                         "x\nproperty float y\nproperty float z\nend_header\n")));
}

}  // namespace
}  // namespace lumigrove
