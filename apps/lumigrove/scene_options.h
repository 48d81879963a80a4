// SCENE, -D and --environment.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

namespace lumigrove {

struct SceneOptions {
  std::string name;
  std::vector<std::string> definitions;  // key=value
  std::string environment;

  // The built-in scene's name with the definitions as its parameters. Throws Error when a file gets
  // definitions.
  std::string full_name() const;
};

std::shared_ptr<SceneOptions> add_scene_options(CLI::App& command);

// -D and --environment alone, for a command whose SCENE is not all that may stand there.
void add_scene_parameters(CLI::App& command, const std::shared_ptr<SceneOptions>& options);

}  // namespace lumigrove
