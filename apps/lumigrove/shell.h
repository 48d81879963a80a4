// Words as a shell reads them.
#pragma once

#include <string>

namespace lumigrove {

// In single quotes, unless it needs none.
std::string shell_quoted(const std::string& word);

}  // namespace lumigrove
