// Tables of a comparison, for the terminal and the report.
#pragma once

#include <string>

#include "summary.h"
#include "table.h"

namespace lumigrove {

// The kinds of light that methods are measured on, in the order of the methods.
std::vector<std::string> lights_of(const Results& results);

// One row a method, with those that have nothing to show; of one light, or of all when none is named.
Table summary_table(const Results& results, Budget budget, const std::string& light = "");
Table cost_table(const Results& results, const std::string& light = "");

}  // namespace lumigrove
