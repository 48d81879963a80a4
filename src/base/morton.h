// 30-bit Morton codes: 10 bits an axis, x in the highest bit of each triple.
#pragma once

#include "base/vec.h"

#if defined(__BMI2__) && !defined(__CUDACC__)
#include <immintrin.h>
#endif

namespace lumigrove {

// Spreads the low 10 bits of v to every third bit.
LUMI_HD inline std::uint32_t spread_bits_by_3(std::uint32_t v) {
#if defined(__BMI2__) && !defined(__CUDACC__)
  return _pdep_u32(v, 0x09249249u);
#else
  v = (v | (v << 16)) & 0x030000ffu;
  v = (v | (v << 8)) & 0x0300f00fu;
  v = (v | (v << 4)) & 0x030c30c3u;
  return (v | (v << 2)) & 0x09249249u;
#endif
}

// `p` in units of the box it is quantised over, [0,1]^3; values outside (and NaN) are clamped.
LUMI_HD inline std::uint32_t morton30(vec3 p) {
  const auto cell = [](float v) {
    const float scaled = v * 1024.0f;
    return scaled > 0 ? (scaled < 1023.0f ? static_cast<std::uint32_t>(scaled) : 1023u) : 0u;
  };
  return (spread_bits_by_3(cell(p.x)) << 2) | (spread_bits_by_3(cell(p.y)) << 1) | spread_bits_by_3(cell(p.z));
}

// 1 / extent of a box, 0 along axes where it is flat: then every point has the same code there.
LUMI_HD inline vec3 inverse_extent(Box3 box) {
  const vec3 e = box.extent();
  return vec3(e.x > 0 ? 1 / e.x : 0, e.y > 0 ? 1 / e.y : 0, e.z > 0 ? 1 / e.z : 0);
}

}  // namespace lumigrove
