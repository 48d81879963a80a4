// Every file of Debian's assimp-testmodels, sound and damaged, through the same door as a user's scene: it
// loads or is refused in one sentence that names it. A crash of the parser counts as a failure although users
// would see a sentence.
#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "lumigrove/scene.h"
#include "temp_folder.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

constexpr const char* kModels = "/usr/share/assimp/models";

std::vector<fs::path> model_files() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(kModels))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

void expect_one_sentence(const fs::path& file, const std::string& sentence) {
#if defined(__SANITIZE_ADDRESS__)
  // The header asks for more memory than there is: std::bad_alloc to Assimp, but the end to AddressSanitizer.
  if (file.filename() == "OutOfMemory.off") return;
#endif
  EXPECT_NE(sentence.find(file.filename().string()), std::string::npos) << sentence;
  EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
  EXPECT_EQ(sentence.find("crashed"), std::string::npos) << sentence;
  EXPECT_EQ(sentence.find("did not come to an end"), std::string::npos) << sentence;
}

TEST(AssimpModels, EveryFileLoadsOrIsRefusedInOneSentence) {
  if (!fs::exists(kModels)) GTEST_SKIP() << "package assimp-testmodels is not installed";
  std::map<std::string, std::pair<int, int>> counts;  // extension -> loaded, refused
  for (const fs::path& file : model_files()) {
    auto& [loaded, refused] = counts[file.extension().string()];
    try {
      Scene scene = load_scene(file.string());
      const SceneState state = evaluate(scene, 0);
      EXPECT_TRUE(!state.instances.empty() || !state.lights.empty() || scene.meshes.empty()) << file;
      ++loaded;
    } catch (const Error& error) {
      expect_one_sentence(file, error.what());
      ++refused;
    } catch (const std::exception& error) {
      ADD_FAILURE() << file << ": threw something other than Error: " << error.what();
    }
  }
  for (const char* extension : {".obj", ".ply", ".fbx", ".stl", ".dae", ".3ds", ".gltf", ".glb"})
    EXPECT_GT(counts[extension].first, 0) << extension;
}

// The common formats, file by file: these are sound and all that they refer to is there. The spider has 1368
// triangles, 56 of them without an area.
TEST(AssimpModels, SoundFilesLoad) {
  if (!fs::exists(kModels)) GTEST_SKIP() << "package assimp-testmodels is not installed";
  const std::map<std::string, std::size_t> triangles = {
      {"OBJ/box.obj", 12},     {"OBJ/cube_usemtl.obj", 12}, {"OBJ/spider.obj", 1368 - 56},
      {"PLY/cube.ply", 12},    {"PLY/cube_binary.ply", 12}, {"FBX/box.fbx", 12},
      {"STL/triangle.stl", 1},
  };
  for (const auto& [name, expected] : triangles) {
    SCOPED_TRACE(name);
    const Scene scene = load_scene((fs::path(kModels) / name).string());
    std::size_t count = 0;
    for (const MeshInstance& instance : evaluate(scene, 0).instances)
      count += scene.meshes[static_cast<std::size_t>(instance.mesh)].triangles.size();
    EXPECT_EQ(count, expected);
  }
}

}  // namespace
}  // namespace lumigrove
