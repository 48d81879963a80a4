// `towers`: city towers seen from above, lit by their windows alone; after the character of the "Arnold
// Buildings" of Lin & Yuksel (I3D 2020): about 4,600 emissive triangles of radiance 4, albedo 0.8, a camera
// that looks down 40 degrees into the street canyons, and a second one that circles. A row of low buildings at
// the camera's feet lights the nearest facades.
#include <array>
#include <string>

#include "scene/builtin/building.h"
#include "scene/builtin/builtin.h"
#include "scene/builtin/random_stream.h"
#include "scene/builtin/scene_parts.h"

namespace lumigrove::builtin {
namespace {

constexpr int kColumns = 6, kRows = 6;
constexpr float kPitch = 31;   // metres from tower to tower
constexpr float kPeriod = 24;  // seconds, once around
enum Purpose : std::uint32_t { kShape, kTint };

// Luminance about 4: warm, neutral, cool.
constexpr std::array<vec3, 3> kRadiance = {vec3(7.4f, 3.3f, 0.6f), vec3(6.0f, 3.7f, 1.6f),
                                           vec3(2.6f, 4.1f, 7.0f)};

BuildingShape tower(RandomStream& random, vec2 centre, int least_floors, int more_floors) {
  const vec2 half(random.uniform(7.5f, 10), random.uniform(7.5f, 10));
  BuildingShape shape;
  shape.lo = centre - half;
  shape.hi = centre + half;
  shape.floors = least_floors + random.integer(more_floors);
  shape.ground_floor = 5;
  shape.floor_height = 3.6f;
  shape.bay = random.uniform(3.2f, 4.4f);
  shape.margin = vec2(0.8f, 1.2f);
  shape.shops = false;
  shape.pilasters = random.chance(0.5f);
  shape.bands = !shape.pilasters;
  shape.weight = random.uniform(0.3f, 1.7f);
  return shape;
}

// A slimmer storey block and a mast on some roofs.
void add_crown(const BuildingShape& shape, RandomStream& random, MeshBuilder& walls) {
  const float top = shape.height() - 0.4f;
  const vec2 inset = (shape.hi - shape.lo) * random.uniform(0.15f, 0.3f), lo = shape.lo + inset,
             hi = shape.hi - inset;
  walls.box(vec3(lo.x, top, lo.y), vec3(hi.x, top + random.uniform(2, 6), hi.y), kSides | kTop);
  if (!random.chance(0.4f)) return;
  const vec2 middle = 0.5f * (lo + hi);
  walls.cylinder(vec3(middle.x, top + 1, middle.y), vec3(middle.x, top + random.uniform(12, 20), middle.y),
                 0.3f, 0.1f, 8);
}

void add_windows(Scene& scene, const std::vector<WindowSlot>& windows, std::size_t triangles,
                 std::uint32_t seed) {
  const std::vector<bool> lit = choose_lit(windows, triangles, seed);
  std::array<MeshBuilder, kRadiance.size()> panes;
  for (std::size_t i = 0; i < windows.size(); ++i) {
    if (!lit[i]) continue;
    RandomStream random(seed, kTint, static_cast<std::uint32_t>(i));
    panes[static_cast<std::size_t>(random.integer(3))].quad(windows[i].corner, windows[i].u, windows[i].v);
  }
  for (std::size_t c = 0; c < panes.size(); ++c) {
    const std::string name = "lit windows " + std::to_string(c + 1);
    if (!panes[c].empty())
      add_static(scene, panes[c], name, add_emitter(scene, name, kRadiance[c], vec3(0.8f)));
  }
}

void add_cameras(Scene& scene) {
  const vec3 eye(31.85f, 81.4f, -49.9f);
  add_camera(scene, "above", eye, eye + vec3(-0.0903f, -0.6398f, 0.7632f), 60);
  const vec3 centre(0, 0, 0.4f * kPitch * kRows);
  const int hub = add_node(scene, "orbit", {}, centre);
  animate_rotation(scene, hub, kPeriod, 12, Interpolation::kLinear,
                   [](float t) { return axis_angle(vec3(0, 1, 0), 2 * kPi * t); });
  add_camera(scene, "orbiting", vec3(0, 90, 165), vec3(0, 15, 0), 50);
  scene.nodes.back().parent = hub;
}

Scene make(const Parameters& parameters) {
  Scene scene;
  const std::uint32_t seed = parameters.seed();
  MeshBuilder builder;
  builder.quad(vec3(-400, 0, 600), vec3(800, 0, 0), vec3(0, 0, -1000));
  add_static(scene, builder, "ground", add_surface(scene, "ground", vec3(0.8f)));
  std::vector<WindowSlot> windows;
  std::vector<Facade> facades;
  for (int j = -1; j < kRows; ++j)
    for (int i = 0; i < kColumns; ++i) {
      RandomStream random(seed, kShape, static_cast<std::uint32_t>(j * kColumns + i));
      const vec2 centre((static_cast<float>(i) - 0.5f * (kColumns - 1) + 0.7f) * kPitch,
                        static_cast<float>(j) * kPitch);
      const BuildingShape shape = j < 0 ? tower(random, centre, 6, 4) : tower(random, centre, 7, 13);
      add_building(shape, builder, windows, facades);
      add_crown(shape, random, builder);
    }
  add_static(scene, builder, "towers", add_surface(scene, "walls", vec3(0.8f)));
  add_windows(scene, windows, static_cast<std::size_t>(parameters.integer("lights")), seed);
  add_cameras(scene);
  return scene;
}

}  // namespace

Definition towers() {
  return {"towers",
          "towers lit by their windows alone: 4,600 emissive triangles",
          true,
          {{"lights",
            "4600",
            "emissive triangles, at most as many as there are windows (2 to 100000)",
            2,
            1e5,
            false,
            {}},
           seed_parameter()},
          make};
}

}  // namespace lumigrove::builtin
