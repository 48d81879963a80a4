#include "image/png_check.h"

#include <zlib.h>

#include <cstdint>
#include <cstring>
#include <string_view>

namespace lumigrove {
namespace {

constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
constexpr std::size_t kFrame = 12;  // bytes of a chunk around its data: length, type, checksum

std::uint32_t big_endian(const unsigned char* bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
         bytes[3];
}

bool is_type(const unsigned char* type, std::string_view name) {
  return std::memcmp(type, name.data(), name.size()) == 0;
}

}  // namespace

std::string png_damage(std::span<const unsigned char> file) {
  if (file.size() < kSignature.size() || !is_type(file.data(), kSignature)) return {};
  std::span<const unsigned char> rest = file.subspan(kSignature.size());
  while (rest.size() >= kFrame) {
    const std::size_t length = big_endian(rest.data());
    if (length > rest.size() - kFrame) break;
    const unsigned char* type = rest.data() + 4;
    const uLong sum = crc32_z(crc32_z(0, nullptr, 0), type, length + 4);
    if (sum != big_endian(type + 4 + length)) return "the checksum of a PNG chunk is wrong";
    if (is_type(type, "IEND")) return {};
    rest = rest.subspan(kFrame + length);
  }
  return "the PNG file is cut short";
}

}  // namespace lumigrove
