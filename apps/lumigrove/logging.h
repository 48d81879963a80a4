// How much the tool says: --quiet, -v, --log-level and --log-file, alike in every command that works on
// scenes.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

namespace lumigrove {

struct LogOptions {
  bool quiet = false;
  int verbosity = 0;  // how often -v was given
  std::string level;  // empty: from quiet and verbosity
  std::string file;
};

std::shared_ptr<LogOptions> add_log_options(CLI::App& command);

// Messages go to stderr as "lumigrove: warning: ...", and with --log-file all of them, with times, to that
// file.
void start_logging(const LogOptions& options);

}  // namespace lumigrove
