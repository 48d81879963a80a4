// `fireflies`: n tiny emitters in drifting swarms over wooded hills, for scaling studies. Their total flux
// does not depend on n, so that pictures of different n have the same brightness.
#include <algorithm>
#include <array>
#include <cmath>

#include "scene/builtin/builtin.h"
#include "scene/builtin/noise.h"
#include "scene/builtin/random_stream.h"
#include "scene/builtin/scene_parts.h"

namespace lumigrove::builtin {
namespace {

constexpr float kHalfWidth = 60;     // metres; the land is a square
constexpr float kTotalFlux = 36000;  // W, all fireflies together
constexpr float kRadiance = 300;  // W/(sr m^2) of a luminous triangle, while that keeps it under kLargestEdge
constexpr float kLargestEdge = 0.3f;  // metres
constexpr float kPeriod = 10;         // seconds
constexpr vec2 kEye(-3, 46);          // x, z of the camera
enum Purpose : std::uint32_t { kHills, kSwarm, kTree, kRock };

// Colours of the swarms, luminance about one.
constexpr std::array<vec3, 8> kColors = {
    vec3(0.9f, 1.15f, 0.15f), vec3(0.5f, 1.3f, 0.2f), vec3(1.5f, 0.95f, 0.2f), vec3(0.3f, 1.25f, 0.6f),
    vec3(1.9f, 0.8f, 0.15f),  vec3(0.6f, 1.1f, 1.1f), vec3(1.2f, 1.05f, 0.1f), vec3(1.4f, 0.8f, 1.6f)};

struct Land {
  std::uint32_t seed;

  float height(vec2 p) const {
    const float hills = 14 * fractal_noise(p / 38.0f + 100.0f, 4, seed);
    const float valley = glm::smoothstep(2.0f, 26.0f, std::abs(p.x - 5 * sine(p.y * 0.09f)));
    return hills * (0.25f + 0.75f * valley) + 3.5f * valley;
  }
  vec3 on_ground(vec2 p, float above = 0) const { return vec3(p.x, height(p) + above, p.y); }
};

void add_land(Scene& scene, const Land& land) {
  MeshBuilder builder;
  const auto surface = [&](float s, float t) {
    return land.on_ground(vec2(2 * s - 1, 1 - 2 * t) * kHalfWidth);  // d/ds x d/dt points up
  };
  builder.sheet(surface, 240, 240);
  add_static(scene, builder, "land", add_surface(scene, "grass", vec3(0.30f, 0.34f, 0.20f)));
}

void add_trees(Scene& scene, const Land& land, std::uint32_t seed) {
  MeshBuilder builder;
  builder.cylinder(vec3(0, -0.5f, 0), vec3(0, 1.2f, 0), 0.22f, 0.18f, 8, false);
  const int trunk = add_mesh(scene, builder, "trunk", add_surface(scene, "bark", vec3(0.30f, 0.20f, 0.13f)));
  const vec2 crown[] = {{0, 0.8f},     {1.7f, 0.9f},  {0.8f, 2.4f}, {1.3f, 2.3f},
                        {0.55f, 3.8f}, {0.95f, 3.7f}, {0, 5.6f}};
  builder.lathe(vec3(0), crown, 14, false);
  const int needles =
      add_mesh(scene, builder, "needles", add_surface(scene, "needles", vec3(0.16f, 0.30f, 0.15f)));
  for (std::uint32_t i = 0; i < 260; ++i) {
    RandomStream random(seed, kTree, i);
    const vec2 p(random.uniform(-kHalfWidth, kHalfWidth), random.uniform(-kHalfWidth, kHalfWidth));
    const float size = random.uniform(0.7f, 1.7f), turn = random.uniform(0, 2 * kPi);
    if (glm::length(p - kEye) < 16 || std::abs(p.x - 5 * sine(p.y * 0.09f)) < 4) continue;
    const int node =
        add_node(scene, "tree", {trunk, needles}, land.on_ground(p), axis_angle(vec3(0, 1, 0), turn));
    scene.nodes[node].scale = vec3(size);
  }
}

void add_rocks(Scene& scene, const Land& land, std::uint32_t seed) {
  MeshBuilder builder;
  builder.icosphere(vec3(0), 1, 2);
  const int rock = add_mesh(scene, builder, "rock", add_surface(scene, "rock", vec3(0.42f, 0.40f, 0.38f)));
  for (std::uint32_t i = 0; i < 120; ++i) {
    RandomStream random(seed, kRock, i);
    const vec2 p(random.uniform(-kHalfWidth, kHalfWidth), random.uniform(-kHalfWidth, kHalfWidth));
    const float size = random.uniform(0.2f, 0.9f);
    if (glm::length(p - kEye) < 4) continue;
    const int node = add_node(scene, "rock", {rock}, land.on_ground(p));
    scene.nodes[node].rotation = axis_angle(vec3(0, 1, 0), random.uniform(0, 2 * kPi));
    scene.nodes[node].scale = size * vec3(1, random.uniform(0.5f, 0.9f), random.uniform(0.6f, 1));
  }
}

// Where firefly `i` hovers: near the ground, thicker where the noise is high.
vec3 hover(const Land& land, RandomStream& random) {
  vec2 p(0);
  for (int attempt = 0; attempt < 4; ++attempt) {
    p = vec2(random.uniform(-1, 1), random.uniform(-1, 1)) * (kHalfWidth - 1);
    if (random.uniform() < glm::smoothstep(0.42f, 0.62f, value_noise(p / 7.0f + 50.0f, land.seed ^ 0x5bd1u)))
      break;
  }
  const float lift = random.uniform();
  return land.on_ground(p, 0.35f + 2.6f * lift * lift);
}

vec3 direction(RandomStream& random) {
  const float z = random.uniform(-1, 1), r = std::sqrt(std::max(0.0f, 1 - z * z)),
              angle = random.uniform(0, 2 * kPi);
  return vec3(r * cosine(angle), r * sine(angle), z);
}

int swarm_count(int n) { return std::min(n, static_cast<int>(kColors.size())); }

// A node for each colour's swarm, drifting a hand's breadth.
int add_swarm_node(Scene& scene, int swarm, std::vector<int> meshes) {
  const int node = add_node(scene, "swarm " + std::to_string(swarm + 1), std::move(meshes));
  const float lag = static_cast<float>(swarm) / 8;
  animate_translation(scene, node, kPeriod, 8, Interpolation::kCubicSpline, [=](float phase) {
    const float a = 2 * kPi * (phase + lag);
    return vec3(0.4f * sine(a), 0.12f * sine(2 * a), 0.4f * cosine(a));
  });
  return node;
}

void add_triangles(Scene& scene, const Land& land, int n, std::uint32_t seed) {
  const float flux = kTotalFlux / static_cast<float>(n);
  const float edge = std::min(kLargestEdge, std::sqrt(flux / (kPi * kRadiance) * 4 / std::sqrt(3.0f)));
  const float radiance = flux / (kPi * edge * edge * std::sqrt(3.0f) / 4);
  const int swarms = swarm_count(n);
  for (int s = 0; s < swarms; ++s) {
    Mesh mesh;
    mesh.name = "swarm " + std::to_string(s + 1);
    mesh.material = add_emitter(scene, mesh.name, radiance * kColors[s]);
    const std::uint32_t count = static_cast<std::uint32_t>((n - s + swarms - 1) / swarms);
    mesh.positions.reserve(3 * count);
    mesh.triangles.reserve(count);
    for (std::uint32_t i = 0; i < count; ++i) {
      RandomStream random(seed, kSwarm,
                          i * static_cast<std::uint32_t>(kColors.size()) + static_cast<std::uint32_t>(s));
      const vec3 centre = hover(land, random), normal = direction(random);
      const Frame frame = make_frame(normal);
      const float inner = edge / (2 * std::sqrt(3.0f));  // inscribed circle
      mesh.positions.push_back(centre + 2 * inner * frame.x);
      mesh.positions.push_back(centre - inner * frame.x + 0.5f * edge * frame.y);
      mesh.positions.push_back(centre - inner * frame.x - 0.5f * edge * frame.y);
      mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
    }
    scene.meshes.push_back(std::move(mesh));
    add_swarm_node(scene, s, {static_cast<int>(scene.meshes.size()) - 1});
  }
}

void add_points(Scene& scene, const Land& land, int n, std::uint32_t seed) {
  const int swarms = swarm_count(n);
  std::array<int, kColors.size()> parents{};
  for (int s = 0; s < swarms; ++s) {
    PunctualLight light;
    light.name = "firefly " + std::to_string(s + 1);
    light.color = kTotalFlux / static_cast<float>(n) / (4 * kPi) * kColors[s];
    scene.lights.push_back(light);
    parents[s] = add_swarm_node(scene, s, {});
  }
  scene.nodes.reserve(scene.nodes.size() + static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    RandomStream random(seed, kSwarm, static_cast<std::uint32_t>(i));
    Node& node = scene.nodes.emplace_back();
    node.translation = hover(land, random);
    node.parent = parents[i % swarms];
    node.light = i % swarms;
  }
}

Scene make(const Parameters& parameters) {
  Scene scene;
  const std::uint32_t seed = parameters.seed();
  const Land land{pcg4d(uvec4(seed, kHills, 0, 0)).x};
  add_land(scene, land);
  add_trees(scene, land, seed);
  add_rocks(scene, land, seed);
  const int n = parameters.integer("n");
  if (parameters.text("kind") == "point")
    add_points(scene, land, n, seed);
  else
    add_triangles(scene, land, n, seed);
  const vec3 eye = land.on_ground(kEye, 4.5f);
  add_camera(scene, "camera", eye, land.on_ground(vec2(0, 8), 0.5f), 45);
  return scene;
}

}  // namespace

Definition fireflies() {
  return {
      "fireflies",
      "n small emitters in swarms over wooded hills, for scaling",
      true,
      {{"n", "20000", "number of emitters (1 to 10000000)", 1, 1e7, false, {}},
       {"kind", "triangle", "what each emitter is: triangle or point", 0, 0, false, {"triangle", "point"}},
       seed_parameter()},
      make};
}

}  // namespace lumigrove::builtin
