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
  return {Facade{vec3(s.lo.x, s.base, s.hi.y), vec3(1, 0, 0), vec3(0, 0, 1), kFront, w, h},
          Facade{vec3(s.hi.x, s.base, s.hi.y), vec3(0, 0, -1), vec3(1, 0, 0), kRight, d, h},
          Facade{vec3(s.hi.x, s.base, s.lo.y), vec3(-1, 0, 0), vec3(0, 0, -1), kBack, w, h},
          Facade{vec3(s.lo.x, s.base, s.lo.y), vec3(0, 0, 1), vec3(-1, 0, 0), kLeft, d, h}};
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
                       wall.along * size.x, vec3(0, size.y, 0), weight, shop ? 2 : shape.panes_across,
                       shop ? 1 : shape.panes_down, shop});
  };
  for (int column = 0; column < bays; ++column) {
    if (shape.shops) add(column, 0.6f, vec2(bay - 0.7f, shape.ground_floor - 1.5f), 1.5f, true);
    for (int f = 1; f < shape.floors; ++f) {
      const float bottom =
          shape.ground_floor + shape.floor_height * static_cast<float>(f - 1) + 0.6f * shape.margin.y;
      add(column, bottom, vec2(bay, shape.floor_height) - shape.margin, shape.weight, false);
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
    if (!(shape.windowed & wall.side)) continue;
    add_relief(shape, wall, bays, walls);
    add_windows(shape, wall, bays, windows);
    facades.push_back(wall);
  }
}

std::vector<bool> choose_lit(const std::vector<WindowSlot>& windows, std::size_t triangles,
                             std::uint32_t seed) {
  std::vector<std::pair<float, std::uint32_t>> order;
  order.reserve(windows.size());
  for (std::uint32_t i = 0; i < windows.size(); ++i)
    order.emplace_back(RandomStream(seed, kLitPurpose, i).uniform() / windows[i].weight, i);
  std::sort(order.begin(), order.end());
  std::vector<bool> lit(windows.size(), false);
  std::size_t placed = 0;
  for (const auto& [key, i] : order) {
    if (placed + windows[i].triangles() > triangles) break;
    placed += windows[i].triangles();
    lit[i] = true;
  }
  return lit;
}

void add_panes(MeshBuilder& builder, const WindowSlot& window, float bar) {
  const float width = glm::length(window.u), height = glm::length(window.v);
  const vec3 right = window.u / width, up = window.v / height;
  const float w = (width + bar) / static_cast<float>(window.across),
              h = (height + bar) / static_cast<float>(window.down);
  for (int row = 0; row < window.down; ++row)
    for (int column = 0; column < window.across; ++column)
      builder.quad(window.corner + w * static_cast<float>(column) * right + h * static_cast<float>(row) * up,
                   (w - bar) * right, (h - bar) * up);
}

}  // namespace lumigrove::builtin
