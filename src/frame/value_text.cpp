#include "frame/value_text.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace lumigrove {
namespace {

// The whole text as a number; false for anything else, including text after the number and an overflow.
template <class Number>
bool read_number(std::string_view text, Number& value) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && !text.empty();
}

bool contains(const Range& range, double value) {
  return range.open ? value > range.lo && value < range.hi : value >= range.lo && value <= range.hi;
}

template <class Real>
Real parse_real(const std::string& key, std::string_view text, const Range& range) {
  Real value = 0;
  const bool valid = read_number(text, value) && std::isfinite(value) && contains(range, value);
  if (!valid) refuse_value(key, text, "a number, " + describe(range));
  return value;
}

// "1,2,3" or "1 2 3" -> its parts.
std::vector<std::string_view> split_list(std::string_view text) {
  constexpr std::string_view kSeparators = ", ";
  std::vector<std::string_view> parts;
  std::size_t begin = text.find_first_not_of(kSeparators);
  while (begin != std::string_view::npos) {
    const std::size_t end = std::min(text.find_first_of(kSeparators, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(kSeparators, end);
  }
  return parts;
}

}  // namespace

std::string describe(const Range& range) {
  if (range.open) return fmt::format("above {} and below {}", range.lo, range.hi);
  if (std::isinf(range.lo)) return "finite";
  if (std::isinf(range.hi)) return fmt::format("at least {}", range.lo);
  return fmt::format("from {:.10g} to {:.10g}", range.lo, range.hi);
}

void refuse_value(const std::string& key, std::string_view text, const std::string& expected) {
  throw Error(fmt::format("{} is '{}', but must be {}", key, text, expected));
}

std::int64_t parse_integer(const std::string& key, std::string_view text, const Range& range) {
  std::int64_t value = 0;
  const bool valid = read_number(text, value) && contains(range, static_cast<double>(value));
  if (!valid) refuse_value(key, text, "a whole number " + describe(range));
  return value;
}

float parse_float(const std::string& key, std::string_view text, const Range& range) {
  return parse_real<float>(key, text, range);
}
double parse_double(const std::string& key, std::string_view text, const Range& range) {
  return parse_real<double>(key, text, range);
}

bool parse_bool(const std::string& key, std::string_view text) {
  if (text == "true" || text == "1" || text == "on") return true;
  if (text == "false" || text == "0" || text == "off") return false;
  refuse_value(key, text, "true or false");
}

vec3 parse_vec3(const std::string& key, std::string_view text) {
  const std::vector<std::string_view> parts = split_list(text);
  vec3 value(0);
  bool valid = parts.size() == 3;
  for (int i = 0; valid && i < 3; ++i) valid = read_number(parts[i], value[i]) && std::isfinite(value[i]);
  if (!valid) refuse_value(key, text, "three finite numbers 'x,y,z'");
  return value;
}

std::array<int, 4> parse_int4(const std::string& key, std::string_view text) {
  const std::vector<std::string_view> parts = split_list(text);
  std::array<int, 4> value{};
  bool valid = parts.size() == 4;
  for (std::size_t i = 0; valid && i < 4; ++i) valid = read_number(parts[i], value[i]);
  if (!valid) refuse_value(key, text, "four whole numbers 'x0,x1,y0,y1'");
  return value;
}

std::string print(float value) { return fmt::format("{}", value); }
std::string print(double value) { return fmt::format("{}", value); }
std::string print(bool value) { return value ? "true" : "false"; }
std::string print(vec3 value) { return fmt::format("{},{},{}", value.x, value.y, value.z); }
std::string print(const std::array<int, 4>& v) { return fmt::format("{},{},{},{}", v[0], v[1], v[2], v[3]); }

}  // namespace lumigrove
