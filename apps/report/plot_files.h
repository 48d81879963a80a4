// The curves of a comparison as files of their own, for documents.
#pragma once

#include <filesystem>

#include "results.h"

namespace lumigrove {

// plots/rmse-time.direct-light.svg and the like. Written atomically; throws Error.
void write_plots(const Results& results, const std::filesystem::path& folder);

}  // namespace lumigrove
