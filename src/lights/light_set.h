// All local emitters of one moment (emissive triangles, point and spot lights) as one indexed set, and beside it the
// lights at infinity (directional, environment). Rebuilt every frame; indices are stable while the scene's structure
// does not change, because they follow node, instance and triangle order.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "lumigrove/scene.h"
#include "scene/scene_view.h"

namespace lumigrove {

// 52 bytes. A triangle: p0, edges e1 and e2, world space, wound so that cross(e1,e2) is the emitting side.
// A point or spot light: p0 = position; e1 = unit direction; e2.x/.y = cos of outer and inner half-angle.
struct Emitter {
  vec3 p0;
  std::uint32_t instance;     // SceneState::instances, or kPunctual | index into SceneState::lights
  vec3 e1;
  std::uint32_t triangle;     // of the mesh
  vec3 e2;
  float flux;                 // Y of total power leaving it, W (BT.709)

  static constexpr std::uint32_t kPunctual = 0x80000000u;
  LUMI_HD bool punctual() const { return (instance & kPunctual) != 0; }
};

struct DirectionalView {
  vec3 direction;             // unit, where the light travels
  vec3 irradiance;            // on a plane facing it, W/m^2
};
struct PunctualView {         // point or spot
  vec3 intensity;             // W/sr
  float range;                // metres, 0 = unlimited
};

struct LightView {
  std::span<const Emitter> emitters;
  std::span<const PunctualView> punctual;        // parallel to SceneState::lights
  std::span<const DirectionalView> directional;
  float light_scale = 1;
};

}  // namespace lumigrove
