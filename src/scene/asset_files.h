// Files that a scene file refers to: read whole, and never from outside the scene's folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lumigrove/error.h"

namespace lumigrove {

// All bytes of a regular file. Throws Error naming it (also for folders, devices and pipes).
std::vector<unsigned char> read_file(const std::filesystem::path& file);

// The existing regular file `folder`/`reference`, canonical. Throws Error "<where>: ..." when `reference` is
// absolute, climbs out with "..", leads out through a symbolic link, or names no file. Backslashes count as
// slashes.
std::filesystem::path resolve_inside(const std::filesystem::path& folder, const std::string& reference,
                                     const std::string& where);

// "%20" -> " "; throws Error "<where>: ..." for a malformed escape.
std::string percent_decode(const std::string& text, const std::string& where);

// ".obj" of "Chair.OBJ"; empty without an extension.
std::string lower_case_extension(const std::filesystem::path& file);

}  // namespace lumigrove
