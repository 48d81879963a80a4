// Checks of option values that several commands share.
#pragma once

#include <CLI/CLI.hpp>

namespace lumigrove {

// A number from lo to hi. CLI::Range would let NaN pass.
CLI::Validator number_in(double lo, double hi);

// An empty value is nearly always a shell variable that nobody set; it must not mean "as if not given".
CLI::Validator not_empty();

}  // namespace lumigrove
