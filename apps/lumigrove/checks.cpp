#include "checks.h"

#include <fmt/format.h>

#include "frame/value_text.h"

namespace lumigrove {

CLI::Validator number_in(double lo, double hi) {
  const Range range{lo, hi};
  const auto check = [range](const std::string& text) {
    try {
      parse_double("it", text, range);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  return CLI::Validator(check, "from " + fmt::format("{} to {}", lo, hi));
}

CLI::Validator not_empty() {
  return CLI::Validator(
      [](const std::string& text) {
        return text.empty() ? std::string("its value is empty") : std::string();
      },
      "");
}

}  // namespace lumigrove
