// The tracer against a brute-force loop over all triangles in double precision.
#include "trace/trace.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>
#include <random>

#include "trace/flatten.h"

namespace lumigrove {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  float uniform(float lo, float hi) { return lo + (hi - lo) * static_cast<float>(engine_() >> 8) * 0x1p-24f; }
  vec3 in_cube(float half) {
    const float x = uniform(-half, half), y = uniform(-half, half), z = uniform(-half, half);
    return vec3(x, y, z);
  }

 private:
  std::mt19937 engine_;
};

Mesh random_mesh(Random& random, int triangles) {
  Mesh mesh;
  for (int t = 0; t < triangles; ++t) {
    const vec3 centre = random.in_cube(1);
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (int k = 0; k < 3; ++k) mesh.positions.push_back(centre + random.in_cube(0.4f));
    mesh.triangles.push_back(uvec3(first, first + 1, first + 2));
  }
  return mesh;
}

mat4x3 random_map(Random& random, bool mirrored) {
  mat4x3 m;
  do {
    for (int c = 0; c < 3; ++c) m[c] = random.in_cube(1);
  } while (std::abs(glm::dot(m[0], glm::cross(m[1], m[2]))) < 0.2f);
  if ((glm::dot(m[0], glm::cross(m[1], m[2])) < 0) != mirrored) m[0] = -m[0];
  m[3] = random.in_cube(4);
  return m;
}

// Baked, shared and moving instances; some mirrored, all sheared and scaled unevenly.
struct World {
  Scene scene;
  SceneState state;
};

// So many triangles (broken ones, which are quick to build) that what moves is traced as instances.
void add_bulk(World& world) {
  Mesh mesh;
  mesh.positions.assign(3, vec3(kNan));
  mesh.triangles.assign(kMaxRebuiltSoup, uvec3(0, 1, 2));
  MeshInstance instance;
  instance.mesh = static_cast<int>(world.scene.meshes.size());
  world.scene.meshes.push_back(mesh);
  world.state.instances.push_back(instance);
}

World random_world(unsigned seed) {
  Random random(seed);
  World world;
  world.scene.materials.resize(1);
  for (int m = 0; m < 4; ++m) world.scene.meshes.push_back(random_mesh(random, 40));
  for (int i = 0; i < 9; ++i) {
    MeshInstance instance;
    instance.mesh = i % 4;
    instance.to_world = random_map(random, i % 2 == 1);
    instance.moves = i % 3 == 2;
    world.state.instances.push_back(instance);
  }
  return world;
}

std::vector<Ray> random_rays(unsigned seed, int count) {
  Random random(seed);
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i) {
    const vec3 from = random.in_cube(6), to = random.in_cube(3);
    const float scale = random.uniform(0.1f, 3);
    rays.push_back({from, 0, (to - from) * scale, i % 2 ? kInfinity : random.uniform(0.1f, 2) / scale});
  }
  return rays;
}

struct BruteHit {
  bool hit = false;
  bool doubtful = false;  // an edge or an end of the segment is so close that rounding decides
  std::uint32_t instance = 0, triangle = 0;
  double t = 0, u = 0, v = 0;
};

BruteHit intersect(const World& world, const Ray& ray) {
  using dvec3 = glm::dvec3;
  constexpr double kMargin = 1e-4;
  BruteHit best;
  best.t = ray.tmax;
  bool doubtful = false;
  for (std::uint32_t i = 0; i < world.state.instances.size(); ++i) {
    const MeshInstance& instance = world.state.instances[i];
    const Mesh& mesh = world.scene.meshes[static_cast<std::size_t>(instance.mesh)];
    for (std::uint32_t k = 0; k < mesh.triangles.size(); ++k) {
      dvec3 p[3];
      for (int c = 0; c < 3; ++c) {
        const dvec3 q(mesh.positions[mesh.triangles[k][c]]);
        p[c] = dvec3(instance.to_world[0]) * q.x + dvec3(instance.to_world[1]) * q.y +
               dvec3(instance.to_world[2]) * q.z + dvec3(instance.to_world[3]);
      }
      const dvec3 d(ray.direction), o(ray.origin), e1 = p[1] - p[0], e2 = p[2] - p[0];
      const dvec3 h = glm::cross(d, e2);
      const double a = glm::dot(e1, h);
      if (a == 0) continue;
      const dvec3 s = o - p[0];
      const double u = glm::dot(s, h) / a, v = glm::dot(d, glm::cross(s, e1)) / a;
      const double t = glm::dot(e2, glm::cross(s, e1)) / a;
      const double inside = std::min({u, v, 1 - u - v});
      if (inside < -kMargin || t < ray.tmin - kMargin || t > ray.tmax * (1 + kMargin)) continue;
      if (inside < kMargin || std::abs(t - ray.tmin) < kMargin || std::abs(t - ray.tmax) < kMargin * t) {
        doubtful = true;
        continue;
      }
      if (std::abs(t - best.t) < kMargin * t) doubtful = true;
      if (t < best.t) best = {true, false, i, k, t, u, v};
    }
  }
  best.doubtful = doubtful;
  return best;
}

void expect_agreement(const World& world, const Tracer& tracer, Coherence coherence, unsigned seed) {
  const std::vector<Ray> rays = random_rays(seed, 3000);
  std::vector<Hit> hits(rays.size());
  std::vector<std::uint8_t> occluded(rays.size());
  tracer.closest(rays, hits, coherence);
  tracer.occluded(rays, occluded, coherence);
  int tested = 0, hit_count = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(occluded[i] != 0, hits[i].instance != kNoId) << i;
    const BruteHit brute = intersect(world, rays[i]);
    if (brute.doubtful) continue;
    ++tested;
    ASSERT_EQ(hits[i].instance != kNoId, brute.hit) << i;
    if (!brute.hit) continue;
    ++hit_count;
    EXPECT_EQ(hits[i].instance, brute.instance) << i;
    EXPECT_EQ(hits[i].triangle, brute.triangle) << i;
    EXPECT_NEAR(hits[i].t, brute.t, 1e-4 * brute.t) << i;
    EXPECT_NEAR(hits[i].u, brute.u, 2e-3) << i;
    EXPECT_NEAR(hits[i].v, brute.v, 2e-3) << i;
  }
  EXPECT_GT(tested, 2500);
  EXPECT_GT(hit_count, 200);
}

TEST(Tracer, AgreesWithBruteForceOnMirroredAndScaledMeshes) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const World world = random_world(seed);
    EXPECT_TRUE(plan_trace(world.scene, world.state).instanced.empty());
    const Tracer tracer(world.scene, world.state);
    expect_agreement(world, tracer, Coherence::kCoherent, seed + 100);
    expect_agreement(world, tracer, Coherence::kIncoherent, seed + 200);
  }
}

TEST(Tracer, AgreesWithBruteForceOnInstances) {
  World world = random_world(4);
  World bulky = world;
  add_bulk(bulky);
  EXPECT_EQ(plan_trace(bulky.scene, bulky.state).instanced, (std::vector<std::uint32_t>{2, 5, 8}));
  const Tracer tracer(bulky.scene, bulky.state);
  expect_agreement(world, tracer, Coherence::kCoherent, 5);
  expect_agreement(world, tracer, Coherence::kIncoherent, 6);
}

TEST(Tracer, AgreesWithBruteForceAfterAnUpdate) {
  for (const bool instanced : {false, true}) {
    World world = random_world(7), traced = world;
    if (instanced) add_bulk(traced);
    Tracer tracer(traced.scene, traced.state);
    Random random(8);
    for (std::size_t i = 0; i < world.state.instances.size(); ++i) {
      MeshInstance& instance = world.state.instances[i];
      if (instance.moves) instance.to_world = random_map(random, i % 2 == 0);
      traced.state.instances[i].to_world = instance.to_world;
    }
    tracer.update(traced.state);
    expect_agreement(world, tracer, Coherence::kCoherent, 9);
  }
}

TEST(Tracer, RefusesTheStateOfAnotherScene) {
  World world = random_world(7);
  Tracer tracer(world.scene, world.state);
  world.state.instances.pop_back();
  EXPECT_THROW(tracer.update(world.state), Error);
}

TEST(Tracer, KeepsLargeSharedMeshesAsInstances) {
  World world;
  world.scene.materials.resize(1);
  world.scene.meshes.resize(2);
  world.scene.meshes[0].triangles.resize(kMaxBakedCopies / 2);
  world.scene.meshes[1].triangles.resize(2);
  for (int i = 0; i < 6; ++i) {
    MeshInstance instance;
    instance.mesh = i % 2;
    world.state.instances.push_back(instance);
  }
  const TracePlan plan = plan_trace(world.scene, world.state);
  EXPECT_EQ(plan.baked, (std::vector<std::uint32_t>{1, 3, 5}));
  EXPECT_EQ(plan.instanced, (std::vector<std::uint32_t>{0, 2, 4}));
  EXPECT_TRUE(plan.masked.empty());
}

// A unit square at height z, facing +z.
Mesh square(float z) {
  Mesh mesh;
  mesh.positions = {vec3(0, 0, z), vec3(1, 0, z), vec3(1, 1, z), vec3(0, 1, z)};
  mesh.uv0 = {vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 1)};
  mesh.triangles = {uvec3(0, 1, 2), uvec3(0, 2, 3)};
  return mesh;
}

// A leaf whose left half (u < 1/2) is transparent above a floor, as one instance that is baked, moves or is
// shared.
World leaf_over_floor(bool moves) {
  World world;
  world.scene.images.resize(1);
  Image8or32& image = world.scene.images[0];
  image.width = 2;
  image.height = 1;
  image.texels8 = {255, 255, 255, 0, 255, 255, 255, 255};
  world.scene.materials.resize(2);
  Material& leaf = world.scene.materials[1];
  leaf.alpha_mode = AlphaMode::kMask;
  leaf.base_color_texture.image = 0;
  leaf.base_color_texture.nearest = true;
  world.scene.meshes = {square(0), square(1)};
  world.scene.meshes[1].material = 1;
  world.state.instances.resize(2);
  world.state.instances[1].mesh = 1;
  world.state.instances[1].moves = moves;
  return world;
}

TEST(Tracer, CutsHolesWhereAlphaIsBelowTheCutoff) {
  for (const bool instanced : {false, true}) {
    World world = leaf_over_floor(instanced);
    if (instanced) add_bulk(world);
    ASSERT_EQ(plan_trace(world.scene, world.state).instanced.size(), instanced ? 1u : 0u);
    const Tracer tracer(world.scene, world.state);
    std::vector<Ray> down;
    for (int i = 0; i < 20; ++i) {
      down.push_back({vec3((static_cast<float>(i) + 0.5f) / 20, 0.3f, 2), 0, vec3(0, 0, -1), kInfinity});
    }
    std::vector<Hit> hits(down.size());
    std::vector<std::uint8_t> occluded(down.size());
    for (const Coherence coherence : {Coherence::kCoherent, Coherence::kIncoherent}) {
      tracer.closest(down, hits, coherence);
      for (std::size_t i = 0; i < down.size(); ++i) {
        EXPECT_EQ(hits[i].instance, down[i].origin.x < 0.5f ? 0u : 1u) << i;
        EXPECT_FLOAT_EQ(hits[i].t, down[i].origin.x < 0.5f ? 2.0f : 1.0f) << i;
      }
      // Shadow rays from the floor upwards: light falls through the hole only.
      std::vector<Ray> up;
      for (const Ray& ray : down) up.push_back({vec3(ray.origin.x, 0.3f, 0), 1e-3f, vec3(0, 0, 1), 3});
      tracer.occluded(up, occluded, coherence);
      for (std::size_t i = 0; i < up.size(); ++i) EXPECT_EQ(occluded[i] != 0, up[i].origin.x >= 0.5f) << i;
    }
  }
}

TEST(Tracer, MaskUsesMaterialAndVertexAlpha) {
  World world = leaf_over_floor(false);
  world.scene.materials[1].base_color_texture.image = -1;
  world.scene.materials[1].alpha = 0.8f;
  world.scene.meshes[1].colors = {vec4(1, 1, 1, 0), vec4(1), vec4(1), vec4(1, 1, 1, 0)};  // alpha = 0.8 x
  const Tracer tracer(world.scene, world.state);
  const std::vector<Ray> rays = {{vec3(0.60f, 0.3f, 2), 0, vec3(0, 0, -1), 1.5f},   // 0.48 < 0.5
                                 {vec3(0.65f, 0.3f, 2), 0, vec3(0, 0, -1), 1.5f}};  // 0.52
  std::vector<std::uint8_t> occluded(rays.size());
  tracer.occluded(rays, occluded, Coherence::kIncoherent);
  EXPECT_EQ(occluded[0], 0);
  EXPECT_EQ(occluded[1], 1);
}

TEST(Tracer, IgnoresRaysThatAreNotToBeTraced) {
  World world = leaf_over_floor(true);
  add_bulk(world);
  const Tracer tracer(world.scene, world.state);
  const Ray good{vec3(0.7f, 0.3f, 2), 0, vec3(0, 0, -1), kInfinity};
  std::vector<Ray> rays(16, good);
  rays[0].origin.x = kNan;
  rays[1].direction.y = kNan;
  rays[2].tmin = kNan;
  rays[3].tmax = kNan;
  rays[4].tmin = 2, rays[4].tmax = 1;
  rays[5].origin.z = kInfinity;
  rays[6].direction.z = -kInfinity;
  rays[7] = Ray{};
  rays[7].origin = rays[7].direction = vec3(0);
  rays[8].tmin = -3, rays[8].tmax = -1;
  rays[9].direction = vec3(0);
  rays[10].tmax = -kInfinity;
  for (const Coherence coherence : {Coherence::kCoherent, Coherence::kIncoherent}) {
    std::vector<Hit> hits(rays.size());
    std::vector<std::uint8_t> occluded(rays.size(), 7);
    tracer.closest(rays, hits, coherence);
    tracer.occluded(rays, occluded, coherence);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      EXPECT_EQ(hits[i].instance, i <= 10 ? kNoId : 1u) << i;
      EXPECT_EQ(occluded[i], i <= 10 ? 0 : 1) << i;
    }
  }
}

TEST(Tracer, SkipsBrokenTrianglesAndTransforms) {
  World world;
  world.scene.materials.resize(1);
  world.scene.meshes = {square(0), square(1), square(2), Mesh{}};
  Mesh& broken = world.scene.meshes[1];
  broken.positions[1].x = kNan;                // first triangle NaN, second whole
  broken.triangles.push_back(uvec3(0, 2, 2));  // no area
  broken.triangles.push_back(uvec3(3, 3, 3));
  for (int i = 0; i < 4; ++i) {
    MeshInstance instance;
    instance.mesh = i;
    instance.moves = i == 2;
    world.state.instances.push_back(instance);
  }
  world.state.instances[2].to_world = mat4x3(0.0f);  // moving and collapsed to a point
  add_bulk(world);
  const Tracer tracer(world.scene, world.state);
  const std::vector<Ray> rays = {{vec3(0.7f, 0.3f, 3), 0, vec3(0, 0, -1), kInfinity},
                                 {vec3(0.3f, 0.7f, 3), 0, vec3(0, 0, -1), kInfinity},
                                 {vec3(0, 0, 3), 0, vec3(0, 0, -1), 2.5f}};
  std::vector<Hit> hits(rays.size());
  tracer.closest(rays, hits, Coherence::kCoherent);
  EXPECT_EQ(hits[0].instance, 0u);
  EXPECT_EQ(hits[1].instance, 1u);
  EXPECT_EQ(hits[1].triangle, 1u);
}

TEST(Tracer, HitsNothingInAnEmptyScene) {
  const Scene scene;
  const Tracer tracer(scene, SceneState{});
  const std::vector<Ray> rays(3, Ray{vec3(0), 0, vec3(0, 0, 1), kInfinity});
  std::vector<Hit> hits(3);
  std::vector<std::uint8_t> occluded(3, 1);
  tracer.closest(rays, hits, Coherence::kCoherent);
  tracer.occluded(rays, occluded, Coherence::kIncoherent);
  for (const Hit& hit : hits) EXPECT_EQ(hit.instance, kNoId);
  for (const std::uint8_t o : occluded) EXPECT_EQ(o, 0);
  tracer.closest({}, {}, Coherence::kCoherent);
}

TEST(Tracer, CountsItsMemory) {
  const World world = random_world(1);
  const Tracer tracer(world.scene, world.state), empty(Scene{}, SceneState{});
  EXPECT_GT(tracer.bytes(), 40u * 9u * 32u);
  EXPECT_LT(empty.bytes(), tracer.bytes());
}

TEST(Tracer, RecordsWhatItIsAsked) {
  const World world = random_world(1);
  Tracer tracer(world.scene, world.state);
  const std::vector<Ray> rays = random_rays(5, 50);
  std::vector<Hit> hits(50);
  std::vector<std::uint8_t> occluded(50);
  RayRecorder recorder;
  tracer.record(&recorder);
  tracer.closest(rays, hits, Coherence::kCoherent);
  tracer.occluded(rays, occluded, Coherence::kIncoherent);
  tracer.occluded(rays, occluded, Coherence::kIncoherent);
  tracer.record(nullptr);
  tracer.closest(rays, hits, Coherence::kCoherent);
  ASSERT_EQ(recorder.closest.size(), 50u);
  ASSERT_EQ(recorder.occluded.size(), 100u);
  EXPECT_EQ(recorder.closest[17].origin, rays[17].origin);
  EXPECT_EQ(recorder.occluded[67].direction, rays[17].direction);
}

// A grid with every triangle present twice: ties everywhere, enough triangles for a parallel build.
TEST(Tracer, HasTheSameHitsForAnyThreadCount) {
  World world;
  world.scene.materials.resize(1);
  Mesh mesh;
  constexpr int kSize = 120;
  Random random(3);
  for (int y = 0; y <= kSize; ++y) {
    for (int x = 0; x <= kSize; ++x) {
      mesh.positions.push_back(vec3(static_cast<float>(x), static_cast<float>(y), random.uniform(0, 1)));
    }
  }
  for (std::uint32_t y = 0; y < kSize; ++y) {
    for (std::uint32_t x = 0; x < kSize; ++x) {
      const std::uint32_t a = y * (kSize + 1) + x, b = a + kSize + 1;
      mesh.triangles.push_back(uvec3(a, a + 1, b));
      mesh.triangles.push_back(uvec3(a + 1, b + 1, b));
    }
  }
  world.scene.meshes = {mesh, mesh};
  world.state.instances.resize(2);
  world.state.instances[1].mesh = 1;
  std::vector<Ray> rays;
  for (int i = 0; i < 20000; ++i) {
    const vec3 to(random.uniform(0, kSize), random.uniform(0, kSize), 0.5f);
    const vec3 from(random.uniform(0, kSize), random.uniform(0, kSize), 50);
    rays.push_back({from, 0, to - from, kInfinity});
  }
  std::vector<Hit> first;
  for (const int threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(threads));
    const Tracer tracer(world.scene, world.state);
    std::vector<Hit> hits(rays.size());
    tracer.closest(rays, hits, Coherence::kCoherent);
    if (first.empty()) first = hits;
    int different = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      different += hits[i].instance != first[i].instance || hits[i].triangle != first[i].triangle ||
                   hits[i].t != first[i].t || hits[i].u != first[i].u;
    }
    EXPECT_EQ(different, 0) << threads << " threads";
  }
}

}  // namespace
}  // namespace lumigrove
