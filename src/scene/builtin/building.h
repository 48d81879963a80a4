// Buildings for the city scenes: walls with relief, and the places where windows and signs go.
#pragma once

#include <vector>

#include "scene/builtin/mesh_builder.h"

namespace lumigrove::builtin {

// One pane, a little in front of its wall; it faces cross(u,v). Metres.
struct WindowSlot {
  vec3 corner, u, v;
  float weight = 1;   // relative chance of being lit
  bool shop = false;  // on the ground floor
};

// One wall seen from outside: `origin` is its left end on the ground, `along` points right, `normal`
// outwards.
struct Facade {
  vec3 origin, along, normal;
  float width = 0, height = 0;
};

struct BuildingShape {
  vec2 lo, hi;  // ground plan, x and z
  float base = 0;
  int floors = 5;
  float ground_floor = 4.2f, floor_height = 3.3f;
  float bay = 3.2f;  // width of a bay with one window, about
  bool shops = true;
  bool pilasters = true, bands = true;
  float weight = 1;  // of its windows
  float height() const { return ground_floor + floor_height * static_cast<float>(floors - 1) + 0.8f; }
};

void add_building(const BuildingShape& shape, MeshBuilder& walls, std::vector<WindowSlot>& windows,
                  std::vector<Facade>& facades);

// Which `count` of the windows are lit (all when there are fewer), by weighted random order.
std::vector<bool> choose_lit(const std::vector<WindowSlot>& windows, std::size_t count, std::uint32_t seed);

}  // namespace lumigrove::builtin
