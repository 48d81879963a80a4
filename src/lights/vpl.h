// Virtual point lights: where paths of light from the emitters met a surface, and what that surface sends on.
#pragma once

#include <cstdint>
#include <span>

#include "base/vec.h"

namespace lumigrove {

// 40 bytes. Shines into the half space of `normal` with radiant intensity `intensity` * cos(angle to normal).
struct Vpl {
  vec3 position;   // world, metres, on the surface
  float epsilon;   // offset along normal that clears self-intersection, metres
  vec3 normal;     // unit, geometric, on the side that the path arrived at
  vec3 intensity;  // W/sr along the normal: reflected flux / pi
};

struct VplView {
  std::span<const Vpl> vpls;
  Box3 bounds;         // of their positions; empty when there are none
  float diagonal = 1;  // D of the scene, metres
};

}  // namespace lumigrove
