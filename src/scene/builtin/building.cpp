#include "scene/builtin/building.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "scene/builtin/random_stream.h"

namespace lumigrove::builtin {
namespace {

constexpr float kPaneOffset = 0.02f;  // in front of the wall
constexpr std::uint32_t kLitPurpose = 0x6c6974u;

// Maps (right, up, out) of a wall to the scene.
mat4 wall_frame(const Facade& wall) {
  return mat4(vec4(wall.along, 0), vec4(0, 1, 0, 0), vec4(wall.normal, 0), vec4(wall.origin, 1));
}

std::array<Facade, 4> walls_of(const BuildingShape& s) {
  const float w = s.hi.x - s.lo.x, d = s.hi.y - s.lo.y, h = s.height();
  return {Facade{vec3(s.lo.x, s.base, s.hi.y), vec3(1, 0, 0), vec3(0, 0, 1), w, h},
          Facade{vec3(s.hi.x, s.base, s.hi.y), vec3(0, 0, -1), vec3(1, 0, 0), d, h},
          Facade{vec3(s.hi.x, s.base, s.lo.y), vec3(-1, 0, 0), vec3(0, 0, -1), w, h},
          Facade{vec3(s.lo.x, s.base, s.lo.y), vec3(0, 0, 1), vec3(-1, 0, 0), d, h}};
}

void add_relief(const BuildingShape& shape, const Facade& wall, int bays, MeshBuilder& builder) {
  builder.set_transform(wall_frame(wall));
  const float bay = wall.width / static_cast<float>(bays);
  if (shape.pilasters)
    for (int i = 0; i <= bays; ++i) {
      const float x = std::clamp(bay * static_cast<float>(i), 0.25f, wall.width - 0.25f);
      builder.box(vec3(x - 0.25f, 0, 0), vec3(x + 0.25f, wall.height - 0.6f, 0.28f),
                  kLeft | kRight | kFront | kTop);
    }
  if (shape.bands)
    for (int f = 1; f < shape.floors; ++f) {
      const float y = shape.ground_floor + shape.floor_height * static_cast<float>(f - 1);
      builder.box(vec3(0, y - 0.15f, 0), vec3(wall.width, y + 0.1f, 0.2f),
                  kBottom | kFront | kTop | kLeft | kRight);
    }
  builder.box(vec3(-0.35f, wall.height - 0.6f, -0.05f), vec3(wall.width + 0.35f, wall.height - 0.15f, 0.4f));
  builder.set_transform(mat4(1));
}

void add_windows(const BuildingShape& shape, const Facade& wall, int bays, std::vector<WindowSlot>& windows) {
  const float bay = wall.width / static_cast<float>(bays);
  const auto add = [&](int column, float bottom, vec2 size, float weight, bool shop) {
    const float left = bay * static_cast<float>(column) + 0.5f * (bay - size.x);
    windows.push_back({wall.origin + wall.along * left + vec3(0, bottom, 0) + wall.normal * kPaneOffset,
                       wall.along * size.x, vec3(0, size.y, 0), weight, shop});
  };
  for (int column = 0; column < bays; ++column) {
    if (shape.shops) add(column, 0.6f, vec2(bay - 0.7f, shape.ground_floor - 1.5f), 2.5f, true);
    for (int f = 1; f < shape.floors; ++f) {
      const float bottom = shape.ground_floor + shape.floor_height * static_cast<float>(f - 1) + 0.85f;
      add(column, bottom, vec2(bay - 1.2f, shape.floor_height - 1.45f), shape.weight, false);
    }
  }
}

}  // namespace

void add_building(const BuildingShape& shape, MeshBuilder& walls, std::vector<WindowSlot>& windows,
                  std::vector<Facade>& facades) {
  const float top = shape.base + shape.height();
  walls.box(vec3(shape.lo.x, shape.base, shape.lo.y), vec3(shape.hi.x, top - 0.4f, shape.hi.y),
            kSides | kTop);
  for (const Facade& wall : walls_of(shape)) {
    const int bays = std::max(1, static_cast<int>(std::lround(wall.width / shape.bay)));
    add_relief(shape, wall, bays, walls);
    add_windows(shape, wall, bays, windows);
    facades.push_back(wall);
  }
}

std::vector<bool> choose_lit(const std::vector<WindowSlot>& windows, std::size_t count, std::uint32_t seed) {
  std::vector<std::pair<float, std::uint32_t>> order;
  order.reserve(windows.size());
  for (std::uint32_t i = 0; i < windows.size(); ++i)
    order.emplace_back(RandomStream(seed, kLitPurpose, i).uniform() / windows[i].weight, i);
  count = std::min(count, order.size());
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end());
  std::vector<bool> lit(windows.size(), false);
  for (std::size_t k = 0; k < count; ++k) lit[order[k].second] = true;
  return lit;
}

}  // namespace lumigrove::builtin
