// 9-bit codes of directions: the octant, then three subdivisions of its triangle into four. Directions of equal codes
// lie within 10.3 degrees of direction_of_code().
// Taubin and Rossignac 1998, "Geometric Compression through Topological Surgery", ACM TOG 17(2), subdivides alike.
#pragma once

#include <cstdint>

#include "base/vec.h"

namespace lumigrove {

inline constexpr int kDirectionBits = 9, kDirectionLevels = 3;

// Octant: x, y, z from the highest bit, 1 if not negative. Each level, coarsest first: 0, 1, 2 = the corner at y, z, x;
// 3 = the middle. `n` need not be unit; zero and NaN have some code.
LUMI_HD inline std::uint32_t direction_code(vec3 n) {
  std::uint32_t code = (n.x >= 0 ? 4u : 0u) | (n.y >= 0 ? 2u : 0u) | (n.z >= 0 ? 1u : 0u);
  vec3 b = glm::abs(n) / (glm::abs(n.x) + glm::abs(n.y) + glm::abs(n.z));  // barycentric in the octant's triangle
  for (int level = 0; level < kDirectionLevels; ++level) {
    const std::uint32_t part = b.y >= 0.5f ? 0u : b.z >= 0.5f ? 1u : b.x >= 0.5f ? 2u : 3u;
    code = (code << 2) | part;
    if (part == 3) {
      b = vec3(1) - 2.0f * vec3(b.z, b.x, b.y);
    } else {
      b = 2.0f * b - vec3(part == 2 ? 1 : 0, part == 0 ? 1 : 0, part == 1 ? 1 : 0);
    }
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
