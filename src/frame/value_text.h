// Setting values as text: numbers print in the shortest form that reads back to the same bits.
// Every parse_x throws Error("<key> is '<text>', but must be ...") when the text is not such a value.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "lumigrove/settings.h"

namespace lumigrove {

// Inclusive range of a number unless `open`, which excludes both ends.
struct Range {
  double lo, hi;
  bool open = false;
};
std::string describe(const Range& range);  // "1..65536", "above 0, below 180"

[[noreturn]] void refuse_value(const std::string& key, std::string_view text, const std::string& expected);

std::int64_t parse_integer(const std::string& key, std::string_view text, const Range& range);
float parse_float(const std::string& key, std::string_view text, const Range& range);
double parse_double(const std::string& key, std::string_view text, const Range& range);
bool parse_bool(const std::string& key, std::string_view text);
vec3 parse_vec3(const std::string& key, std::string_view text);
std::array<int, 4> parse_int4(const std::string& key, std::string_view text);

std::string print(float value);
std::string print(double value);
std::string print(bool value);
std::string print(vec3 value);
std::string print(const std::array<int, 4>& value);

}  // namespace lumigrove
