#include "scene/asset_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>

namespace lumigrove {

namespace fs = std::filesystem;

std::vector<unsigned char> read_file(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) throw Error(fmt::format("{}: no such file", file.string()));
  if (!fs::is_regular_file(status)) throw Error(fmt::format("{}: not a regular file", file.string()));
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream) throw Error(fmt::format("{}: cannot be opened for reading", file.string()));
  std::vector<unsigned char> bytes(static_cast<std::size_t>(stream.tellg()));
  stream.seekg(0);
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream) throw Error(fmt::format("{}: cannot be read to its end", file.string()));
  return bytes;
}

fs::path resolve_inside(const fs::path& folder, const std::string& reference, const std::string& where) {
  std::string slashes = reference;
  std::replace(slashes.begin(), slashes.end(), '\\', '/');
  const bool drive = slashes.size() > 1 && slashes[1] == ':';
  const fs::path relative(slashes);
  if (slashes.find('\0') != std::string::npos)
    throw Error(fmt::format("{}: a file name contains a zero byte", where));
  std::error_code error;
  const fs::path root = fs::canonical(folder.empty() ? fs::path(".") : folder, error);
  if (error) throw Error(fmt::format("{}: the folder {} cannot be read", where, folder.string()));
  // Two looks: the name itself before the disk is asked (so that nothing outside is even probed), then its
  // links.
  const fs::path plain = (root / relative).lexically_normal();
  const auto inside = [&](const fs::path& path) {
    return std::mismatch(root.begin(), root.end(), path.begin(), path.end()).first == root.end();
  };
  if (relative.is_absolute() || drive || !inside(plain))
    throw Error(fmt::format("{}: '{}' leaves the scene's folder", where, reference));
  const fs::path resolved = fs::canonical(plain, error);
  if (error) throw Error(fmt::format("{}: '{}' does not exist in the scene's folder", where, reference));
  if (!inside(resolved)) throw Error(fmt::format("{}: '{}' leaves the scene's folder", where, reference));
  if (!fs::is_regular_file(resolved, error))
    throw Error(fmt::format("{}: '{}' is not a regular file", where, reference));
  return resolved;
}

std::string percent_decode(const std::string& text, const std::string& where) {
  std::string decoded;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    unsigned code = 0;
    const char* first = text.data() + i + 1;
    const char* last = text.data() + std::min(text.size(), i + 3);
    const auto [end, error] = std::from_chars(first, last, code, 16);
    if (error != std::errc() || end != first + 2)
      throw Error(fmt::format("{}: malformed percent escape in '{}'", where, text));
    decoded += static_cast<char>(code);
    i += 2;
  }
  return decoded;
}

std::string lower_case_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

}  // namespace lumigrove
