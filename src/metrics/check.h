// What every metric asks of its two images.
#pragma once

#include "metrics/metrics.h"

namespace lumigrove {

// Throws Error unless both images have the same, positive size and finite values only.
void check_pair(const RgbImage& reference, const RgbImage& test);

}  // namespace lumigrove
