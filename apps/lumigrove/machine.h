// What a comparison ran on.
#pragma once

#include "results.h"

namespace lumigrove {

Machine this_machine(int threads);  // 0: all cores
std::string utc_now();              // ISO 8601

}  // namespace lumigrove
