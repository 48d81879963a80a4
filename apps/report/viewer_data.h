// What the viewer of a report shows: pictures, FLIP maps, bias maps and regions of a comparison, in its own JSON.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "results.h"

namespace lumigrove {

struct ViewerData {
  std::string json;                // for report.js; no "<" in it
  std::vector<std::string> pictures;  // base64; the JSON names number i "picture-i"
  std::string embedded;            // one sentence: how the pictures were encoded
};

// Reads the EXRs of the first seed, and of all seeds for bias maps. A file that cannot be read is missing in the viewer,
// which says why. The pictures have at most `most_bytes` of base64.
ViewerData make_viewer_data(const Results& results, const std::filesystem::path& folder, std::size_t most_bytes);

}  // namespace lumigrove
