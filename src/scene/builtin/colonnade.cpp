// `colonnade`: a two-storey arcade around an open court, coloured drapes between its columns, and no light
// but the sun through the open roof: nearly everything visible is lit indirectly. The sun wanders and the
// drapes sway.
#include <array>
#include <cmath>
#include <string>

#include "scene/builtin/builtin.h"
#include "scene/builtin/procedural_image.h"
#include "scene/builtin/random_stream.h"
#include "scene/builtin/scene_parts.h"

namespace lumigrove::builtin {
namespace {

// The court runs along x; metres.
constexpr float kBay = 3, kHalfCourt = 4, kAisle = 4, kWall = 0.5f;
constexpr float kSpringing = 3.1f, kArchTop = 5, kSlab = 0.3f;
constexpr float kUpperFloor = kArchTop + kSlab, kRoof = kUpperFloor + kArchTop;
constexpr float kPeriod = 8;  // seconds
enum Purpose : std::uint32_t { kStone, kDrape };

struct Materials {
  int stone, plaster, brick, tiles, trim;
};

Materials add_materials(Scene& scene, std::uint32_t seed) {
  Materials m{};
  m.stone = add_surface(scene, "stone", vec3(1), 0.9f);
  scene.materials[m.stone].base_color_texture = tiled(
      add_color_image(
          scene, "stone", 128,
          [=](vec2 p) { return (0.58f + 0.16f * tiling_noise(p, 9, 4, seed)) * vec3(1, 0.93f, 0.82f); }),
      vec2(2));
  m.plaster = add_surface(scene, "plaster", vec3(0.72f, 0.66f, 0.56f));
  m.brick = add_surface(scene, "brick", vec3(1));
  scene.materials[m.brick].base_color_texture = tiled(
      add_color_image(
          scene, "brick", 256,
          [=](vec2 p) {
            const BrickPoint brick = running_bond(p, 4, 12);
            RandomStream random(seed, kStone, static_cast<std::uint32_t>(brick.row * 64 + brick.column));
            const float shade =
                random.uniform(0.75f, 1.1f) * (0.9f + 0.2f * tiling_noise(p, 40, 2, seed + 9));
            return brick.edge < 0.06f ? vec3(0.55f, 0.5f, 0.44f) : shade * vec3(0.56f, 0.36f, 0.25f);
          }),
      vec2(1.6f));
  m.tiles = add_surface(scene, "floor tiles", vec3(1), 0.6f);
  scene.materials[m.tiles].base_color_texture = tiled(
      add_color_image(scene, "floor tiles", 256,
                      [=](vec2 p) {
                        const bool dark = (static_cast<int>(p.x * 4) + static_cast<int>(p.y * 4)) % 2 == 1;
                        const vec2 f = glm::abs(glm::fract(p * 4.0f) - 0.5f);
                        const float joint = std::max(f.x, f.y) > 0.485f ? 0.6f : 1.0f,
                                    vein = 0.88f + 0.24f * tiling_noise(p, 14, 4, seed + 3);
                        return joint * vein * (dark ? vec3(0.42f, 0.34f, 0.29f) : vec3(0.66f, 0.61f, 0.53f));
                      }),
      vec2(4));
  m.trim = add_surface(scene, "trim", vec3(0.66f, 0.6f, 0.5f), 0.8f);
  return m;
}

// One bay of an arcade in its own frame: x along the wall from pier centre to pier centre, y up, +z to the
// court. The opening is a half circle above `springing`.
void add_arch(MeshBuilder& builder, float springing, float top, float pier) {
  constexpr int kSegments = 16;
  const float radius = 0.5f * (kBay - pier), z = 0.5f * kWall;
  std::array<vec2, kSegments + 1> arc;
  for (int k = 0; k <= kSegments; ++k) {
    const float angle = kPi * (1 - static_cast<float>(k) / kSegments);
    arc[k] = vec2(0.5f * kBay + radius * cosine(angle),
                  springing + (k == 0 || k == kSegments ? 0.0f : radius * sine(angle)));
  }
  for (int k = 0; k < kSegments; ++k) {
    const vec2 a = arc[k], b = arc[k + 1];
    builder.polygon(std::array{vec3(a, z), vec3(b, z), vec3(b.x, top, z), vec3(a.x, top, z)});
    builder.polygon(std::array{vec3(b, -z), vec3(a, -z), vec3(a.x, top, -z), vec3(b.x, top, -z)});
    const auto inward = [&](vec2 p) { return vec3(0.5f * kBay - p.x, springing - p.y, 0); };
    const std::uint32_t first = builder.vertex(vec3(a, -z), inward(a), vec2(0, k));
    builder.vertex(vec3(b, -z), inward(b), vec2(0, k + 1));
    builder.vertex(vec3(b, z), inward(b), vec2(kWall, k + 1));
    builder.vertex(vec3(a, z), inward(a), vec2(kWall, k));
    builder.triangle(first, first + 1, first + 2);
    builder.triangle(first, first + 2, first + 3);
  }
  for (const float x : {0.0f, kBay - 0.5f * pier})  // the halves of the two piers
    builder.box(vec3(x, springing, -z), vec3(x + 0.5f * pier, top, z), kFront | kBack | kBottom);
}

// Base, shaft with entasis, capital; from y = 0 to `height`.
void add_column(MeshBuilder& round, float height, float radius) {
  const float r = radius;
  round.box(vec3(-1.5f * r, 0, -1.5f * r), vec3(1.5f * r, 0.18f, 1.5f * r), kSides | kTop);
  round.box(vec3(-1.45f * r, height - 0.14f, -1.45f * r), vec3(1.45f * r, height, 1.45f * r));
  const float neck = height - 0.5f;
  const vec2 profile[] = {{1.35f * r, 0.18f},      {1.4f * r, 0.25f},         {1.3f * r, 0.32f},
                          {1.05f * r, 0.36f},      {1.0f * r, 0.45f},         {0.98f * r, 0.4f * neck},
                          {0.86f * r, neck},       {1.0f * r, neck + 0.03f},  {1.0f * r, neck + 0.08f},
                          {0.9f * r, neck + 0.1f}, {1.05f * r, neck + 0.25f}, {1.4f * r, height - 0.14f}};
  round.lathe(vec3(0), profile, 24, true);
}

void add_arcades(Scene& scene, const Materials& m, int bays) {
  MeshBuilder builder;
  add_arch(builder, kSpringing, kArchTop, 0.7f);
  const int lower_arch = add_mesh(scene, builder, "arch", m.stone);
  add_arch(builder, kSpringing - 0.3f, kArchTop, 0.6f);
  const int upper_arch = add_mesh(scene, builder, "upper arch", m.stone);
  add_column(builder, kSpringing, 0.3f);
  const int column = add_mesh(scene, builder, "column", m.trim);
  add_column(builder, kSpringing - 0.3f, 0.22f);
  const int upper_column = add_mesh(scene, builder, "upper column", m.trim);
  const float start = -0.5f * kBay * static_cast<float>(bays);
  for (const float side : {-1.0f, 1.0f}) {
    const vec4 turn = axis_angle(vec3(0, 1, 0), side > 0 ? kPi : 0.0f);  // +z looks into the court
    for (int k = 0; k <= bays; ++k) {
      const vec3 at(side * -(start + kBay * static_cast<float>(k)), 0, side * (kHalfCourt + 0.5f * kWall));
      const vec3 up(0, kUpperFloor, 0);
      if (k > 0 && k < bays) {  // the end piers are part of the end walls
        add_node(scene, "column", {column}, at, turn);
        add_node(scene, "upper column", {upper_column}, at + up, turn);
      }
      if (k == bays) continue;
      add_node(scene, "arch", {lower_arch}, at, turn);
      add_node(scene, "upper arch", {upper_arch}, at + up, turn);
    }
  }
}

// Floors, aisle ceilings, outer walls and end walls.
void add_shell(Scene& scene, const Materials& m, int bays) {
  const float half = 0.5f * kBay * static_cast<float>(bays), depth = kHalfCourt + kWall + kAisle;
  MeshBuilder floor, plaster, brick, trim, door;
  floor.quad(vec3(-half, 0, depth), vec3(2 * half, 0, 0), vec3(0, 0, -2 * depth));
  for (const float side : {-1.0f, 1.0f}) {
    const float inner = side * kHalfCourt, outer = side * depth;
    const float lo = std::min(inner, outer), hi = std::max(inner, outer);
    const auto slab = [&](MeshBuilder& builder, float y) {
      builder.box(vec3(-half, y, lo), vec3(half, y + kSlab, hi));
    };
    slab(plaster, kArchTop);
    slab(plaster, kRoof);
    const float edge_lo = std::min(inner - side * 0.15f, inner),
                edge_hi = std::max(inner - side * 0.15f, inner);
    for (const float y : {kArchTop, kRoof})
      trim.box(vec3(-half, y - 0.05f, edge_lo), vec3(half, y + kSlab + 0.05f, edge_hi));
    // Balustrade of the upper storey, set a little back behind its columns' faces.
    const float rail = side * (kHalfCourt + 0.5f * kWall);
    trim.box(vec3(-half, kUpperFloor + 0.85f, rail - 0.1f), vec3(half, kUpperFloor + 0.97f, rail + 0.1f));
    const int posts = 6 * bays;
    for (int k = 0; k < posts; ++k) {
      const float x = -half + (static_cast<float>(k) + 0.5f) * 2 * half / static_cast<float>(posts);
      trim.cylinder(vec3(x, kUpperFloor, rail), vec3(x, kUpperFloor + 0.85f, rail), 0.06f, 0.045f, 8, false);
    }
    const float wall_lo = side > 0 ? depth : -depth - kWall, wall_hi = side > 0 ? depth + kWall : -depth;
    brick.box(vec3(-half - kWall, 0, wall_lo), vec3(half + kWall, kRoof + 1.2f, wall_hi));
    brick.box(vec3(side > 0 ? half : -half - kWall, 0, -depth),
              vec3(side > 0 ? half + kWall : -half, kRoof + 1.2f, depth));
    // The mouldings go on along the end walls, where a door leads out.
    const float end_lo = side > 0 ? half - 0.15f : -half, end_hi = side > 0 ? half : -half + 0.15f;
    for (const float y : {kArchTop, kRoof})
      trim.box(vec3(end_lo, y - 0.05f, -kHalfCourt), vec3(end_hi, y + kSlab + 0.05f, kHalfCourt));
    for (const float z : {-1.5f, 1.2f}) trim.box(vec3(end_lo, 0, z), vec3(end_hi, 3.6f, z + 0.3f));
    trim.box(vec3(end_lo, 3.6f, -1.7f), vec3(end_hi, 4.0f, 1.7f));
    const float door_lo = side > 0 ? half - 0.05f : -half, door_hi = side > 0 ? half : -half + 0.05f;
    for (const float z : {-1.2f, 0.01f}) door.box(vec3(door_lo, 0, z), vec3(door_hi, 3.6f, z + 1.19f));
    for (int k = 1; k < bays; ++k) {  // ceiling beams over the aisles
      const float x = -half + kBay * static_cast<float>(k);
      const float from = side > 0 ? kHalfCourt + kWall : -depth, to = side > 0 ? depth : -kHalfCourt - kWall;
      for (const float y : {kArchTop, kRoof}) trim.box(vec3(x - 0.2f, y - 0.3f, from), vec3(x + 0.2f, y, to));
    }
  }
  add_static(scene, floor, "floor", m.tiles);
  add_static(scene, plaster, "slabs", m.plaster);
  add_static(scene, brick, "walls", m.brick);
  add_static(scene, trim, "mouldings", m.trim);
  add_static(scene, door, "doors", add_surface(scene, "door", vec3(0.22f, 0.11f, 0.06f), 0.5f));
}

constexpr std::array<vec3, 5> kDrapeColors = {vec3(0.62f, 0.05f, 0.04f), vec3(0.06f, 0.30f, 0.10f),
                                              vec3(0.05f, 0.12f, 0.52f), vec3(0.68f, 0.42f, 0.05f),
                                              vec3(0.40f, 0.06f, 0.36f)};

// Hangs from the x axis down to -`drop`, facing +z, folds deepening downwards; both sides are cloth.
int add_drape(Scene& scene, int color, float width, float drop) {
  const std::string name = "drape " + std::to_string(color + 1);
  const int material = add_surface(scene, name, kDrapeColors[static_cast<std::size_t>(color)]);
  scene.materials[material].double_sided = true;
  MeshBuilder builder;
  builder.sheet(
      [=](float s, float t) {
        const float folds = (0.03f + 0.07f * (1 - t)) * sine(2 * kPi * (5 * s + 0.1f * sine(6 * t)));
        const float gather = 1 - 0.12f * (1 - t) * (1 - t);
        return vec3((s - 0.5f) * width * gather, (t - 1) * drop, folds);
      },
      48, 10);
  return add_mesh(scene, builder, name, material);
}

void add_drapes(Scene& scene, int bays, std::uint32_t seed) {
  std::array<int, kDrapeColors.size()> drapes{};
  for (std::size_t c = 0; c < drapes.size(); ++c)
    drapes[c] = add_drape(scene, static_cast<int>(c), 1.9f, 3.3f);
  MeshBuilder builder;
  builder.cylinder(vec3(-1.05f, 0.01f, 0), vec3(1.05f, 0.01f, 0), 0.025f, 0.025f, 8);
  const int brass = add_surface(scene, "brass", vec3(0.75f, 0.55f, 0.25f), 0.4f, 1);
  const int rod = add_mesh(scene, builder, "rod", brass);
  for (const float x : {-1.0f, 1.0f})
    builder.cylinder(vec3(x, 0, 0), vec3(x, -0.03f, 0.6f), 0.018f, 0.018f, 6);
  const int brackets = add_mesh(scene, builder, "brackets", brass);
  const float start = -0.5f * kBay * static_cast<float>(bays);
  for (const float side : {-1.0f, 1.0f})
    for (int k = 0; k < bays; ++k) {
      RandomStream random(seed, kDrape, static_cast<std::uint32_t>(2 * k + (side > 0 ? 1 : 0)));
      const int color = random.integer(static_cast<int>(drapes.size()));
      const bool upper = random.chance(0.3f);
      if (random.chance(0.2f)) continue;
      // Below they hang behind the arches; from the balustrade they hang into the court.
      const vec3 at(start + kBay * (static_cast<float>(k) + 0.5f), upper ? kUpperFloor + 0.98f : 4.2f,
                    side * (upper ? kHalfCourt - 0.33f : kHalfCourt + kWall + 0.25f));
      const vec4 turn = axis_angle(vec3(0, 1, 0), side > 0 ? 0.0f : kPi);
      add_node(scene, "rod", upper ? std::vector{rod, brackets} : std::vector{rod}, at, turn);
      const int node = add_node(scene, "drape", {drapes[static_cast<std::size_t>(color)]}, at);
      const float phase = random.uniform(), swing = random.uniform(0.01f, 0.035f);
      animate_rotation(scene, node, kPeriod, 8, Interpolation::kCubicSpline, [=](float t) {
        return axis_angle(vec3(1, 0, 0), swing * sine(2 * kPi * (t + phase)));
      });
    }
}

// A basin in the middle of the court and a row of planters.
void add_court(Scene& scene, const Materials& m, int bays) {
  MeshBuilder builder;
  const vec2 basin[] = {{1.5f, 0},      {1.6f, 0.12f}, {1.45f, 0.2f},  {1.5f, 0.6f},
                        {1.62f, 0.68f}, {1.6f, 0.75f}, {1.35f, 0.75f}, {1.3f, 0.3f},
                        {0.3f, 0.3f},   {0.2f, 0.5f},  {0.16f, 1.1f},  {0.75f, 1.3f},
                        {0.78f, 1.36f}, {0.1f, 1.3f},  {0.09f, 1.7f},  {0, 1.75f}};
  builder.lathe(vec3(0), basin, 48, false);
  add_static(scene, builder, "fountain", m.trim);
  const vec2 pot[] = {{0.22f, 0},    {0.34f, 0.35f}, {0.36f, 0.5f},  {0.4f, 0.52f},
                      {0.4f, 0.58f}, {0.33f, 0.58f}, {0.32f, 0.45f}, {0, 0.45f}};
  builder.lathe(vec3(0), pot, 20, false);
  const int planter =
      add_mesh(scene, builder, "planter", add_surface(scene, "terracotta", vec3(0.55f, 0.28f, 0.17f)));
  builder.icosphere(vec3(0, 0.95f, 0), 0.5f, 3);
  const int bush = add_mesh(scene, builder, "bush", add_surface(scene, "leaves", vec3(0.16f, 0.32f, 0.09f)));
  for (int k = 0; k < bays; ++k)
    for (const float side : {-1.0f, 1.0f}) {
      if (k % 2 == 0) continue;
      const float x = kBay * (static_cast<float>(k) + 0.5f - 0.5f * static_cast<float>(bays));
      add_node(scene, "planter", {planter, bush}, vec3(x + 1.5f, 0, side * (kHalfCourt - 0.7f)));
    }
}

void add_sun(Scene& scene, float elevation_degrees) {
  PunctualLight sun;
  sun.name = "sun";
  sun.type = LightType::kDirectional;
  sun.color = vec3(11, 9.7f, 7.9f);
  const auto towards = [=](float azimuth) {
    const float elevation = elevation_degrees * kPi / 180;
    return vec3(cosine(elevation) * cosine(azimuth), sine(elevation), cosine(elevation) * sine(azimuth));
  };
  const int node = add_light_node(scene, sun, vec3(0, 30, 0), looking_along(-towards(1.16f)));
  animate_rotation(scene, node, kPeriod, 12, Interpolation::kLinear,
                   [=](float t) { return looking_along(-towards(1.16f + 0.12f * sine(2 * kPi * t))); });
}

Scene make(const Parameters& parameters) {
  Scene scene;
  const int bays = parameters.integer("bays");
  const Materials materials = add_materials(scene, parameters.seed());
  add_shell(scene, materials, bays);
  add_arcades(scene, materials, bays);
  add_court(scene, materials, bays);
  add_drapes(scene, bays, parameters.seed());
  add_sun(scene, parameters.real("sun"));
  const float end = 0.5f * kBay * static_cast<float>(bays);
  add_camera(scene, "court", vec3(-end + 1.2f, 2.3f, 2.6f), vec3(end, 2.9f, -2.5f), 54);
  add_camera(scene, "gallery", vec3(-end + 1.5f, kUpperFloor + 1.7f, kHalfCourt + 2),
             vec3(end * 0.4f, 3.2f, -kHalfCourt), 55);
  return scene;
}

}  // namespace

Definition colonnade() {
  return {"colonnade",
          "two-storey arcade with coloured drapes, lit by the sun through the open roof",
          true,
          {{"bays", "9", "arches on each side (3 to 60)", 3, 60, false, {}},
           {"sun", "72", "elevation of the sun in degrees (10 to 89)", 10, 89, true, {}},
           seed_parameter()},
          make};
}

}  // namespace lumigrove::builtin
