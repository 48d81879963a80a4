// How much pictures change from frame to frame beyond what the reference changes.
#pragma once

#include <filesystem>
#include <vector>

#include "lumigrove/image.h"
#include "results.h"

namespace lumigrove {

// Of every two neighbouring frames of a run whose pictures and references are there.
std::vector<FrameChange> frame_changes(const Results& results, const std::filesystem::path& folder, const ToneMap& tone);

// On tone-mapped sRGB values in [0,1], three floats a pixel: a and b neighbouring frames, ra and rb those of the reference.
FrameChange change_between(const std::vector<float>& a, const std::vector<float>& b, const std::vector<float>& ra,
                           const std::vector<float>& rb);

}  // namespace lumigrove
