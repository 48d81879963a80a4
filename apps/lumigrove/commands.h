// Subcommands of the tool, one file each. add_X_command registers the options and a callback that does the
// work; main() parses, and translates what a callback throws:
//   lumigrove::Error  one sentence on stderr, exit status 1
//   ExitCode          the status as it is; whatever had to be said is already printed
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace lumigrove {

struct ExitCode {
  int status = 0;
};

void add_render_command(CLI::App& app);   // render.cpp
void add_scene_command(CLI::App& app);    // scene.cpp
void add_list_command(CLI::App& app);     // list.cpp
void add_rerun_command(CLI::App& app);    // rerun.cpp
void add_compare_command(CLI::App& app, const std::string& command_line);  // compare.cpp; for its receipt
void add_tree_command(CLI::App& app);     // tree.cpp
void add_audit_command(CLI::App& app);    // audit.cpp

}  // namespace lumigrove
