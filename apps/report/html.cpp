#include "html.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace lumigrove {
namespace {

// With separators between thousands.
std::string whole_text(double value) {
  std::string text = fmt::format("{:.0f}", std::abs(value));
  for (int at = static_cast<int>(text.size()) - 3; at > 0; at -= 3) text.insert(static_cast<std::size_t>(at), ",");
  return (value < 0 ? "-" : "") + text;
}

// Divided by the largest power of 1000 that leaves at least 1.
std::string scaled_text(double value, const std::array<const char*, 5>& units) {
  std::size_t unit = 0;
  for (; std::abs(value) >= 999.5 && unit + 1 < units.size(); ++unit) value *= 1e-3;
  const std::string name = units[unit];
  return (unit == 0 ? fmt::format("{:.0f}", value) : number_text(value)) + (name.empty() ? "" : " " + name);
}

}  // namespace

std::string escape_html(std::string_view text) {
  std::string escaped;
  for (const char c : text) switch (c) {
      case '&': escaped += "&amp;"; break;
      case '<': escaped += "&lt;"; break;
      case '>': escaped += "&gt;"; break;
      case '"': escaped += "&quot;"; break;
      default: escaped += c;
    }
  return escaped;
}

std::string base64(std::span<const std::uint8_t> bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - at);
    std::uint32_t group = 0;
    for (std::size_t i = 0; i < 3; ++i) group = group << 8 | (i < count ? bytes[at + i] : 0u);
    for (std::size_t i = 0; i < 4; ++i) text += i <= count ? kDigits[group >> (18 - 6 * i) & 63] : '=';
  }
  return text;
}

std::string number_text(double value, int digits) {
  if (!is_number(value)) return "-";
  if (value == 0) return "0";
  const int decade = static_cast<int>(std::floor(std::log10(std::abs(value)) + 1e-9));
  if (decade < -4 || decade > 8) return fmt::format("{:.{}e}", value, digits - 1);
  return decade >= digits - 1 ? whole_text(value) : fmt::format("{:.{}f}", value, digits - 1 - decade);
}

std::string seconds_text(double seconds) {
  if (!is_number(seconds)) return "-";
  if (seconds == 0) return "0 s";
  if (seconds < 0.9995) return number_text(1e3 * seconds) + " ms";
  if (seconds < 119.5) return (seconds == std::round(seconds) ? fmt::format("{:.0f}", seconds) : number_text(seconds)) + " s";
  const double whole = std::round(seconds);
  return fmt::format("{:.0f} min {:.0f} s", std::floor(whole / 60), std::fmod(whole, 60));
}

std::string count_text(double count) {
  return is_number(count) ? scaled_text(count, {"", "k", "M", "G", "T"}) : "-";
}

std::string bytes_text(double bytes) {
  return is_number(bytes) ? scaled_text(bytes, {"B", "kB", "MB", "GB", "TB"}) : "-";
}

}  // namespace lumigrove
