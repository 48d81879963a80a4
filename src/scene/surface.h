// A point on a surface, ready to be lit: the G-buffer element of every method.
#pragma once

#include "base/vec.h"

namespace lumigrove {

// Normals face the viewer (both are flipped together when the back is seen).
struct Surface {
  vec3 position;
  float t = 0;                // distance from the ray's origin, metres; 0 with instance == kNoId: nothing hit
  vec3 geometric_normal;      // unit
  float roughness = 1;        // linear roughness in [0.08, 1]; alpha = roughness^2
  vec3 normal;                // unit shading normal, same side as geometric_normal
  std::uint32_t instance = 0xffffffffu;
  vec3 wo;                    // unit, towards the viewer
  std::uint32_t triangle = 0;
  vec3 diffuse;               // diffuse albedo
  float epsilon = 0;          // offset along geometric_normal that clears self-intersection, metres
  vec3 specular;              // F0
  std::uint32_t emitter = 0xffffffffu;  // light-set index of the hit triangle if it emits towards wo
  vec3 emission;              // radiance towards wo
  float pad = 0;
};

}  // namespace lumigrove
