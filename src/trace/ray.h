// What crosses the tracing seam, one ray at a time: rays in, hits out. Plain data for host and device.
#pragma once

#include <cstdint>

#include "base/vec.h"

namespace lumigrove {

// Segment origin + t*direction, t in [tmin, tmax] and t >= 0; direction need not be unit. tmax < tmin (or a
// NaN anywhere) marks a ray that is not traced: it hits nothing and occludes nothing. tmax may be infinite.
struct Ray {
  vec3 origin;
  float tmin = 0;
  vec3 direction;
  float tmax = -1;
};

inline constexpr std::uint32_t kNoId = 0xffffffffu;

struct Hit {
  std::uint32_t instance = kNoId;  // index into SceneState::instances
  std::uint32_t triangle = 0;      // index into Mesh::triangles
  float u = 0, v = 0;              // barycentric: p = (1-u-v) p0 + u p1 + v p2
  float t = 0;                     // in units of direction
};

}  // namespace lumigrove
