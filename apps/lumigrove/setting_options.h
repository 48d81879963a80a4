// Command line options that write settings: --preset power, --settings file.toml, --set direct.spp=4,
// --spp 4.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "frame/settings_file.h"

namespace lumigrove {

struct SettingOptions {
  std::string preset;  // empty: of the settings files, or the default
  std::vector<std::string> files;
  std::vector<std::string> assignments;  // key=value
  SettingValues values;                  // of the options that stand for a key
  std::vector<std::string> crop_window;  // x0 x1 y0 y1 as fractions of the image; empty: not given
  std::vector<std::string> pixel;        // x y; empty: not given
};

// `threads`: names of that option.
std::shared_ptr<SettingOptions> add_setting_options(CLI::App& command,
                                                    const std::string& threads = "-t,--threads,--nthreads");

// Preset, then settings files, then --set, then the options of their own; checked. Throws Error.
Settings make_settings(const SettingOptions& options);

// Is `key` given by anything but the method?
bool gives(const SettingOptions& options, const std::string& key);

// An option of exactly `count` values, also as one word with `separator` between them.
using ListFunction = std::function<void(const std::vector<std::string>&)>;
CLI::Option* add_list_option(CLI::App& command, const std::string& name, int count, char separator,
                             const std::string& type_name, const ListFunction& function,
                             const std::string& description);

}  // namespace lumigrove
