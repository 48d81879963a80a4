// Methods and budgets as the command line names them.
#pragma once

#include <string>
#include <vector>

#include "frame/settings_file.h"

namespace lumigrove {

// "tree" or "tree:direct.spp=4:direct.width=2": a preset and what is set over it; "binary=tree:direct.width=2" with a name
// of its own.
struct MethodSpec {
  std::string name;  // its own, or as it was written
  std::string preset;
  SettingValues values;
};

// Throws Error for an empty name, a value without '=', and a method that stands there twice.
MethodSpec parse_method(const std::string& text);
std::vector<MethodSpec> parse_methods(const std::vector<std::string>& texts);  // each with commas between methods

// 0: not given.
struct BudgetSpec {
  double seconds = 0;
  int spp = 0;
};

// "10s", "1.5min", "64spp", or both with a comma between them. Throws Error naming `option`.
BudgetSpec parse_budget(const std::string& option, const std::vector<std::string>& texts);

}  // namespace lumigrove
