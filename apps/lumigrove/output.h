// Image files of a command: refused before any work is done, written when it is.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "lumigrove/image.h"

namespace lumigrove {

struct OutputOptions {
  std::vector<std::string> files;
  float exposure = 0;  // EV
  std::string curve = "filmic";

  ToneMap tone() const;
};

// -o, --exposure, --tone. The caller says whether -o is required.
std::shared_ptr<OutputOptions> add_output_options(CLI::App& command);

// ".png" of "A.PNG".
std::string lower_extension(const std::filesystem::path& file);

// Extensions that write_image knows.
extern const std::vector<std::string> kImageExtensions;

// Throws Error when two of the names mean one file.
void require_distinct(const std::vector<std::string>& files);

// Throws Error unless `file` has one of `extensions` and lies in an existing, writable folder, and unless it
// is a regular file if it exists already.
void require_writable(const std::string& file, const std::vector<std::string>& extensions = kImageExtensions);

// Makes the folder and those above it where they are missing. Throws Error.
void make_folder(const std::string& folder);

}  // namespace lumigrove
