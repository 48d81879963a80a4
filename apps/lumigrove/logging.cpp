#include "logging.h"

#include <fmt/format.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <filesystem>

#include "checks.h"
#include "lumigrove/error.h"

namespace lumigrove {
namespace {

const std::vector<std::string> kLevels = {"trace", "debug", "info", "warning", "error", "off"};

spdlog::level::level_enum level_of(const LogOptions& options) {
  if (!options.level.empty()) return spdlog::level::from_str(options.level);
  if (options.quiet) return spdlog::level::err;
  if (options.verbosity == 0) return spdlog::level::warn;
  return options.verbosity == 1 ? spdlog::level::info : spdlog::level::debug;
}

// spdlog would make the folders, a typing mistake included.
spdlog::sink_ptr open_log_file(const std::string& name) {
  const std::filesystem::path folder = std::filesystem::path(name).parent_path();
  std::error_code ignored;
  try {
    if (folder.empty() || std::filesystem::is_directory(folder, ignored))
      return std::make_shared<spdlog::sinks::basic_file_sink_mt>(name, true);
  } catch (const spdlog::spdlog_ex&) {
    // told below
  }
  throw Error(fmt::format("cannot write log file '{}'", name));
}

}  // namespace

std::shared_ptr<LogOptions> add_log_options(CLI::App& command) {
  auto options = std::make_shared<LogOptions>();
  auto* quiet = command.add_flag("-q,--quiet", options->quiet, "Say nothing but errors");
  auto* verbose = command.add_flag("-v", options->verbosity, "Say more; -vv for even more")->excludes(quiet);
  command.add_option("--log-level", options->level, "Least level of messages on stderr (default warning)")
      ->transform(CLI::IsMember(kLevels))
      ->excludes(quiet)
      ->excludes(verbose);
  command.add_option("--log-file", options->file, "Write all messages to this file as well")
      ->check(not_empty());
  return options;
}

void start_logging(const LogOptions& options) {
  auto terminal = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  terminal->set_level(level_of(options));
  terminal->set_pattern("lumigrove: %l: %v");
  std::vector<spdlog::sink_ptr> sinks{terminal};
  if (!options.file.empty()) {
    sinks.push_back(open_log_file(options.file));
    sinks.back()->set_pattern("%Y-%m-%dT%H:%M:%S.%e %l: %v");
  }
  auto logger = std::make_shared<spdlog::logger>("lumigrove", sinks.begin(), sinks.end());
  logger->set_level(spdlog::level::trace);  // sinks decide
  spdlog::set_default_logger(logger);
}

}  // namespace lumigrove
