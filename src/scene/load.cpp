#include <fmt/format.h>

#include "scene/asset_files.h"
#include "scene/import.h"

namespace lumigrove {
namespace {

std::string builtin_names() {
  std::string names;
  for (const BuiltinScene& scene : builtin_scenes()) names += (names.empty() ? "" : ", ") + scene.name;
  return names;
}

}  // namespace

Scene load_scene(const std::string& name_or_path) {
  if (is_builtin_scene(name_or_path)) return make_builtin_scene(name_or_path);
  const std::filesystem::path file(name_or_path);
  std::error_code error;
  if (!std::filesystem::exists(file, error))
    throw Error(
        fmt::format("'{}' is neither a file nor a built-in scene ({})", name_or_path, builtin_names()));
  const std::string extension = lower_case_extension(file);
  return extension == ".gltf" || extension == ".glb" ? import_gltf(file) : import_assimp(file);
}

}  // namespace lumigrove
