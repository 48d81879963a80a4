// Buildings for the city scenes: walls with relief, and the places where windows and signs go.
#pragma once

#include <vector>

#include "scene/builtin/mesh_builder.h"

namespace lumigrove::builtin {

// One window, a little in front of its wall; it faces cross(u,v). Metres.
struct WindowSlot {
  vec3 corner, u, v;
  float weight = 1;          // relative chance of being lit
  int across = 1, down = 1;  // panes, when it is lit
  bool shop = false;         // on the ground floor
  std::size_t triangles() const { return 2 * static_cast<std::size_t>(across * down); }
};

// One wall seen from outside: `origin` is its left end on the ground, `along` points right, `normal`
// outwards.
struct Facade {
  vec3 origin, along, normal;
  BoxFace side = kFront;
  float width = 0, height = 0;
};

struct BuildingShape {
  vec2 lo, hi;  // ground plan, x and z
  float base = 0;
  int floors = 5;
  float ground_floor = 4.2f, floor_height = 3.3f;
  float bay = 3.2f;                      // width of a bay with one window, about
  vec2 margin = vec2(1.2f, 1.45f);       // what a window leaves of its bay's width and its floor's height
  int panes_across = 1, panes_down = 1;  // of each window
  unsigned windowed = kSides;            // walls with windows, as BoxFace
  bool shops = true;
  bool pilasters = true, bands = true;
  float weight = 1;  // of its windows
  float height() const { return ground_floor + floor_height * static_cast<float>(floors - 1) + 0.8f; }
};

// Appends the walls that have windows to `facades`.
void add_building(const BuildingShape& shape, MeshBuilder& walls, std::vector<WindowSlot>& windows,
                  std::vector<Facade>& facades);

// Which windows are lit so that their panes come to `triangles` (all when there are fewer), by weighted
// random order.
std::vector<bool> choose_lit(const std::vector<WindowSlot>& windows, std::size_t triangles,
                             std::uint32_t seed);

// The panes of a window, each a quad, with bars of `bar` metres left open between them.
void add_panes(MeshBuilder& builder, const WindowSlot& window, float bar);

}  // namespace lumigrove::builtin
