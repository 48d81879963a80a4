// Settings as TOML text: settings files and the settings part of receipts. Tables nest into dotted keys:
// [direct] spp = 4 is direct.spp = 4.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lumigrove/settings.h"

namespace lumigrove {

using SettingValues =
    std::vector<std::pair<std::string, std::string>>;  // key, value, in the order of the text

// Reads TOML into (key, value) pairs without judging the keys. Throws Error naming `source` and the line.
SettingValues parse_settings(const std::string& toml, const std::string& source);

// Reads a file. Throws Error naming it.
SettingValues read_settings_file(const std::filesystem::path& file);

// Applies `preset` first, wherever it stands in the list, then the others in order. Throws Error naming
// `source`.
void apply_settings(Settings& settings, const SettingValues& values, const std::string& source);

// The preset and everything that differs from it, so that apply_settings(parse_settings(text)) over default
// settings gives the same settings bit for bit.
std::string to_toml(const Settings& settings);

}  // namespace lumigrove
