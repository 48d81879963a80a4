// Linear RGB in 8 bits for the report: x*s / (1 + x*s), s = 2^EV of the results, then the sRGB curve. What is shown as
// white lies in the middle of the codes, so that brighter and darker light survives and the exposure can be changed.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/srgb.h"

namespace lumigrove {

// Code 255 stands for 112 / s and everything above; negative light and NaN become 0.
inline std::uint8_t compand(float linear, float gain) {
  const float x = linear * gain;
  if (!(x > 0)) return 0;
  const float squeezed = x < 1e6f ? x / (1 + x) : 1.0f;
  return static_cast<std::uint8_t>(std::min(255.0f, 256 * linear_to_srgb(squeezed) + 0.5f));
}

// What a code stands for; report.js has the same.
inline float expand(std::uint8_t code, float gain) {
  const float squeezed = srgb_to_linear(static_cast<float>(code) / 256);
  return squeezed / (1 - squeezed) / gain;
}

}  // namespace lumigrove
