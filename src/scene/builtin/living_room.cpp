// `living-room`: a furnished room at night whose lamps all hide behind shades, so that most light arrives
// indirectly, over a polished wooden floor that mirrors it. Cloth shades glow, since nothing here lets light
// through. The pendant swings a little.
#include <array>
#include <cmath>
#include <string>

#include "scene/builtin/builtin.h"
#include "scene/builtin/procedural_image.h"
#include "scene/builtin/random_stream.h"
#include "scene/builtin/scene_parts.h"

namespace lumigrove::builtin {
namespace {

// The room: x in [-kHalfWidth, kHalfWidth], z in [-kHalfDepth, kHalfDepth], metres. The camera stands near
// +z.
constexpr float kHalfWidth = 3.4f, kHalfDepth = 2.7f, kHeight = 2.75f;
constexpr float kPeriod = 6;  // seconds
enum Purpose : std::uint32_t { kPlank, kBook, kPicture, kLeaf };

// Window in the left wall: z and y extents.
constexpr vec2 kWindowLo(-1.6f, 0.85f), kWindowHi(0.6f, 2.3f);

struct Materials {
  int wall, accent, ceiling, floor, wood, dark_wood, fabric, cushion, metal, brass, white, shade;
};

int add_floor_material(Scene& scene, std::uint32_t seed) {
  constexpr int kPlankColumns = 2, kPlankRows = 12;
  const auto grain = [=](vec2 p) { return tiling_noise(vec2(p.x, glm::fract(p.y * 7)), 6, 4, seed + 21); };
  const int color = add_color_image(scene, "planks", 512, [=](vec2 p) {
    const BrickPoint plank = running_bond(p, kPlankColumns, kPlankRows);
    RandomStream random(seed, kPlank, static_cast<std::uint32_t>(plank.row * 64 + plank.column));
    const float shade = random.uniform(0.72f, 1.08f) * (0.75f + 0.45f * grain(p));
    return plank.edge < 0.025f ? vec3(0.08f, 0.045f, 0.025f) : shade * vec3(0.42f, 0.235f, 0.125f);
  });
  const int roughness = add_roughness_image(scene, "planks roughness", 256, [=](vec2 p) {
    return 0.2f + 0.12f * tiling_noise(p, 12, 3, seed + 40);
  });
  const int material = add_surface(scene, "polished floor", vec3(1));
  scene.materials[material].base_color_texture = tiled(color, vec2(2.4f, 1.68f));
  scene.materials[material].metallic_roughness_texture = tiled(roughness, vec2(2.4f, 1.68f));
  return material;
}

Materials add_materials(Scene& scene, std::uint32_t seed) {
  Materials m{};
  m.wall = add_surface(scene, "wall", vec3(0.74f, 0.70f, 0.63f));
  m.accent = add_surface(scene, "accent wall", vec3(0.16f, 0.34f, 0.38f));
  m.ceiling = add_surface(scene, "ceiling", vec3(0.82f));
  m.floor = add_floor_material(scene, seed);
  m.wood = add_surface(scene, "oak", vec3(0.45f, 0.28f, 0.15f), 0.45f);
  m.dark_wood = add_surface(scene, "walnut", vec3(0.20f, 0.11f, 0.065f), 0.35f);
  m.fabric = add_surface(scene, "sofa fabric", vec3(0.52f, 0.49f, 0.44f));
  m.cushion = add_surface(scene, "cushion", vec3(0.66f, 0.30f, 0.10f));
  m.metal = add_surface(scene, "steel", vec3(0.78f, 0.78f, 0.8f), 0.3f, 1);
  m.brass = add_surface(scene, "brass", vec3(0.85f, 0.62f, 0.28f), 0.3f, 1);
  m.white = add_surface(scene, "white paint", vec3(0.8f), 0.5f);
  m.shade = add_emitter(scene, "lamp shade", vec3(5.4f, 3.1f, 1.2f), vec3(0.25f, 0.21f, 0.16f));
  scene.materials[m.shade].double_sided = true;
  return m;
}

void add_room(Scene& scene, const Materials& m) {
  const vec3 lo(-kHalfWidth, 0, -kHalfDepth), d(2 * kHalfWidth, kHeight, 2 * kHalfDepth);
  const vec3 x(d.x, 0, 0), y(0, d.y, 0), z(0, 0, d.z);
  MeshBuilder builder;
  builder.quad(lo + z, x, -z);
  add_static(scene, builder, "floor", m.floor);
  builder.quad(lo + y, x, z);
  add_static(scene, builder, "ceiling", m.ceiling);
  builder.quad(lo, x, y);
  add_static(scene, builder, "back wall", m.accent);
  builder.quad(lo + x, z, y);
  builder.quad(lo + x + z, -x, y);
  // The left wall around its window: below, above, before, behind; seen from the room, -z is right.
  const auto left = [&](float z0, float z1, float y0, float y1) {
    builder.quad(vec3(lo.x, y0, z1), vec3(0, 0, z0 - z1), vec3(0, y1 - y0, 0));
  };
  left(-kHalfDepth, kHalfDepth, 0, kWindowLo.y);
  left(-kHalfDepth, kHalfDepth, kWindowHi.y, kHeight);
  left(-kHalfDepth, kWindowLo.x, kWindowLo.y, kWindowHi.y);
  left(kWindowHi.x, kHalfDepth, kWindowLo.y, kWindowHi.y);
  add_static(scene, builder, "walls", m.wall);
  for (const float side : {-1.0f, 1.0f}) {  // skirting boards
    const float a = side * kHalfWidth, b = side * (kHalfWidth - 0.02f);
    builder.box(vec3(std::min(a, b), 0, -kHalfDepth), vec3(std::max(a, b), 0.1f, kHalfDepth),
                kLeft | kRight | kTop);
  }
  builder.box(vec3(-kHalfWidth, 0, -kHalfDepth), vec3(kHalfWidth, 0.1f, -kHalfDepth + 0.02f), kFront | kTop);
  add_static(scene, builder, "skirting", m.white);
}

// Frame, sill, curtains, and the moonlit sky behind: a dim emissive pane that closes the opening.
void add_window(Scene& scene, const Materials& m) {
  const float x = -kHalfWidth, depth = 0.18f;
  const vec2 lo = kWindowLo, hi = kWindowHi;
  MeshBuilder builder;
  builder.quad(vec3(x - depth, lo.y, hi.x), vec3(0, 0, lo.x - hi.x), vec3(0, hi.y - lo.y, 0));
  add_static(scene, builder, "night sky",
             add_emitter(scene, "night sky", vec3(0.10f, 0.16f, 0.30f), vec3(0.02f)));
  builder.quad(vec3(x - depth, lo.y, hi.x), vec3(depth, 0, 0),
               vec3(0, 0, lo.x - hi.x));  // reveals, facing inwards
  builder.quad(vec3(x - depth, hi.y, lo.x), vec3(depth, 0, 0), vec3(0, 0, hi.x - lo.x));
  builder.quad(vec3(x - depth, lo.y, lo.x), vec3(depth, 0, 0), vec3(0, hi.y - lo.y, 0));
  builder.quad(vec3(x, lo.y, hi.x), vec3(-depth, 0, 0), vec3(0, hi.y - lo.y, 0));
  const float bar = 0.03f, at = x - 0.1f;
  const auto beam = [&](vec2 a, vec2 b) { builder.box(vec3(at - bar, a.y, a.x), vec3(at + bar, b.y, b.x)); };
  for (const float z : {lo.x + bar, 0.5f * (lo.x + hi.x), hi.x - bar})
    beam(vec2(z - bar, lo.y), vec2(z + bar, hi.y));
  for (const float h : {lo.y + bar, 0.62f * hi.y + 0.38f * lo.y, hi.y - bar})
    beam(vec2(lo.x, h - bar), vec2(hi.x, h + bar));
  builder.box(vec3(x - 0.02f, lo.y - 0.05f, lo.x - 0.08f), vec3(x + 0.14f, lo.y, hi.x + 0.08f));
  add_static(scene, builder, "window frame", m.white);
  const int cloth = add_surface(scene, "curtain", vec3(0.62f, 0.60f, 0.52f));
  scene.materials[cloth].double_sided = true;
  for (const float middle : {lo.x - 0.18f, hi.x + 0.18f})
    builder.sheet(
        [=](float s, float t) {
          return vec3(x + 0.12f + 0.05f * sine(2 * kPi * 5 * s), 0.05f + 2.45f * t,
                      middle + 0.35f - 0.7f * s);
        },
        60, 1);
  add_static(scene, builder, "curtains", cloth);
  builder.cylinder(vec3(x + 0.12f, 2.53f, lo.x - 0.7f), vec3(x + 0.12f, 2.53f, hi.x + 0.7f), 0.018f, 0.018f,
                   10);
  add_static(scene, builder, "curtain rail", m.brass);
}

// --- lamps
// ----------------------------------------------------------------------------------------------------

// A closed luminous ball of about `flux` W.
int add_bulb(Scene& scene, const std::string& name, float radius, float flux, vec3 tint) {
  MeshBuilder builder;
  builder.icosphere(vec3(0), radius, 2);
  return add_mesh(scene, builder, name,
                  add_emitter(scene, name, tint * (flux / (4 * kPi * kPi * radius * radius)), vec3(0.6f)));
}

constexpr vec3 kWarm(1.35f, 0.95f, 0.5f);  // luminance about 1

// Open cone of cloth, `bottom` and `top` radii, standing from y = 0.
int add_shade(Scene& scene, const Materials& m, float bottom, float top, float height) {
  MeshBuilder builder;
  const vec2 profile[] = {{bottom, 0}, {top, height}};
  builder.lathe(vec3(0), profile, 40, true);
  return add_mesh(scene, builder, "shade", m.shade);
}

void add_floor_lamp(Scene& scene, const Materials& m, vec3 at) {
  MeshBuilder builder;
  builder.cylinder(vec3(0), vec3(0, 0.03f, 0), 0.16f, 0.15f, 32);
  builder.cylinder(vec3(0, 0.03f, 0), vec3(0, 1.5f, 0), 0.014f, 0.014f, 12);
  const int stand = add_mesh(scene, builder, "floor lamp stand", m.brass);
  add_node(scene, "floor lamp", {stand}, at);
  add_node(scene, "floor lamp shade", {add_shade(scene, m, 0.3f, 0.2f, 0.36f)}, at + vec3(0, 1.42f, 0));
  add_node(scene, "floor lamp bulb", {add_bulb(scene, "floor lamp bulb", 0.11f, 38, kWarm)},
           at + vec3(0, 1.58f, 0));
}

void add_table_lamps(Scene& scene, const Materials& m, std::span<const vec3> places) {
  MeshBuilder builder;
  const vec2 foot[] = {{0.075f, 0},    {0.08f, 0.02f}, {0.05f, 0.05f}, {0.09f, 0.13f}, {0.1f, 0.19f},
                       {0.07f, 0.27f}, {0.02f, 0.31f}, {0.015f, 0.4f}, {0, 0.4f}};
  builder.lathe(vec3(0), foot, 32, true);
  const int ceramic = add_mesh(scene, builder, "table lamp foot",
                               add_surface(scene, "ceramic", vec3(0.1f, 0.25f, 0.42f), 0.25f));
  const int shade = add_shade(scene, m, 0.21f, 0.14f, 0.24f);
  const int bulb = add_bulb(scene, "table lamp bulb", 0.08f, 16, kWarm);
  for (const vec3 at : places) {
    add_node(scene, "table lamp", {ceramic}, at);
    add_node(scene, "table lamp shade", {shade}, at + vec3(0, 0.36f, 0));
    add_node(scene, "table lamp bulb", {bulb}, at + vec3(0, 0.46f, 0));
  }
}

// A metal dome on a cord that swings about its hook in the ceiling.
void add_pendant(Scene& scene, const Materials& m, vec3 hook) {
  const float cord = 0.8f;
  MeshBuilder builder;
  builder.cylinder(vec3(0, -cord, 0), vec3(0), 0.006f, 0.006f, 6);
  const int wire = add_mesh(scene, builder, "pendant cord", m.dark_wood);
  std::array<vec2, 9> dome;
  for (int k = 0; k < 9; ++k) {
    const float angle = 0.5f * kPi * static_cast<float>(k) / 8;
    dome[k] = vec2(k == 8 ? 0.0f : 0.3f * cosine(angle), -cord - 0.24f + 0.24f * sine(angle));
  }
  builder.lathe(vec3(0), dome, 40, true);
  const int copper = add_surface(scene, "copper", vec3(0.9f, 0.5f, 0.32f), 0.45f, 1);
  scene.materials[copper].double_sided = true;
  const int shade = add_mesh(scene, builder, "pendant dome", copper);
  const int pivot = add_node(scene, "pendant", {wire, shade}, hook);
  add_node(scene, "pendant bulb", {add_bulb(scene, "pendant bulb", 0.1f, 32, kWarm)},
           vec3(0, -cord - 0.15f, 0), vec4(0, 0, 0, 1), pivot);
  animate_rotation(scene, pivot, kPeriod, 12, Interpolation::kCubicSpline,
                   [](float t) { return axis_angle(vec3(0, 0, 1), 0.06f * sine(2 * kPi * 2 * t)); });
}

// Half bowls on the wall that throw their light upwards.
void add_sconces(Scene& scene, const Materials& m, std::span<const vec3> places) {
  MeshBuilder builder;
  const vec2 bowl[] = {{0.02f, 0}, {0.12f, 0.03f}, {0.17f, 0.1f}, {0.19f, 0.19f}};
  builder.lathe(vec3(0), bowl, 32, true);
  const int shade = add_mesh(scene, builder, "sconce", m.shade);
  const int bulb = add_bulb(scene, "sconce bulb", 0.055f, 12, kWarm);
  for (const vec3 at : places) {
    add_node(scene, "sconce", {shade}, at);
    add_node(scene, "sconce bulb", {bulb}, at + vec3(0, 0.1f, 0));
  }
}

// --- furniture
// ------------------------------------------------------------------------------------------------

// Origin on the floor in the middle of its back edge; the sitter faces +z.
void add_sofa(Scene& scene, const Materials& m, vec3 at, float turn, float width, int seats) {
  MeshBuilder builder;
  builder.set_transform(placed(at, turn));
  const float half = 0.5f * width, arm = 0.2f;
  builder.rounded_box(vec3(-half, 0.12f, 0), vec3(half, 0.32f, 0.9f), 0.04f, 4);
  builder.rounded_box(vec3(-half, 0.2f, 0), vec3(half, 0.82f, 0.24f), 0.07f, 5);
  for (const float x : {-half, half - arm})
    builder.rounded_box(vec3(x, 0.2f, 0.05f), vec3(x + arm, 0.62f, 0.92f), 0.07f, 5);
  const float seat = (width - 2 * arm) / static_cast<float>(seats);
  for (int k = 0; k < seats; ++k) {
    const float x = -half + arm + seat * static_cast<float>(k);
    builder.rounded_box(vec3(x + 0.005f, 0.3f, 0.2f), vec3(x + seat - 0.005f, 0.47f, 0.9f), 0.06f, 5);
    builder.rounded_box(vec3(x + 0.01f, 0.44f, 0.2f), vec3(x + seat - 0.01f, 0.86f, 0.38f), 0.08f, 5);
  }
  add_static(scene, builder, "sofa", m.fabric);
  for (const float x : {-half + 0.1f, half - 0.1f})
    for (const float z : {0.1f, 0.8f}) builder.cylinder(vec3(x, 0, z), vec3(x, 0.13f, z), 0.02f, 0.03f, 12);
  add_static(scene, builder, "sofa legs", m.dark_wood);
}

void add_cushion(Scene& scene, const Materials& m, vec3 at, float turn) {
  MeshBuilder builder;
  builder.rounded_box(vec3(-0.2f, -0.2f, -0.065f), vec3(0.2f, 0.2f, 0.065f), 0.06f, 5);
  const int mesh = add_mesh(scene, builder, "cushion", m.cushion);
  const int stand = add_node(scene, "cushion", {}, at, axis_angle(vec3(0, 1, 0), turn));
  add_node(scene, "cushion", {mesh}, vec3(0), axis_angle(vec3(1, 0, 0), -0.35f), stand);
}

void add_coffee_table(Scene& scene, const Materials& m, vec3 at) {
  MeshBuilder builder;
  builder.set_transform(placed(at));
  builder.rounded_box(vec3(-0.6f, 0.36f, -0.32f), vec3(0.6f, 0.41f, 0.32f), 0.02f, 3);
  add_static(scene, builder, "coffee table", m.wood);
  builder.set_transform(placed(at));
  for (const float x : {-0.5f, 0.5f})
    for (const float z : {-0.25f, 0.25f})
      builder.cylinder(vec3(1.08f * x, 0, 1.12f * z), vec3(x, 0.37f, z), 0.014f, 0.018f, 12);
  builder.icosphere(vec3(0.34f, 0.51f, -0.1f), 0.1f, 4);
  add_static(scene, builder, "steel legs and ball", m.metal);
  const vec2 bowl[] = {{0.05f, 0},     {0.06f, 0.01f},  {0.14f, 0.05f}, {0.17f, 0.1f},
                       {0.165f, 0.1f}, {0.13f, 0.055f}, {0.05f, 0.02f}, {0, 0.018f}};
  builder.lathe(at + vec3(-0.3f, 0.41f, 0.02f), bowl, 40, false);
  add_static(scene, builder, "bowl", m.brass);
}

void add_side_tables(Scene& scene, const Materials& m, std::span<const vec3> places) {
  MeshBuilder builder;
  builder.cylinder(vec3(0, 0.5f, 0), vec3(0, 0.53f, 0), 0.25f, 0.25f, 40);
  builder.cylinder(vec3(0, 0.02f, 0), vec3(0, 0.5f, 0), 0.02f, 0.02f, 12);
  builder.cylinder(vec3(0), vec3(0, 0.02f, 0), 0.16f, 0.15f, 32);
  const int mesh = add_mesh(scene, builder, "side table", m.dark_wood);
  for (const vec3 at : places) add_node(scene, "side table", {mesh}, at);
}

constexpr std::array<vec3, 6> kBookColors = {vec3(0.45f, 0.08f, 0.07f), vec3(0.08f, 0.20f, 0.36f),
                                             vec3(0.12f, 0.30f, 0.16f), vec3(0.66f, 0.55f, 0.36f),
                                             vec3(0.30f, 0.16f, 0.30f), vec3(0.70f, 0.38f, 0.10f)};

// Stands on the floor against the right wall, open towards -x.
void add_bookshelf(Scene& scene, const Materials& m, float z_lo, float z_hi, std::uint32_t seed) {
  constexpr int kShelves = 5;
  constexpr float kDepth = 0.3f, kTopHeight = 2.0f, kBoard = 0.025f;
  const float back = kHalfWidth - 0.025f, front = back - kDepth;
  MeshBuilder boards;
  std::array<MeshBuilder, kBookColors.size()> books;
  for (const float z : {z_lo, z_hi - kBoard})
    boards.box(vec3(front, 0, z), vec3(back, kTopHeight, z + kBoard));
  boards.box(vec3(back - 0.01f, 0, z_lo + kBoard), vec3(back, kTopHeight, z_hi - kBoard), kLeft);
  for (int shelf = 0; shelf <= kShelves; ++shelf) {
    const float y = 0.06f + (kTopHeight - 0.06f - kBoard) * static_cast<float>(shelf) / kShelves;
    boards.box(vec3(front + 0.005f, y, z_lo + kBoard), vec3(back - 0.01f, y + kBoard, z_hi - kBoard),
               kLeft | kTop | kBottom);
    if (shelf == kShelves) break;
    RandomStream random(seed, kBook, static_cast<std::uint32_t>(shelf));
    for (float z = z_lo + kBoard + 0.01f;;) {
      const float thick = random.uniform(0.018f, 0.05f), tall = random.uniform(0.2f, 0.32f),
                  deep = random.uniform(0.16f, 0.24f);
      if (z + thick > z_hi - kBoard - 0.01f) break;
      MeshBuilder& color = books[static_cast<std::size_t>(random.integer(static_cast<int>(books.size())))];
      if (!random.chance(0.08f))
        color.box(vec3(back - 0.015f - deep, y + kBoard, z),
                  vec3(back - 0.015f, y + kBoard + tall, z + thick), kAllFaces & ~kBottom & ~kRight);
      z += thick + 0.002f;
    }
  }
  add_static(scene, boards, "bookshelf", m.wood);
  for (std::size_t c = 0; c < books.size(); ++c) {
    const std::string name = "books " + std::to_string(c + 1);
    add_static(scene, books[c], name, add_surface(scene, name, kBookColors[c], 0.6f));
  }
}

// Flat blobs of paint in a wooden frame on the back wall.
void add_picture(Scene& scene, const Materials& m, vec3 centre, vec2 size, std::uint32_t key) {
  const std::string name = "picture " + std::to_string(key % 16);
  const int image = add_color_image(scene, name, 128, [=](vec2 p) {
    const float a = tiling_noise(p, 3, 3, key), b = tiling_noise(p, 4, 2, key + 7);
    const vec3 sky = glm::mix(vec3(0.75f, 0.62f, 0.42f), vec3(0.14f, 0.30f, 0.42f),
                              glm::smoothstep(0.4f, 0.6f, a + 0.4f * (p.y - 0.5f)));
    return b > 0.55f ? vec3(0.66f, 0.18f, 0.07f) : sky;
  });
  const int paint = add_surface(scene, name, vec3(1), 0.7f);
  scene.materials[paint].base_color_texture = tiled(image, size);
  const vec3 lo = centre - vec3(0.5f * size, 0);
  MeshBuilder builder;
  builder.quad(lo + vec3(0, 0, 0.02f), vec3(size.x, 0, 0), vec3(0, size.y, 0));
  add_static(scene, builder, name, paint);
  const float rim = 0.03f;
  const vec3 hi = lo + vec3(size, 0.035f);
  builder.box(lo - vec3(rim, rim, 0), vec3(hi.x + rim, lo.y, hi.z), kAllFaces & ~kBack);
  builder.box(vec3(lo.x - rim, hi.y, lo.z), hi + vec3(rim, rim, 0), kAllFaces & ~kBack);
  builder.box(vec3(lo.x - rim, lo.y, lo.z), vec3(lo.x, hi.y, hi.z), kLeft | kRight | kFront);
  builder.box(vec3(hi.x, lo.y, lo.z), vec3(hi.x + rim, hi.y, hi.z), kLeft | kRight | kFront);
  add_static(scene, builder, name + " frame", m.dark_wood);
}

// A round mirror with a brass rim on the back wall.
void add_mirror(Scene& scene, const Materials& m, vec3 centre, float radius) {
  MeshBuilder builder;
  builder.cylinder(centre, centre + vec3(0, 0, 0.02f), radius, radius, 64);
  add_static(scene, builder, "mirror", add_surface(scene, "mirror", vec3(0.92f), 0.05f, 1));
  const auto rim = [=](float turn) {
    return centre + vec3(radius * cosine(2 * kPi * turn), radius * sine(2 * kPi * turn), 0.02f);
  };
  builder.closed_tube(rim, 0.02f, 64, 10);
  add_static(scene, builder, "mirror rim", m.brass);
}

void add_sideboard(Scene& scene, const Materials& m, vec3 lo, vec3 hi) {
  MeshBuilder builder;
  builder.rounded_box(lo + vec3(0, 0.14f, 0), hi, 0.015f, 2);
  const int doors = 4;
  for (int k = 0; k < doors; ++k) {
    const float w = (hi.x - lo.x - 0.06f) / doors, x = lo.x + 0.03f + w * static_cast<float>(k);
    builder.rounded_box(vec3(x + 0.006f, lo.y + 0.18f, hi.z - 0.01f),
                        vec3(x + w - 0.006f, hi.y - 0.04f, hi.z + 0.015f), 0.005f, 1);
  }
  for (const float x : {lo.x + 0.1f, hi.x - 0.1f})
    for (const float z : {lo.z + 0.08f, hi.z - 0.08f})
      builder.cylinder(vec3(x, lo.y, z), vec3(x, lo.y + 0.15f, z), 0.015f, 0.022f, 10);
  add_static(scene, builder, "sideboard", m.dark_wood);
  const vec2 vase[] = {{0.05f, 0},      {0.07f, 0.02f},  {0.1f, 0.1f},   {0.09f, 0.18f},
                       {0.045f, 0.26f}, {0.035f, 0.32f}, {0.055f, 0.36f}};
  builder.lathe(vec3(glm::mix(lo.x, hi.x, 0.72f), hi.y, 0.5f * (lo.z + hi.z)), vase, 40, true);
  scene.materials.push_back(scene.materials[m.metal]);
  scene.materials.back().name = "vase";
  scene.materials.back().double_sided = true;
  add_static(scene, builder, "vase", static_cast<int>(scene.materials.size()) - 1);
}

void add_plant(Scene& scene, vec3 at, std::uint32_t seed) {
  MeshBuilder builder;
  const vec2 pot[] = {{0.13f, 0},     {0.18f, 0.3f},   {0.2f, 0.31f}, {0.2f, 0.35f},
                      {0.17f, 0.35f}, {0.165f, 0.28f}, {0, 0.28f}};
  builder.lathe(at, pot, 32, false);
  add_static(scene, builder, "pot", add_surface(scene, "pot", vec3(0.7f, 0.68f, 0.64f), 0.6f));
  const int green = add_surface(scene, "leaf", vec3(0.12f, 0.28f, 0.08f), 0.5f);
  scene.materials[green].double_sided = true;
  for (std::uint32_t k = 0; k < 26; ++k) {
    RandomStream random(seed, kLeaf, k);
    const float length = random.uniform(0.45f, 0.95f), lean = random.uniform(0.3f, 1.1f),
                wide = random.uniform(0.05f, 0.09f);
    builder.set_transform(placed(at + vec3(0, 0.28f, 0), random.uniform(0, 2 * kPi)));
    builder.sheet(
        [=](float s, float t) {
          const float angle = lean * t, half = wide * sine(kPi * (0.04f + 0.92f * t));
          const float across = 2 * s - 1;
          return vec3(across * half, length * t * cosine(0.6f * angle),
                      0.03f + length * t * sine(angle) + 0.25f * half * across * across);
        },
        4, 8);
  }
  add_static(scene, builder, "leaves", green);
}

void add_rug(Scene& scene, vec3 lo, vec2 size, std::uint32_t seed) {
  const int image = add_color_image(scene, "rug", 256, [=](vec2 p) {
    const vec2 q = glm::abs(p - 0.5f);
    const float border = std::max(q.x, q.y), wool = 0.85f + 0.3f * tiling_noise(p, 60, 2, seed + 70);
    const bool diamond = glm::fract(6 * (q.x + q.y)) < 0.5f;
    const vec3 c = border > 0.46f   ? vec3(0.25f, 0.06f, 0.05f)
                   : border > 0.42f ? vec3(0.7f, 0.6f, 0.45f)
                   : diamond        ? vec3(0.42f, 0.10f, 0.07f)
                                    : vec3(0.12f, 0.14f, 0.26f);
    return wool * c;
  });
  const int material = add_surface(scene, "rug", vec3(1));
  scene.materials[material].base_color_texture = tiled(image, size);
  MeshBuilder builder;
  builder.box(lo, lo + vec3(size.x, 0.015f, size.y), kAllFaces & ~kBottom);
  add_static(scene, builder, "rug", material);
}

Scene make(const Parameters& parameters) {
  Scene scene;
  const std::uint32_t seed = parameters.seed();
  const Materials m = add_materials(scene, seed);
  add_room(scene, m);
  add_window(scene, m);
  add_sofa(scene, m, vec3(-0.5f, 0, -2.35f), 0, 2.3f, 3);
  add_sofa(scene, m, vec3(1.95f, 0, 0.55f), -2.2f, 1.05f, 1);
  add_cushion(scene, m, vec3(-1.15f, 0.66f, -1.83f), 0.2f);
  add_cushion(scene, m, vec3(0.3f, 0.66f, -1.83f), -0.25f);
  add_rug(scene, vec3(-1.9f, 0, -1.5f), vec2(2.9f, 2.1f), seed);
  add_coffee_table(scene, m, vec3(-0.45f, 0.015f, -0.45f));
  const vec3 tables[] = {{-2.1f, 0, -2.1f}};
  add_side_tables(scene, m, tables);
  add_bookshelf(scene, m, -1.9f, 0.0f, seed);
  add_sideboard(scene, m, vec3(1.15f, 0, -2.65f), vec3(2.75f, 0.75f, -2.22f));
  const vec3 lamps[] = {{-2.1f, 0.53f, -2.1f}, {1.45f, 0.75f, -2.42f}};
  add_table_lamps(scene, m, lamps);
  add_floor_lamp(scene, m, vec3(-2.75f, 0, -0.3f));
  add_pendant(scene, m, vec3(-0.45f, kHeight, -0.45f));
  const vec3 sconces[] = {{-kHalfWidth + 0.22f, 1.75f, 1.9f}, {kHalfWidth - 0.22f, 1.75f, 0.9f}};
  add_sconces(scene, m, sconces);
  add_picture(scene, m, vec3(-1.15f, 1.65f, -kHalfDepth), vec2(0.75f, 0.55f), seed * 16 + 1);
  add_picture(scene, m, vec3(-0.2f, 1.65f, -kHalfDepth), vec2(0.5f, 0.65f), seed * 16 + 2);
  add_mirror(scene, m, vec3(1.95f, 1.6f, -kHalfDepth), 0.42f);
  add_plant(scene, vec3(-2.95f, 0, -2.2f), seed);
  add_camera(scene, "camera", vec3(0.65f, 1.5f, 2.62f), vec3(-0.1f, 0.95f, -1.6f), 56);
  return scene;
}

}  // namespace

Definition living_room() {
  return {"living-room",
          "furnished room at night: glossy floor, lamps hidden behind shades",
          true,
          {seed_parameter()},
          make};
}

}  // namespace lumigrove::builtin
