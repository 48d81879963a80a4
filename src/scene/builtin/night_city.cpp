// `night-city`: streets at night lit by nothing but tens of thousands of local lights: windows, shop fronts,
// street lamps, neon lettering, swinging strings of bulbs, wall lanterns, drifting kites and traffic. The
// budget `lights` is shared out over the kinds; windows take what the others leave, so that the total comes
// near it.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "scene/builtin/building.h"
#include "scene/builtin/builtin.h"
#include "scene/builtin/neon.h"
#include "scene/builtin/procedural_image.h"
#include "scene/builtin/random_stream.h"
#include "scene/builtin/scene_parts.h"

namespace lumigrove::builtin {
namespace {

constexpr float kLot = 56, kStreet = 16, kPitch = kLot + kStreet;  // metres
constexpr float kHalfRoad = 5.2f, kCurb = 0.15f;
constexpr float kPeriod = 8;        // seconds
constexpr float kBrightness = 2;    // of all lights together; their figures are relative to one another
constexpr vec3 kBlackMetal(0.02f);  // what stands right beside lights
constexpr float kBulbShare = 0.22f, kNeonShare = 0.12f, kLampShare = 0.04f, kLanternShare = 0.3f;
constexpr std::size_t kMostLamps = 3000;
enum Purpose : std::uint32_t { kPlan, kWindowColor, kGlowColor, kBulb, kSign, kTraffic, kKite, kStains };

// The grid of streets. Street k runs along x or z at line(k); the middle one along z is where the camera
// stands.
struct Plan {
  int blocks;
  std::uint32_t seed;
  float line(int k) const { return kPitch * static_cast<float>(k - blocks / 2); }
  int streets() const { return blocks + 1; }
  float lo() const { return line(0); }
  float hi() const { return line(blocks); }
  float camera_z() const { return kPitch - 18.5f; }  // past a crossing
};

struct City {
  Scene scene;
  Plan plan;
  std::vector<WindowSlot> windows;
  std::vector<Facade> facades;
  std::size_t emissive = 0;  // triangles placed so far
};

// --- ground
// ---------------------------------------------------------------------------------------------------

// Wet asphalt: roughness falls in puddles, where the colour darkens too.
int add_asphalt(Scene& scene, std::uint32_t seed) {
  constexpr int kSize = 256;
  const vec2 tile(14);  // metres
  const auto puddle = [=](vec2 p) {
    return glm::smoothstep(0.48f, 0.56f, tiling_noise(p, 7, 3, seed ^ 0x77u));
  };
  const auto grain = [=](vec2 p) { return tiling_noise(p, 90, 1, seed ^ 0x1234u); };
  const int material = add_surface(scene, "wet asphalt", vec3(1));
  const int color = add_color_image(scene, "asphalt", kSize, [&](vec2 p) {
    return glm::mix(0.19f + 0.14f * grain(p), 0.11f + 0.03f * grain(p), puddle(p)) * vec3(1, 1, 1.06f);
  });
  const int roughness = add_roughness_image(scene, "asphalt roughness", kSize, [&](vec2 p) {
    return glm::mix(0.62f + 0.2f * grain(p), 0.4f, puddle(p));
  });
  scene.materials[material].base_color_texture = tiled(color, tile);
  scene.materials[material].metallic_roughness_texture = tiled(roughness, tile);
  return material;
}

void add_ground(City& city) {
  Scene& scene = city.scene;
  const int asphalt = add_asphalt(scene, city.plan.seed);
  MeshBuilder builder;
  const float edge = city.plan.hi() + 60;
  builder.quad(vec3(-edge, 0, edge), vec3(2 * edge, 0, 0), vec3(0, 0, -2 * edge));
  add_static(scene, builder, "road", asphalt);

  for (int i = 0; i < city.plan.blocks; ++i)
    for (int j = 0; j < city.plan.blocks; ++j)
      builder.box(vec3(city.plan.line(i) + kHalfRoad, 0, city.plan.line(j) + kHalfRoad),
                  vec3(city.plan.line(i + 1) - kHalfRoad, kCurb, city.plan.line(j + 1) - kHalfRoad),
                  kSides | kTop);
  add_static(scene, builder, "pavement", add_surface(scene, "pavement", vec3(0.42f, 0.41f, 0.38f), 0.7f));
}

// Dashes along the middle of every street and zebra crossings, a centimetre above the road.
void add_markings(City& city) {
  MeshBuilder builder;
  const auto rectangle = [&](bool along_x, float line, float at, float length, float across, float width) {
    const vec3 corner = along_x ? vec3(at, 0.01f, line + across + width / 2)
                                : vec3(line + across - width / 2, 0.01f, at + length);
    builder.quad(corner, along_x ? vec3(length, 0, 0) : vec3(width, 0, 0),
                 along_x ? vec3(0, 0, -width) : vec3(0, 0, -length));
  };
  for (const bool along_x : {false, true})
    for (int k = 0; k < city.plan.streets(); ++k)
      for (int b = 0; b < city.plan.blocks; ++b) {
        const float line = city.plan.line(k), from = city.plan.line(b) + 11, to = city.plan.line(b + 1) - 11;
        for (float at = from; at + 2 <= to; at += 5) rectangle(along_x, line, at, 2, 0, 0.14f);
        for (const float at : {from - 4.5f, to + 2.0f})
          for (float across = -4.2f; across < 4.5f; across += 1.2f)
            rectangle(along_x, line, at, 2.5f, across, 0.5f);
      }
  add_static(city.scene, builder, "road markings",
             add_surface(city.scene, "road paint", vec3(0.62f, 0.62f, 0.58f), 0.5f));
}

// --- buildings
// ------------------------------------------------------------------------------------------------

constexpr std::array<vec3, 5> kWallColors = {vec3(0.46f, 0.30f, 0.23f), vec3(0.55f, 0.52f, 0.47f),
                                             vec3(0.36f, 0.36f, 0.38f), vec3(0.60f, 0.50f, 0.38f),
                                             vec3(0.42f, 0.45f, 0.50f)};
using WallBuilders = std::array<MeshBuilder, kWallColors.size()>;

void add_rooftop(const BuildingShape& shape, RandomStream& random, MeshBuilder& walls) {
  const float top = shape.height() - 0.4f;
  for (int k = 0; k < 3; ++k) {
    const vec2 size(random.uniform(1.5f, 5), random.uniform(1.5f, 5));
    const vec2 at =
        shape.lo + 1.0f + (shape.hi - shape.lo - size - 2.0f) * vec2(random.uniform(), random.uniform());
    walls.box(vec3(at.x, top, at.y), vec3(at.x + size.x, top + random.uniform(1, 3.2f), at.y + size.y),
              kSides | kTop);
  }
}

void add_block(City& city, int i, int j, WallBuilders& walls) {
  RandomStream random(city.plan.seed, kPlan, static_cast<std::uint32_t>(i * 64 + j));
  const vec2 lo(city.plan.line(i) + kStreet / 2, city.plan.line(j) + kStreet / 2);
  const int nx = 2 + random.integer(2), nz = 2 + random.integer(2);
  const vec2 lot = vec2(kLot) / vec2(nx, nz);
  for (int a = 0; a < nx; ++a)
    for (int b = 0; b < nz; ++b) {
      BuildingShape shape;
      const vec2 gap(a + 1 < nx ? 1.5f : 0.0f, b + 1 < nz ? 1.5f : 0.0f);  // alleys inside the block
      shape.lo = lo + lot * vec2(a, b);
      shape.hi = shape.lo + lot - gap;
      shape.base = kCurb;
      shape.windowed = (a == 0 ? kLeft : 0u) | (a + 1 == nx ? kRight : 0u) | (b == 0 ? kBack : 0u) |
                       (b + 1 == nz ? kFront : 0u);
      shape.floors = 4 + random.integer(6) + (random.chance(0.22f) ? 5 + random.integer(8) : 0);
      shape.floor_height = random.uniform(3.1f, 3.7f);
      shape.bay = random.uniform(2.9f, 4.2f);
      shape.pilasters = random.chance(0.6f);
      shape.bands = !shape.pilasters || random.chance(0.5f);
      shape.weight = random.uniform(0.4f, 1.6f);
      shape.panes_across = 1 + random.integer(2);
      shape.panes_down = 1 + random.integer(2);
      MeshBuilder& builder = walls[static_cast<std::size_t>(random.integer(static_cast<int>(walls.size())))];
      add_building(shape, builder, city.windows, city.facades);
      add_rooftop(shape, random, builder);
    }
}

// A tower at the far end closes the view along the main street.
void add_landmark(City& city, MeshBuilder& walls) {
  BuildingShape shape;
  const float x = city.plan.line(city.plan.blocks / 2), z = city.plan.lo() - kStreet / 2;
  shape.lo = vec2(x - 17, z - 30);
  shape.hi = vec2(x + 17, z);
  shape.floors = 24;
  shape.weight = 2;
  add_building(shape, walls, city.windows, city.facades);
}

void add_buildings(City& city) {
  WallBuilders walls;
  for (int i = 0; i < city.plan.blocks; ++i)
    for (int j = 0; j < city.plan.blocks; ++j) add_block(city, i, j, walls);
  add_landmark(city, walls[2]);
  for (std::size_t k = 0; k < walls.size(); ++k) {
    const std::string name = "walls " + std::to_string(k + 1);
    add_static(city.scene, walls[k], name, add_surface(city.scene, name, kWallColors[k], 0.9f));
  }
}

// --- windows
// --------------------------------------------------------------------------------------------------

// The last two are for shops.
constexpr std::array<vec3, 9> kWindowRadiance = {
    vec3(0.65f, 0.39f, 0.16f),  vec3(0.39f, 0.23f, 0.091f), vec3(0.72f, 0.49f, 0.25f),
    vec3(0.39f, 0.39f, 0.36f),  vec3(0.23f, 0.13f, 0.052f), vec3(0.078f, 0.16f, 0.36f),
    vec3(0.33f, 0.16f, 0.052f), vec3(0.85f, 0.59f, 0.27f),  vec3(0.52f, 0.59f, 0.65f)};

// Lights windows of together about `triangles`; panes are cut finer when there are too few.
void add_windows(City& city, std::size_t triangles) {
  std::size_t available = 0;
  for (const WindowSlot& slot : city.windows) available += slot.triangles();
  int cuts = 1;
  while (static_cast<std::size_t>(cuts * cuts) * available < triangles) ++cuts;
  for (WindowSlot& slot : city.windows) slot.across *= cuts, slot.down *= cuts;
  const std::vector<bool> lit = choose_lit(city.windows, triangles, city.plan.seed);
  std::array<MeshBuilder, kWindowRadiance.size()> panes;
  MeshBuilder dark;
  for (std::size_t i = 0; i < city.windows.size(); ++i) {
    const WindowSlot& slot = city.windows[i];
    // Unlit glass, or the frame seen between lit panes.
    const vec3 behind = lit[i] ? -0.01f * glm::normalize(glm::cross(slot.u, slot.v)) : vec3(0);
    dark.quad(slot.corner + behind, slot.u, slot.v);
    if (!lit[i]) continue;
    RandomStream random(city.plan.seed, kWindowColor, static_cast<std::uint32_t>(i));
    const std::size_t color = static_cast<std::size_t>(slot.shop ? 7 + random.integer(2) : random.integer(7));
    add_panes(panes[color], slot, 0.07f / static_cast<float>(cuts));
  }
  for (std::size_t c = 0; c < panes.size(); ++c) {
    const std::string name = "lit windows " + std::to_string(c + 1);
    city.emissive += panes[c].triangle_count();
    if (!panes[c].empty())
      add_static(city.scene, panes[c], name, add_emitter(city.scene, name, kWindowRadiance[c], vec3(0.1f)));
  }
  add_static(city.scene, dark, "dark windows",
             add_surface(city.scene, "dark glass", vec3(0.04f, 0.05f, 0.06f), 0.3f));
}

// --- street lamps
// ---------------------------------------------------------------------------------------------

struct LampModel {
  int post, lens;
  std::size_t lens_triangles;
};
// Origin at the foot; the arm reaches along +x over the road.
LampModel add_lamp_model(Scene& scene) {
  MeshBuilder builder;
  builder.cylinder(vec3(0), vec3(0, 4.8f, 0), 0.09f, 0.06f, 8);
  builder.cylinder(vec3(-0.02f, 4.75f, 0), vec3(1.5f, 5.1f, 0), 0.05f, 0.045f, 6);
  builder.box(vec3(1.3f, 5.06f, -0.2f), vec3(2.1f, 5.2f, 0.2f));
  LampModel model{};
  model.post =
      add_mesh(scene, builder, "lamp post", add_surface(scene, "lamp post", vec3(0.1f, 0.11f, 0.12f), 0.5f));
  std::vector<vec3> rim;
  for (int k = 0; k < 8; ++k)  // counter-clockwise seen from below
    rim.emplace_back(1.7f + 0.3f * cosine(kPi * static_cast<float>(k) / 4), 5.05f,
                     0.17f * sine(kPi * static_cast<float>(k) / 4));
  builder.polygon(rim);
  model.lens_triangles = builder.triangle_count();
  model.lens = add_mesh(scene, builder, "lamp lens", add_emitter(scene, "lamp lens", vec3(150, 97, 45)));
  return model;
}

// Evenly along both kerbs of every street.
void add_lamps(City& city, std::size_t triangles) {
  const LampModel model = add_lamp_model(city.scene);
  const std::size_t kerbs = 4 * static_cast<std::size_t>(city.plan.streets() * city.plan.blocks);
  const std::size_t wanted = std::min(kMostLamps, triangles / model.lens_triangles);
  const int each = std::max(1, static_cast<int>((wanted + kerbs / 2) / kerbs));
  for (const bool along_x : {false, true})
    for (int k = 0; k < city.plan.streets(); ++k)
      for (int b = 0; b < city.plan.blocks; ++b)
        for (const float side : {-1.0f, 1.0f})
          for (int i = 0; i < each; ++i) {
            const float spacing = (kPitch - 2 * kHalfRoad - 3) / static_cast<float>(each);
            const float shift = side > 0 ? 0.3f : 0.7f;  // the two kerbs alternate
            const float at = city.plan.line(b) + kHalfRoad + 1.5f + spacing * (static_cast<float>(i) + shift);
            const float line = city.plan.line(k) + side * (kHalfRoad + 0.5f);
            const float turn = along_x ? side * kPi / 2 : (side > 0 ? kPi : 0.0f);
            add_node(city.scene, "lamp", {model.post, model.lens},
                     along_x ? vec3(at, kCurb, line) : vec3(line, kCurb, at),
                     axis_angle(vec3(0, 1, 0), turn));
            city.emissive += model.lens_triangles;
          }
}

// --- wall lanterns

// Small globes on brackets along every street wall: pools of light a few metres wide.
void add_wall_lanterns(City& city, std::size_t triangles, int subdivisions) {
  constexpr float kHeight = 2.9f, kReach = 0.75f, kRadius = 0.11f;
  constexpr std::array<vec3, 3> kGlow = {vec3(30, 19, 8), vec3(30, 14, 4), vec3(24, 22, 17)};
  MeshBuilder brackets;
  std::array<MeshBuilder, kGlow.size()> globes;
  float length = 0;
  for (const Facade& wall : city.facades) length += wall.width;
  const float each = 20 * std::pow(4.0f, static_cast<float>(subdivisions));
  const float spacing = length * each / static_cast<float>(triangles);
  float next = 0.5f * spacing;  // from the left end of the wall, carried from wall to wall
  for (const Facade& wall : city.facades) {
    RandomStream random(city.plan.seed, kGlowColor, static_cast<std::uint32_t>(&wall - city.facades.data()));
    const auto color = static_cast<std::size_t>(random.integer(kGlow.size()));
    const vec3 left = wall.origin + vec3(0, kHeight, 0);
    for (; next < wall.width; next += spacing) {
      const vec3 globe = left + wall.along * next + wall.normal * kReach;
      globes[color].icosphere(globe, kRadius, subdivisions);
      brackets.cylinder(globe - wall.normal * kReach + vec3(0, 0.3f, 0), globe + vec3(0, 0.3f, 0), 0.02f,
                        0.02f, 4);
      brackets.cylinder(globe + vec3(0, 0.3f, 0), globe + vec3(0, kRadius, 0), 0.01f, 0.01f, 4);
    }
    next -= wall.width;
  }
  add_static(city.scene, brackets, "brackets", add_surface(city.scene, "bracket", kBlackMetal, 0.6f, 1));
  for (std::size_t c = 0; c < globes.size(); ++c) {
    const std::string name = "wall lanterns " + std::to_string(c + 1);
    city.emissive += globes[c].triangle_count();
    if (!globes[c].empty()) add_static(city.scene, globes[c], name, add_emitter(city.scene, name, kGlow[c]));
  }
}

// --- strings of bulbs
// -----------------------------------------------------------------------------------------

constexpr std::array<vec3, 6> kBulbRadiance = {vec3(31, 16, 3.2f), vec3(32, 1, 0.61f), vec3(1.2f, 26, 2),
                                               vec3(1, 4.4f, 44),  vec3(29, 1.2f, 23), vec3(29, 19, 1)};
constexpr int kBulbsPerColor = 6, kBulbsPerString = 3 * kBulbsPerColor;
constexpr float kBulbRadius = 0.13f;
constexpr float kMainStreetShare = 0.3f;  // of strings and signs

struct StringModel {
  std::vector<int> meshes;  // wire, then three colours
  std::size_t triangles = 0;
};
// Hang along +x from the origin to (kStreet,0,0); every second string has the other three colours.
std::array<StringModel, 2> add_string_models(Scene& scene, int subdivisions) {
  const auto hang = [](float s) { return vec3(kStreet * s, -4.4f * s * (1 - s), 0); };
  MeshBuilder builder;
  constexpr int kPieces = 16;
  for (int i = 0; i < kPieces; ++i)
    builder.cylinder(hang(static_cast<float>(i) / kPieces), hang(static_cast<float>(i + 1) / kPieces), 0.012f,
                     0.012f, 4, false);
  const int wire = add_mesh(scene, builder, "wire", add_surface(scene, "wire", kBlackMetal, 0.6f, 1));
  std::array<StringModel, 2> models = {StringModel{{wire}}, StringModel{{wire}}};
  for (std::size_t c = 0; c < kBulbRadiance.size(); ++c) {
    for (int k = static_cast<int>(c % 3); k < kBulbsPerString; k += 3)
      builder.icosphere(
          hang(glm::mix(0.1f, 0.9f, static_cast<float>(k) / (kBulbsPerString - 1))) - vec3(0, 0.25f, 0),
          kBulbRadius, subdivisions);
    models[c / 3].triangles += builder.triangle_count();
    const std::string name = "bulbs " + std::to_string(c + 1);
    models[c / 3].meshes.push_back(
        add_mesh(scene, builder, name, add_emitter(scene, name, kBulbRadiance[c])));
  }
  return models;
}

struct StringSpot {
  vec3 anchor;
  bool along_x;  // spans a street that runs along z
};
// `count` places for strings, evenly over the main street and, apart from that, over all the others.
std::vector<StringSpot> string_spots(const Plan& plan, int count) {
  std::vector<StringSpot> spots;
  const auto fill_block = [&](bool along_z, float line, float from, int strings) {
    for (int i = 0; i < strings; ++i) {
      const float at =
          from + 0.5f * kStreet + kLot * (static_cast<float>(i) + 0.5f) / static_cast<float>(strings);
      spots.push_back(along_z ? StringSpot{vec3(line - kStreet / 2, 0, at), true}
                              : StringSpot{vec3(at, 0, line + kStreet / 2), false});
    }
  };
  const auto portion = [](int total, int i, int n) { return total * (i + 1) / n - total * i / n; };
  const int main = static_cast<int>(kMainStreetShare * static_cast<float>(count));
  const int blocks = (2 * plan.streets() - 1) * plan.blocks;
  int block = 0;
  for (const bool along_z : {true, false})
    for (int k = 0; k < plan.streets(); ++k)
      for (int b = 0; b < plan.blocks; ++b) {
        const bool main_street = along_z && k == plan.blocks / 2;
        const int strings =
            main_street ? portion(main, b, plan.blocks) : portion(count - main, block++, blocks);
        fill_block(along_z, plan.line(k), plan.line(b), strings);
      }
  return spots;
}

void add_strings(City& city, std::size_t triangles, int subdivisions) {
  const std::array<StringModel, 2> models = add_string_models(city.scene, subdivisions);
  const int wanted = std::max(1, static_cast<int>(triangles / models[0].triangles));
  std::uint32_t index = 0;
  for (const StringSpot& spot : string_spots(city.plan, wanted)) {
    RandomStream random(city.plan.seed, kBulb, index);
    const StringModel& model = models[index++ % 2];
    const vec3 anchor = spot.anchor + vec3(0, random.uniform(6.2f, 7.6f), 0);
    const int stand =
        add_node(city.scene, "string", {}, anchor, axis_angle(vec3(0, 1, 0), spot.along_x ? 0.0f : kPi / 2));
    const int swing = add_node(city.scene, "swinging bulbs", model.meshes, vec3(0), vec4(0, 0, 0, 1), stand);
    const float phase = random.uniform(), angle = random.uniform(0.15f, 0.4f);
    const float beats = static_cast<float>(2 + random.integer(2));
    animate_rotation(city.scene, swing, kPeriod, 12, Interpolation::kCubicSpline, [=](float t) {
      return axis_angle(vec3(1, 0, 0), angle * sine(2 * kPi * (beats * t + phase)));
    });
    city.emissive += model.triangles;
  }
}

// --- neon signs
// -----------------------------------------------------------------------------------------------

constexpr std::array<vec3, 6> kNeonRadiance = {vec3(46, 1, 2.4f),  vec3(1, 8.4f, 55),   vec3(0.84f, 38, 10),
                                               vec3(42, 1.4f, 34), vec3(46, 13, 0.63f), vec3(1.3f, 31, 38)};
constexpr std::array<std::string_view, 14> kWords = {"HOTEL",   "CAFE",  "BAR",     "JAZZ",  "OPEN",
                                                     "CINEMA",  "CLUB",  "NOODLES", "PIZZA", "DANCE",
                                                     "KARAOKE", "BOOKS", "TAXI",    "LUX"};
using NeonBuilders = std::array<MeshBuilder, kNeonRadiance.size()>;

// Letters downwards on both faces of a board that stands out from the wall at `at` metres along it.
void add_blade_sign(const Facade& wall, float at, std::string_view word, float height, MeshBuilder& tubes,
                    MeshBuilder& boards) {
  const vec2 size = neon_word_size(word, height, true);
  const float width = size.x + 0.3f, bottom = 4.8f;
  const vec3 foot = wall.origin + wall.along * at;
  // Frame of the board: x out of the wall, y up, z against the wall's direction.
  const mat4 frame(vec4(wall.normal, 0), vec4(0, 1, 0, 0), vec4(-wall.along, 0), vec4(foot, 1));
  boards.set_transform(frame);
  boards.box(vec3(0.7f, bottom - 0.2f, -0.06f), vec3(0.7f + width, bottom + size.y + 0.2f, 0.06f));
  boards.box(vec3(-0.1f, bottom + 0.3f, -0.03f), vec3(0.71f, bottom + 0.4f, 0.03f));
  boards.set_transform(mat4(1));
  tubes.set_transform(frame);
  add_neon_word(tubes, word, vec3(0.85f, bottom, 0.2f), height, true);
  const mat4 other(vec4(-wall.normal, 0), vec4(0, 1, 0, 0), vec4(wall.along, 0), vec4(foot, 1));
  tubes.set_transform(other);
  add_neon_word(tubes, word, vec3(-0.85f - size.x, bottom, 0.2f), height, true);
  tubes.set_transform(mat4(1));
}

// Letters in a row on a board flat on the wall, over the ground floor.
void add_front_sign(const Facade& wall, float at, std::string_view word, float height, MeshBuilder& tubes,
                    MeshBuilder& boards) {
  const vec2 size = neon_word_size(word, height, false);
  const mat4 frame(vec4(wall.along, 0), vec4(0, 1, 0, 0), vec4(wall.normal, 0),
                   vec4(wall.origin + wall.along * at, 1));
  const float left = -size.x / 2, bottom = 3.45f;
  boards.set_transform(frame);
  boards.box(vec3(left - 0.25f, bottom - 0.2f, 0.3f),
             vec3(left + size.x + 0.25f, bottom + size.y + 0.2f, 0.4f));
  boards.set_transform(mat4(1));
  tubes.set_transform(frame);
  add_neon_word(tubes, word, vec3(left, bottom, 0.56f), height, false);
  tubes.set_transform(mat4(1));
}

struct SignSpot {
  std::size_t facade;
  float at;
  float order;
};
// Spots along street walls: on the main street the ones before the camera come first, elsewhere the order is
// random.
struct SignSpots {
  std::vector<SignSpot> main_street, elsewhere;
};
SignSpots sign_spots(const City& city) {
  SignSpots spots;
  for (std::size_t f = 0; f < city.facades.size(); ++f) {
    const Facade& wall = city.facades[f];
    const vec3 front = wall.origin + wall.along * (wall.width / 2) + wall.normal * (kStreet / 2);
    const bool main_street =
        std::abs(wall.normal.x) > 0.5f && std::abs(front.x - city.plan.line(city.plan.blocks / 2)) < 1;
    RandomStream random(city.plan.seed, kSign, static_cast<std::uint32_t>(f));
    for (float at = 2.5f; at < wall.width - 2; at += 5) {
      const float ahead = city.plan.camera_z() - (wall.origin + wall.along * at).z;
      const float distance = ahead > 0 ? ahead / kPitch : 10;
      if (main_street)
        spots.main_street.push_back({f, at, distance + 2 * random.uniform()});
      else
        spots.elsewhere.push_back({f, at, random.uniform()});
    }
  }
  const auto earlier = [](const SignSpot& a, const SignSpot& b) { return a.order < b.order; };
  std::stable_sort(spots.main_street.begin(), spots.main_street.end(), earlier);
  std::stable_sort(spots.elsewhere.begin(), spots.elsewhere.end(), earlier);
  return spots;
}

// Places signs at `spots` until their tubes come to `triangles`; returns how many they are.
std::size_t place_signs(const City& city, const std::vector<SignSpot>& spots, std::size_t triangles,
                        NeonBuilders& tubes, MeshBuilder& boards) {
  std::size_t placed = 0;
  for (const SignSpot& spot : spots) {
    if (placed >= triangles) break;
    RandomStream random(
        city.plan.seed, kSign,
        static_cast<std::uint32_t>(0x100000 + spot.facade * 256) + static_cast<std::uint32_t>(spot.at));
    const std::string_view word = kWords[static_cast<std::size_t>(random.integer(kWords.size()))];
    MeshBuilder& color = tubes[static_cast<std::size_t>(random.integer(static_cast<int>(tubes.size())))];
    const std::size_t before = color.triangle_count();
    const Facade& wall = city.facades[spot.facade];
    if (random.chance(0.6f) && wall.height > 11)
      add_blade_sign(wall, spot.at, word, random.uniform(0.55f, 0.8f), color, boards);
    else
      add_front_sign(wall, spot.at, word, random.uniform(0.45f, 0.6f), color, boards);
    placed += color.triangle_count() - before;
  }
  return placed;
}

void add_signs(City& city, std::size_t triangles) {
  NeonBuilders tubes;
  MeshBuilder boards;
  const SignSpots spots = sign_spots(city);
  const std::size_t main =
      place_signs(city, spots.main_street,
                  static_cast<std::size_t>(kMainStreetShare * static_cast<float>(triangles)), tubes, boards);
  city.emissive +=
      main + place_signs(city, spots.elsewhere, triangles - std::min(main, triangles), tubes, boards);
  for (std::size_t c = 0; c < tubes.size(); ++c) {
    const std::string name = "neon " + std::to_string(c + 1);
    if (!tubes[c].empty())
      add_static(city.scene, tubes[c], name, add_emitter(city.scene, name, kNeonRadiance[c]));
  }
  add_static(city.scene, boards, "sign boards", add_surface(city.scene, "sign board", kBlackMetal, 0.6f, 1));
}

// --- traffic
// --------------------------------------------------------------------------------------------------

struct CarModel {
  std::vector<int> meshes;
  std::size_t triangles;
};
// Origin on the road below the middle; drives towards -z.
CarModel add_car_model(Scene& scene, const std::string& name, vec3 paint) {
  MeshBuilder builder;
  builder.box(vec3(-0.9f, 0.35f, -2.15f), vec3(0.9f, 0.95f, 2.15f));
  const vec3 roof[] = {
      {-0.68f, 1.45f, 1.2f}, {0.68f, 1.45f, 1.2f}, {0.68f, 1.45f, -0.5f}, {-0.68f, 1.45f, -0.5f}};
  const vec3 belt[] = {
      {-0.85f, 0.95f, 1.8f}, {0.85f, 0.95f, 1.8f}, {0.85f, 0.95f, -1.15f}, {-0.85f, 0.95f, -1.15f}};
  builder.polygon(roof);
  const int body = add_mesh(scene, builder, name, add_surface(scene, name, paint, 0.35f));
  for (int k = 0; k < 4; ++k)
    builder.polygon(std::array{belt[k], belt[(k + 1) % 4], roof[(k + 1) % 4], roof[k]});
  for (const float z : {-1.35f, 1.35f})
    for (const float x : {-0.92f, 0.74f})
      builder.cylinder(vec3(x, 0.33f, z), vec3(x + 0.18f, 0.33f, z), 0.33f, 0.33f, 12);
  const int dark = add_mesh(scene, builder, name + " glass and tyres",
                            add_surface(scene, name + " glass and tyres", vec3(0.04f), 0.4f));
  for (const float x : {-0.8f, 0.4f})
    builder.quad(vec3(x + 0.4f, 0.55f, -2.16f), vec3(-0.4f, 0, 0), vec3(0, 0.2f, 0));
  std::size_t triangles = builder.triangle_count();
  const int heads =
      add_mesh(scene, builder, "head lamps", add_emitter(scene, "head lamps", vec3(90, 86, 76)));
  for (const float x : {-0.82f, 0.42f})
    builder.quad(vec3(x, 0.62f, 2.16f), vec3(0.4f, 0, 0), vec3(0, 0.15f, 0));
  triangles += builder.triangle_count();
  const int tails =
      add_mesh(scene, builder, "tail lamps", add_emitter(scene, "tail lamps", vec3(10, 0.3f, 0.2f)));
  return {{body, dark, heads, tails}, triangles};
}

// One lane: cars one block apart that advance one block in a period, so that the loop has no seam.
void add_lane(City& city, const CarModel& car, bool along_x, float line, float direction, float phase) {
  PunctualLight beam;
  beam.name = "head beam";
  beam.type = LightType::kSpot;
  beam.color = vec3(70, 66, 58);
  beam.inner_cone = 0.15f;
  beam.outer_cone = 0.5f;
  beam.range = 45;
  const float turn = along_x ? (direction > 0 ? -kPi / 2 : kPi / 2) : (direction > 0 ? kPi : 0.0f);
  const float lane = line + (along_x ? direction : -direction) * 2.4f;
  for (int b = 0; b < city.plan.blocks; ++b) {
    const auto place = [=, plan = city.plan](float t) {
      const float at =
          direction > 0 ? plan.line(b) + kPitch * (t + phase) : plan.line(b + 1) - kPitch * (t + phase);
      return along_x ? vec3(at, 0, lane) : vec3(lane, 0, at);
    };
    const int node = add_node(city.scene, "car", car.meshes, place(0), axis_angle(vec3(0, 1, 0), turn));
    animate_translation(city.scene, node, kPeriod, 1, Interpolation::kLinear, place);
    add_light_node(city.scene, beam, vec3(0, 0.65f, -2.3f), looking_along(vec3(0, -0.12f, -1)), node);
    city.emissive += car.triangles;
  }
}

void add_traffic(City& city) {
  const std::array<CarModel, 3> cars = {add_car_model(city.scene, "red car", vec3(0.45f, 0.05f, 0.04f)),
                                        add_car_model(city.scene, "yellow cab", vec3(0.75f, 0.50f, 0.06f)),
                                        add_car_model(city.scene, "silver car", vec3(0.55f, 0.57f, 0.60f))};
  for (const bool along_x : {false, true})
    for (int k = 0; k < city.plan.streets(); ++k)
      for (const float direction : {-1.0f, 1.0f}) {
        RandomStream random(city.plan.seed, kTraffic,
                            static_cast<std::uint32_t>(k * 4 + (along_x ? 2 : 0) + (direction > 0 ? 1 : 0)));
        // The two directions of streets take the crossings half a period apart.
        const float phase = (along_x ? 0.5f : 0.0f) + random.uniform(-0.08f, 0.08f) + 0.45f;
        add_lane(city, cars[static_cast<std::size_t>(random.integer(3))], along_x, city.plan.line(k),
                 direction, phase);
      }
}

// --- drifting kites
// ----------------------------------------------------------------------------------------

// Point lights below small dark kites that wander over the main street.
void add_kites(City& city) {
  MeshBuilder builder;
  builder.cylinder(vec3(0), vec3(0, 0.35f, 0), 0.3f, 0, 6);
  const int kite = add_mesh(city.scene, builder, "kite", add_surface(city.scene, "kite", vec3(0.08f)));
  for (std::uint32_t i = 0; i < 24; ++i) {
    RandomStream random(city.plan.seed, kKite, i);
    const vec3 centre(random.uniform(-5, 5), random.uniform(8, 13),
                      glm::mix(city.plan.lo(), city.plan.camera_z(), random.uniform()));
    const float phase = random.uniform(), wide = random.uniform(0.6f, 2), deep = random.uniform(1, 3);
    const int node = add_node(city.scene, "kite", {kite}, centre);
    animate_translation(city.scene, node, kPeriod, 12, Interpolation::kCubicSpline, [=](float t) {
      const float a = 2 * kPi * (t + phase);
      return centre + vec3(wide * sine(a), 0.5f * sine(2 * a), deep * cosine(a));
    });
    PunctualLight light;
    light.name = "kite light";
    light.color = 0.6f * kBulbRadiance[i % kBulbRadiance.size()];
    add_light_node(city.scene, light, vec3(0, -0.7f, 0), vec4(0, 0, 0, 1), node);
  }
}

void brighten(Scene& scene) {
  for (Material& material : scene.materials) material.emission *= kBrightness;
  for (PunctualLight& light : scene.lights) light.color *= kBrightness;
}

Scene make(const Parameters& parameters) {
  City city;
  city.plan = {parameters.integer("blocks"), parameters.seed()};
  const auto lights = static_cast<std::size_t>(parameters.integer("lights"));
  const auto share = [&](float part) { return static_cast<std::size_t>(part * static_cast<float>(lights)); };
  add_ground(city);
  add_markings(city);
  add_buildings(city);
  add_traffic(city);
  add_kites(city);
  add_lamps(city, share(kLampShare));
  const int subdivisions = lights > 500000 ? 1 : 0;  // of globes and bulbs
  add_wall_lanterns(city, share(kLanternShare), subdivisions);
  add_strings(city, share(kBulbShare), subdivisions);
  add_signs(city, share(kNeonShare));
  add_windows(city, lights > city.emissive ? lights - city.emissive : 0);
  brighten(city.scene);
  const float z = city.plan.camera_z();
  add_camera(city.scene, "street", vec3(0.3f, 2.5f, z), vec3(-0.5f, 5.2f, z - 40), 52);
  add_camera(city.scene, "roofs", vec3(3, 62, z + 60), vec3(0, 0, z - 50), 50);
  return std::move(city.scene);
}

}  // namespace

Definition night_city() {
  return {"night-city",
          "city streets at night: windows, lamps, neon, swinging bulbs, traffic; all lights local",
          true,
          {{"lights", "100000", "emissive triangles, about (5000 to 4000000)", 5000, 4e6, false, {}},
           {"blocks", "6", "city blocks a side (2 to 12)", 2, 12, false, {}},
           seed_parameter()},
          make};
}

}  // namespace lumigrove::builtin
