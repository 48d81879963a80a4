// 9-bit codes of directions: the octant, then three subdivisions of its triangle into four. Directions of equal codes
// lie within kDirectionCodeDegrees of direction_of_code().
// Taubin and Rossignac 1998, "Geometric Compression through Topological Surgery", ACM TOG 17(2), subdivides alike.
#pragma once

#include <cmath>
#include <cstdint>

#include "base/vec.h"

namespace lumigrove {

inline constexpr int kDirectionBits = 9, kDirectionLevels = 3;
inline constexpr float kDirectionCodeDegrees = 10.3f;

// Octant: x, y, z from the highest bit, 1 if not negative. Each level, coarsest first: 0, 1, 2 = the corner at y, z, x;
// 3 = the middle. `n` need not be unit; 0 for zero and NaN.
LUMI_HD inline std::uint32_t direction_code(vec3 n) {
  constexpr std::uint32_t kOne = 1u << 20;  // of barycentric coordinates in the octant's triangle
  const float ax = std::fabs(n.x), ay = std::fabs(n.y), az = std::fabs(n.z), sum = ax + ay + az;
  if (!(sum > 0 && is_finite(sum))) return 0;
  const float scale = static_cast<float>(kOne) / sum;
  const auto coordinate = [](float v) { return static_cast<std::uint32_t>(static_cast<int>(v)); };
  std::uint32_t bx = coordinate(ax * scale), by = coordinate(ay * scale), bz = coordinate(az * scale);
  std::uint32_t code = (n.x >= 0 ? 4u : 0u) | (n.y >= 0 ? 2u : 0u) | (n.z >= 0 ? 1u : 0u);
  for (int level = 0; level < kDirectionLevels; ++level) {  // without branches, which would be taken at random
    const std::uint32_t y = by >= kOne / 2, z = (bz >= kOne / 2) & ~y, x = (bx >= kOne / 2) & ~y & ~z;
    const std::uint32_t corner = 0u - (x | y | z), middle = ~corner;
    code = (code << 2) | (z + 2 * x + (middle & 3u));
    const std::uint32_t tx = 2 * bx, ty = 2 * by, tz = 2 * bz;
    bx = ((tx - x * kOne) & corner) | ((kOne - tz) & middle);
    by = ((ty - y * kOne) & corner) | ((kOne - tx) & middle);
    bz = ((tz - z * kOne) & corner) | ((kOne - ty) & middle);
  }
  return code;
}

// Unit; the centre of the code's triangle.
LUMI_HD inline vec3 direction_of_code(std::uint32_t code) {
  vec3 b(1.0f / 3);
  for (int level = 0; level < kDirectionLevels; ++level) {  // finest first: undoes the maps of direction_code
    const std::uint32_t part = (code >> (2 * level)) & 3u;
    if (part == 3) {
      b = 0.5f * (vec3(1) - vec3(b.y, b.z, b.x));
    } else {
      b = 0.5f * (b + vec3(part == 2 ? 1 : 0, part == 0 ? 1 : 0, part == 1 ? 1 : 0));
    }
  }
  const std::uint32_t octant = code >> (2 * kDirectionLevels);
  return glm::normalize(vec3((octant & 4u) != 0 ? b.x : -b.x, (octant & 2u) != 0 ? b.y : -b.y,
                             (octant & 1u) != 0 ? b.z : -b.z));
}

}  // namespace lumigrove
