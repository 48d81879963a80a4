// Words of HTML, and numbers as people read them: for tables, plots and pages.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace lumigrove {

std::string escape_html(std::string_view text);  // of text and of attributes in double quotes
std::string base64(std::span<const std::uint8_t> bytes);

inline bool is_number(double value) { return value - value == 0; }  // not NaN, not infinite

// Rounded to `digits` significant ones: "0.0123", "1,230", "1.2e-07"; "-" for what is no number.
std::string number_text(double value, int digits = 3);
std::string seconds_text(double seconds);  // "12 ms", "1.24 s", "3 min 20 s"
std::string count_text(double count);      // "960", "12.3 k", "1.24 M", "5.1 G"
std::string bytes_text(double bytes);      // "960 B", "12.3 MB"; powers of 1000

}  // namespace lumigrove
