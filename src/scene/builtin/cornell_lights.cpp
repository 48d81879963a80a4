// `cornell-lights`: a Cornell box full of moving luminous solids, after the box of Lin & Yuksel, "Real-Time
// Stochastic Lightcuts" (I3D 2020): its walls, camera and triangle counts (6 solids of 968 triangles, 3 of
// 1152, 3 of 960 and a ceiling light of 2). Torus knots stand where the paper has monkey heads; the solids are
// as bright as the paper's on average (1 to 2 in each channel there) but of stronger colours, which a picture shows.
#include <algorithm>
#include <array>
#include <cmath>

#include "scene/builtin/builtin.h"
#include "scene/builtin/random_stream.h"
#include "scene/builtin/scene_parts.h"

namespace lumigrove::builtin {
namespace {

constexpr vec3 kLo(-1.02f, 0, -1.04f), kHi(1, 1.99f, 1.05f);
constexpr float kPeriod = 6;  // seconds; a spin of one turn is about 1 rad/s
enum Purpose : std::uint32_t { kColor, kMotion };

void add_walls(Scene& scene) {
  const vec3 d = kHi - kLo, x(d.x, 0, 0), y(0, d.y, 0), z(0, 0, d.z);
  MeshBuilder builder;
  builder.quad(kLo + z, x, -z);  // floor
  builder.quad(kLo + y, x, z);   // ceiling
  builder.quad(kLo, x, y);       // back
  add_static(scene, builder, "white walls", add_surface(scene, "white", vec3(0.8f)));
  builder.quad(kLo + z, -z, y);
  add_static(scene, builder, "red wall", add_surface(scene, "red", vec3(0.8f, 0.05f, 0.05f)));
  builder.quad(kLo + x, z, y);
  add_static(scene, builder, "green wall", add_surface(scene, "green", vec3(0.05f, 0.8f, 0.05f)));
  const vec3 centre(0.5f * (kLo.x + kHi.x), kHi.y - 0.005f, 0.5f * (kLo.z + kHi.z));
  builder.quad(centre - vec3(0.25f, 0, 0.2f), vec3(0.5f, 0, 0), vec3(0, 0, 0.4f));
  add_static(scene, builder, "ceiling light", add_emitter(scene, "ceiling light", vec3(2.56f), vec3(0.64f)));
}

// Solids of about unit radius around the origin.
void torus_knot(MeshBuilder& builder) {
  const auto trefoil = [](float turn) {
    const float a = 2 * kPi * turn, r = 0.55f + 0.25f * cosine(3 * a);
    return vec3(r * cosine(2 * a), 0.3f * sine(3 * a), r * sine(2 * a));
  };
  builder.closed_tube(trefoil, 0.17f, 44, 11);
}
void torus(MeshBuilder& builder) {
  const auto circle = [](float turn) {
    return vec3(0.7f * cosine(2 * kPi * turn), 0, 0.7f * sine(2 * kPi * turn));
  };
  builder.closed_tube(circle, 0.28f, 36, 16);
}
void ball(MeshBuilder& builder) { builder.sphere(vec3(0), 0.85f, 32, 16); }

using Shape = void (*)(MeshBuilder&);
constexpr std::array<Shape, 4> kShapes = {torus_knot, torus, torus_knot, ball};

// The box cut into at least `count` cells, three wide for twelve solids.
struct Cells {
  int nx, ny, nz;
  vec3 size;
};
Cells cells_for(int count) {
  const int side = std::max(1, static_cast<int>(std::ceil(std::cbrt(static_cast<float>(count) / 1.5f))));
  const int wide = (count + side * side - 1) / (side * side);
  return {wide, side, side, (kHi - kLo) / vec3(wide, side, side)};
}

void animate_solid(Scene& scene, int node, vec3 centre, vec3 room, std::uint32_t seed, std::uint32_t index) {
  RandomStream random(seed, kMotion, index);
  const float phase = random.uniform(), turns = random.chance(0.5f) ? 1.0f : -1.0f;
  const vec3 axis = glm::normalize(vec3(random.uniform(-1, 1), 1, random.uniform(-1, 1)));
  const vec3 amplitude =
      room * vec3(random.uniform(0.4f, 1), random.uniform(0.4f, 1), random.uniform(0.4f, 1));
  scene.nodes[node].rotation = axis_angle(axis, 2 * kPi * phase);
  if (index % 2 == 0)
    animate_rotation(scene, node, kPeriod, 8, Interpolation::kLinear,
                     [=](float t) { return axis_angle(axis, 2 * kPi * (turns * t + phase)); });
  animate_translation(scene, node, kPeriod, 12, Interpolation::kCubicSpline, [=](float t) {
    const float a = 2 * kPi * (t + phase);
    return centre + amplitude * vec3(sine(a), sine(a + 1), cosine(a));
  });
}

// Radiance of a hue in turns; its three channels add up to 4.5, as those of the paper do on average.
vec3 glow(float hue) {
  const auto channel = [=](float shift) { return 1.5f + 1.25f * cosine(2 * kPi * (hue - shift)); };
  return vec3(channel(0), channel(1.0f / 3), channel(2.0f / 3));
}

void add_solids(Scene& scene, int count, std::uint32_t seed) {
  const Cells cells = cells_for(count);
  const float radius = 0.3f * std::min({cells.size.x, cells.size.y, cells.size.z});
  const float first_hue = RandomStream(seed, kColor).uniform();
  for (int i = 0; i < count; ++i) {
    const auto index = static_cast<std::uint32_t>(i);
    const std::string name = "solid " + std::to_string(i + 1);
    const vec3 radiance = glow(first_hue + 0.618034f * static_cast<float>(i));
    const int material = add_emitter(scene, name, radiance, vec3(0.64f));
    MeshBuilder builder;
    builder.set_transform(mat4(mat3(radius)));
    kShapes[index % kShapes.size()](builder);
    const int mesh = add_mesh(scene, builder, name, material);
    const vec3 cell(i % cells.nx, i / cells.nx % cells.ny, i / (cells.nx * cells.ny));
    const vec3 centre = kLo + (cell + 0.5f) * cells.size;
    const int node = add_node(scene, name, {mesh}, centre);
    animate_solid(scene, node, centre, 0.45f * cells.size - radius, seed, index);
  }
}

Scene make(const Parameters& parameters) {
  Scene scene;
  add_walls(scene);
  add_solids(scene, parameters.integer("solids"), parameters.seed());
  const vec3 eye(0.0535f, 1.1234f, 1.6662f);
  add_camera(scene, "camera", eye, eye + vec3(-0.0162f, -0.0792f, -0.9967f), 70);
  return scene;
}

}  // namespace

Definition cornell_lights() {
  return {"cornell-lights",
          "Cornell box with moving luminous solids: 12,146 emissive triangles",
          true,
          {{"solids",
            "12",
            "number of luminous solids, about 1,000 triangles each (0 to 1000)",
            0,
            1000,
            false,
            {}},
           seed_parameter()},
          make};
}

}  // namespace lumigrove::builtin
