#include "output.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <set>

#include "base/atomic_file.h"
#include "checks.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

void require_extension(const fs::path& file, const std::vector<std::string>& extensions) {
  const std::string extension = lower_extension(file);
  if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end())
    throw Error(fmt::format("output '{}' must end in one of {}", file.string(), fmt::join(extensions, ", ")));
}

void require_creatable(const fs::path& file) {
  const fs::path probe = temporary_beside(file);
  const bool created = std::ofstream(probe).good();
  std::error_code ignored;
  fs::remove(probe, ignored);
  if (!created)
    throw Error(fmt::format("output '{}' cannot be written: its folder is not writable", file.string()));
}

}  // namespace

const std::vector<std::string> kImageExtensions = {".exr", ".png", ".jpg", ".jpeg"};

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

ToneMap OutputOptions::tone() const {
  return {exposure, curve == "srgb" ? ToneCurve::kSrgb : ToneCurve::kFilmic};
}

std::shared_ptr<OutputOptions> add_output_options(CLI::App& command) {
  auto options = std::make_shared<OutputOptions>();
  command
      .add_option("-o,--output,--outfile", options->files,
                  "Image to write: .exr (all layers, linear), .png or .jpg (tone-mapped); may be repeated")
      ->allow_extra_args(false)
      ->type_name("FILE");
  command
      .add_option("--exposure", options->exposure, "Exposure of .png and .jpg (EV, default 0; +1 doubles)")
      ->type_name("EV")
      ->check(number_in(-100, 100));
  command.add_option("--tone", options->curve, "Tone curve of .png and .jpg (default filmic)")
      ->check(CLI::IsMember({"filmic", "srgb"}));
  return options;
}

void require_distinct(const std::vector<std::string>& files) {
  std::set<fs::path> seen;
  for (const std::string& file : files)
    if (!seen.insert(fs::absolute(file).lexically_normal()).second)
      throw Error(fmt::format("output '{}' is given twice", file));
}

void require_writable(const std::string& name, const std::vector<std::string>& extensions) {
  const fs::path file(name);
  require_extension(file, extensions);
  std::error_code ignored;
  const fs::file_status status = fs::status(file, ignored);
  if (fs::exists(status) && !fs::is_regular_file(status))
    throw Error(fmt::format("output '{}' is not a regular file", name));
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored))
    throw Error(fmt::format("output '{}' cannot be written: there is no folder '{}'", name, folder.string()));
  require_creatable(file);
}

void make_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!std::filesystem::is_directory(folder))
    throw Error(fmt::format("{}: cannot be made a folder: {}", folder, error.message()));
}

}  // namespace lumigrove
