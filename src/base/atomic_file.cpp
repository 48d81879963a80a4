#include "base/atomic_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace lumigrove {

std::filesystem::path temporary_beside(const std::filesystem::path& file) {
  static std::atomic<unsigned> counter = 0;
  std::filesystem::path temporary = file;
  temporary += fmt::format(".{}-{}.tmp", getpid(), counter++);
  return temporary;
}

void write_file_atomically(const std::filesystem::path& file, std::span<const std::uint8_t> bytes) {
  const std::filesystem::path temporary = temporary_beside(file);
  const auto fail = [&](const std::string& reason) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw Error(fmt::format("{}: cannot be written: {}", file.string(), reason));
  };
  std::ofstream out(temporary, std::ios::binary);
  if (!out) fail(std::strerror(errno));
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) fail(std::strerror(errno));
  std::error_code error;
  std::filesystem::rename(temporary, file, error);
  if (error) fail(error.message());
}

}  // namespace lumigrove
