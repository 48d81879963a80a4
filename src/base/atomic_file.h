// Output files that are either complete or absent.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

#include "lumigrove/error.h"

namespace lumigrove {

// Writes `bytes` to a temporary beside `file` and renames it. Throws Error naming the file; on failure
// neither a partial file nor the temporary stays behind.
void write_file_atomically(const std::filesystem::path& file, std::span<const std::uint8_t> bytes);
inline void write_text_atomically(const std::filesystem::path& file, std::string_view text) {
  write_file_atomically(file, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

// A name beside `file` for a temporary, different for every process and call.
std::filesystem::path temporary_beside(const std::filesystem::path& file);

}  // namespace lumigrove
