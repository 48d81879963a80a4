#include "scene_options.h"

#include <fmt/format.h>

#include "checks.h"
#include "lumigrove/scene.h"

namespace lumigrove {

std::string SceneOptions::full_name() const {
  if (!definitions.empty() && !is_builtin_scene(name))
    throw Error(
        fmt::format("-D {} sets a parameter of a built-in scene, but '{}' is none", definitions[0], name));
  std::string result = name;
  for (const std::string& definition : definitions) {
    if (definition.find('=') == std::string::npos)
      throw Error(fmt::format("-D is '{}', but must be key=value", definition));
    result += result.find('?') == std::string::npos ? '?' : '&';
    result += definition;
  }
  return result;
}

void add_scene_parameters(CLI::App& command, const std::shared_ptr<SceneOptions>& options) {
  command.add_option("-D", options->definitions, "Parameter of a built-in scene; may be repeated")
      ->allow_extra_args(false)
      ->type_name("KEY=VALUE");
  command
      .add_option("--environment", options->environment,
                  "Light from infinitely far away: constant radiance r,g,b or an equirectangular image")
      ->check(not_empty())
      ->type_name("R,G,B|FILE");
}

std::shared_ptr<SceneOptions> add_scene_options(CLI::App& command) {
  auto options = std::make_shared<SceneOptions>();
  command
      .add_option(
          "SCENE", options->name,
          "A file (.gltf, .glb, .obj, .ply, .fbx) or a built-in scene of `list scenes`, with parameters: "
          "night-city?lights=50000&seed=3")
      ->required();
  add_scene_parameters(command, options);
  return options;
}

}  // namespace lumigrove
