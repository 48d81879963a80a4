#include "methods/vpl/vpl.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>
#include <functional>
#include <memory>

#include "light_fixtures.h"
#include "light_scenes.h"
#include "methods/vpl/vpl_kernel.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

PunctualLight punctual(LightType type, vec3 color, float range = 0) {
  PunctualLight light;
  light.type = type;
  light.color = color;
  light.range = range;
  light.inner_cone = 0.3f;
  light.outer_cone = 0.7f;
  return light;
}

// A scene and what tracing needs of it.
class VplWorld {
 public:
  explicit VplWorld(Scene scene)
      : scene_(std::make_unique<Scene>(std::move(scene))),
        state_(evaluate(*scene_, 0)),
        arrays_(with_state(*scene_, state_)),
        tracer_(*scene_, state_),
        lights_(*scene_, arrays_) {
    lights_.gather(arrays_, state_, Settings{});
  }

  LightSources sources() const { return {arrays_.view(), lights_.view(), with_margin(state_.bounds)}; }
  VplTracing tracing(int paths, int bounces, std::uint32_t frame = 0) const {
    VplTracing tracing;
    tracing.scene = arrays_.view();
    tracing.lights = lights_.view();
    tracing.bounds = state_.bounds;
    tracing.tracer = &tracer_;
    tracing.rng = {7, frame, 0};
    tracing.paths = paths;
    tracing.bounces = bounces;
    tracing.roulette_start = 100;
    tracing.force_diffuse = true;
    return tracing;
  }

 private:
  static SceneArrays with_state(const Scene& scene, const SceneState& state) {
    SceneArrays arrays(scene);
    arrays.set_state(state);
    return arrays;
  }

  std::unique_ptr<Scene> scene_;
  SceneState state_;
  SceneArrays arrays_;
  Tracer tracer_;
  LightSet lights_;
};

double sum_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum;
}

// --- what lights send out ------------------------------------------------------------------------------------

constexpr int kRays = 20000;

// Mean flux (green) of the rays of light number `index`.
RunningMean mean_flux(const LightSources& sources, std::uint32_t index = 0) {
  RunningMean mean;
  Stream random(3);
  for (int i = 0; i < kRays; ++i) {
    const vec4 u = random.next();
    const EmittedRay ray = emit(sources, index, u, random.next().x);
    mean.add(static_cast<double>(ray.flux.y));
    if (!(ray.flux.y > 0)) continue;
    EXPECT_NEAR(glm::length(ray.direction), 1, 1e-5);
  }
  return mean;
}

// Flux with and without noise: what is exact is held to rounding.
void expect_flux(const LightSources& sources, double expected) {
  EXPECT_TRUE(mean_within(mean_flux(sources), expected, 4, 1e-5 * expected));
}

// Right triangle of area 1, front up; texture coordinates (0,0), (1,0), (0,1).
Scene lone_triangle(const std::function<void(Scene&, Material&)>& change = {}) {
  SceneBuilder b;
  const int material = b.material(vec3(0.5f), vec3(2, 3, 4));
  Mesh mesh;
  mesh.material = material;
  mesh.positions = {vec3(0), vec3(0, 0, 1), vec3(2, 0, 0)};
  mesh.uv0 = {vec2(0), vec2(1, 0), vec2(0, 1)};
  mesh.triangles = {uvec3(0, 1, 2)};
  b.scene.meshes = {mesh};
  Node node;
  node.meshes = {0};
  b.scene.nodes = {node};
  if (change) change(b.scene, b.scene.materials[0]);
  return b.scene;
}

// Two texels side by side: left and right of u = 1/2. Colour and alpha.
int add_halves(Scene& scene, vec4 left, vec4 right) {
  Image8or32 image;
  image.name = "halves";
  image.width = 2;
  image.height = 1;
  for (int c = 0; c < 4; ++c) image.texels32.push_back(left[c]);
  for (int c = 0; c < 4; ++c) image.texels32.push_back(right[c]);
  scene.images.push_back(image);
  return static_cast<int>(scene.images.size()) - 1;
}

void texture_with_halves(Scene& scene, Material& material) {
  material.emissive_texture.image = add_halves(scene, vec4(1), vec4(3));
  material.emissive_texture.nearest = true;
}
void cut_the_left_half(Scene& scene, Material& material) {
  material.base_color_texture.image = add_halves(scene, vec4(1, 1, 1, 0), vec4(1));
  material.base_color_texture.nearest = true;
  material.alpha_mode = AlphaMode::kMask;
}

TEST(Emission, TrianglesSendOutPiLA) {
  expect_flux(VplWorld(lone_triangle()).sources(), 3 * M_PI);
  expect_flux(VplWorld(lone_triangle([](Scene&, Material& m) { m.double_sided = true; })).sources(), 6 * M_PI);
  // Three quarters of the triangle lie left of u = 1/2.
  expect_flux(VplWorld(lone_triangle(texture_with_halves)).sources(), (0.75 + 0.25 * 3) * 3 * M_PI);
  expect_flux(VplWorld(lone_triangle(cut_the_left_half)).sources(), 0.25 * 3 * M_PI);
}

TEST(Emission, TrianglesShineFromTheirFrontOrFromBothSides) {
  for (const bool double_sided : {false, true}) {
    for (const float mirror : {1.0f, -1.0f}) {
      const VplWorld world(lone_triangle([&](Scene& scene, Material& m) {
        m.double_sided = double_sided;
        scene.nodes[0].scale = vec3(mirror, 1, 1);
        cut_the_left_half(scene, m);
      }));
      Stream random(1);
      RunningMean cosine;
      int up = 0, lit = 0;
      for (int i = 0; i < kRays; ++i) {
        const vec4 u = random.next();
        const EmittedRay ray = emit(world.sources(), 0, u, random.next().x);
        if (!(ray.flux.y > 0)) continue;
        ++lit;
        up += ray.direction.y > 0;
        EXPECT_GT(ray.origin.y * ray.direction.y, 0);  // starts clear of its own triangle
        EXPECT_GE(ray.origin.z, 0.5f);                 // right of u = 1/2: u runs along z
        EXPECT_GE(ray.origin.x * mirror, 0.0f);
        cosine.add(static_cast<double>(std::abs(ray.direction.y)));
      }
      EXPECT_TRUE(mean_within(cosine, 2.0 / 3));
      EXPECT_TRUE(mean_within(up, 0.5 * std::sqrt(lit), double_sided ? 0.5 * lit : lit));
    }
  }
}

TEST(Emission, PointAndSpotLightsSendOutTheirIntensityOverAllDirections) {
  const auto world_of = [](const PunctualLight& light) {
    Scene scene = lone_triangle([](Scene&, Material& m) { m.emission = vec3(0); });
    add_light(scene, light, vec3(1, 2, 3));
    return VplWorld(std::move(scene));
  };
  expect_flux(world_of(punctual(LightType::kPoint, vec3(5))).sources(), 4 * M_PI * 5);
  for (const float outer : {0.005f, 0.3f, 0.7f, 2.5f}) {
    PunctualLight light = punctual(LightType::kSpot, vec3(5));
    light.outer_cone = outer;
    light.inner_cone = outer == 0.3f ? outer : 0.4f * outer;
    const double co = std::cos(outer), slope = 1 / std::max(1e-4, std::cos(light.inner_cone) - co);
    double integral = 0;
    constexpr int kSteps = 100000;
    for (int i = 0; i < kSteps; ++i) {
      const double ramp = std::min(1.0, (1 - co) * (i + 0.5) / kSteps * slope);
      integral += 2 * M_PI * (1 - co) / kSteps * ramp * ramp;
    }
    const VplWorld world = world_of(light);
    // The cosine of a cone of a third of a degree has three digits left.
    EXPECT_TRUE(mean_within(mean_flux(world.sources()), 5 * integral, 4, (outer < 0.01f ? 0.02 : 1e-3) * integral));
    EXPECT_NEAR(static_cast<double>(source_flux(world.sources(), 0)) / (5 * integral), 1, outer < 0.01f ? 0.02 : 1e-3);
  }
}

// A box of 2 x 3 x 5.
Scene box_scene() {
  SceneBuilder b;
  b.room(vec3(-1, 0, 2), vec3(1, 3, 7), b.material(vec3(0.5f)));
  return b.scene;
}

TEST(Emission, DirectionalLightsSendTheirIrradianceThroughTheBox) {
  for (const vec3 along : {vec3(0, -1, 0), vec3(1, 2, -3), vec3(-1, 1e-4f, 0)}) {
    SceneBuilder b;
    b.scene = box_scene();
    b.punctual(punctual(LightType::kDirectional, vec3(2)), vec3(0), along);
    const VplWorld world(b.scene);
    const vec3 w = glm::normalize(along);
    const double area = std::abs(w.x) * 15.0 + std::abs(w.y) * 10.0 + std::abs(w.z) * 6.0;
    EXPECT_TRUE(mean_within(mean_flux(world.sources()), 2 * area, 4, 4e-3 * area));  // the box has a margin
    EXPECT_NEAR(static_cast<double>(source_flux(world.sources(), 0)), 2 * area, 4e-3 * area);
  }
}

TEST(Emission, RaysFromInfinityEnterTheBoxEvenly) {
  const VplWorld world(box_scene());
  const Box3 box = world.sources().box;
  const vec3 w = glm::normalize(vec3(1, 2, -3));
  const Frame frame = make_frame(w);
  // Counts over the plane across w are even where the box projects to, so their density is 1 / projected area.
  constexpr int kCells = 24;
  constexpr float kSize = 0.25f;
  const vec3 centre = box.centre();
  const auto cell = [&](vec3 p) {
    const vec3 local = frame.to_local(p - centre);
    const int x = static_cast<int>(std::floor(local.x / kSize)) + kCells / 2;
    const int y = static_cast<int>(std::floor(local.y / kSize)) + kCells / 2;
    return static_cast<std::size_t>(std::clamp(y, 0, kCells - 1) * kCells + std::clamp(x, 0, kCells - 1));
  };
  std::vector<double> observed(kCells * kCells, 0), fraction(kCells * kCells, 0), expected;
  Stream random(6);
  for (int i = 0; i < 4 * kRays; ++i) {
    const vec3 p = sample_box_entry(box, w, vec3(random.next()));
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(p, box.lo)) && glm::all(glm::lessThanEqual(p, box.hi)));
    const vec3 before = p - w * 1e-3f;
    EXPECT_FALSE(glm::all(glm::greaterThan(before, box.lo)) && glm::all(glm::lessThan(before, box.hi)));
    ++observed[cell(p)];
  }
  constexpr int kSub = 40;  // of a cell, to measure its part that the box covers
  double total = 0;
  for (int k = 0; k < kCells * kCells * kSub * kSub; ++k) {
    const int x = k % (kCells * kSub), y = k / (kCells * kSub);
    const vec3 p = centre + frame.to_world(vec3((static_cast<float>(x) + 0.5f) / kSub - kCells / 2,
                                                (static_cast<float>(y) + 0.5f) / kSub - kCells / 2, 0) *
                                           vec3(kSize, kSize, 0));
    const vec3 a = (box.lo - p) / w, b = (box.hi - p) / w;
    const vec3 near = glm::min(a, b), far = glm::max(a, b);
    if (max_component(near) >= std::min(far.x, std::min(far.y, far.z))) continue;
    ++fraction[cell(p)];
    ++total;
  }
  for (const double f : fraction) expected.push_back(4 * kRays * f / total);
  for (std::size_t i = 0; i < expected.size(); ++i)  // cells that the outline only touches
    if (expected[i] == 0 && observed[i] <= 1) observed[i] = 0;
  EXPECT_GT(chi_square_p_value(observed, expected), 1e-4);
}

TEST(Emission, EnvironmentsSendTheirRadianceThroughTheBox) {
  const double surface = 2 * (15.0 + 10 + 6);
  Scene scene = box_scene();
  scene.environment.radiance = vec3(2);
  const VplWorld constant(scene);
  EXPECT_TRUE(mean_within(mean_flux(constant.sources()), 2 * M_PI * surface, 4, 2e-3 * surface));
  EXPECT_NEAR(static_cast<double>(source_flux(constant.sources(), 0)), 2 * M_PI * surface, 2e-2 * surface);

  Image8or32 sky;
  sky.name = "sky";
  sky.width = 8;
  sky.height = 4;
  for (int i = 0; i < 32; ++i)
    for (int c = 0; c < 4; ++c) sky.texels32.push_back(i == 11 ? 40.0f : 0.1f * static_cast<float>(i / 8));
  scene.images.push_back(sky);
  scene.environment.image = 0;
  const VplWorld pictured(scene);
  const LightSources sources = pictured.sources();
  double expected = 0;
  constexpr int kGrid = 400;
  for (int k = 0; k < kGrid * kGrid; ++k) {
    const float cosine = (static_cast<float>(k / kGrid) + 0.5f) * 2 / kGrid - 1;
    const vec3 w = equirect_to_direction((static_cast<float>(k % kGrid) + 0.5f) * 2 * kPi / kGrid, cosine);
    expected += static_cast<double>(environment_radiance(sources.scene, sources.lights.environment, w).y *
                                    projected_area(sources.box, w)) *
                4 * M_PI / (kGrid * kGrid);
  }
  EXPECT_TRUE(mean_within(mean_flux(sources), expected, 4, 2e-3 * expected));
}

// --- flux of the bounces -------------------------------------------------------------------------------------

constexpr float kRho = 0.6f;

// A closed room of one grey.
SceneBuilder grey_room(float rho = kRho) {
  SceneBuilder b;
  b.room(vec3(-1, -1, -1), vec3(1, 1.5f, 2), b.material(vec3(rho)));
  return b;
}

// With a lamp in it, of the same grey.
std::vector<Scene> lit_rooms() {
  std::vector<Scene> scenes;
  SceneBuilder point = grey_room(), spot = grey_room(), area = grey_room(), both = grey_room();
  point.punctual(punctual(LightType::kPoint, vec3(3)), vec3(0.2f, 0.3f, 0.1f), vec3(0, -1, 0));
  scenes.push_back(point.scene);
  spot.punctual(punctual(LightType::kSpot, vec3(3)), vec3(0.2f, 0.3f, 0.1f), vec3(1, -1, 0.4f));
  scenes.push_back(spot.scene);
  area.quad(vec3(-0.4f, 1.2f, 0), vec3(0.7f, 0, 0), vec3(0, 0, 0.7f), area.material(vec3(kRho), vec3(4)));
  scenes.push_back(area.scene);
  both.quad(vec3(-0.4f, 0.2f, 0), vec3(0.7f, 0, 0), vec3(0, 0.3f, 0.7f), both.material(vec3(kRho), vec3(4)));
  both.scene.materials.back().double_sided = true;
  scenes.push_back(both.scene);
  return scenes;
}

TEST(VplTracing, EveryBounceInAClosedRoomKeepsItsAlbedo) {
  for (const Scene& scene : lit_rooms()) {
    const VplWorld world(scene);
    VplSet set;
    set.trace(world.tracing(3000, 4));
    ASSERT_EQ(set.bounce_flux().size(), 4u);
    EXPECT_GT(set.emitted_flux(), 1);
    double before = set.emitted_flux();
    for (const double flux : set.bounce_flux()) {  // nothing is random here but where the light goes
      EXPECT_NEAR(flux / before, kRho, 1e-5);
      before = flux;
    }
    EXPECT_EQ(set.view().vpls.size(), set.rays());
    EXPECT_EQ(set.bytes(), set.rays() * sizeof(Vpl));
    double sum = 0;
    for (const Vpl& vpl : set.view().vpls) {
      sum += M_PI * static_cast<double>(luminance(vpl.intensity));
      EXPECT_NEAR(glm::length(vpl.normal), 1, 1e-5);
      EXPECT_TRUE(glm::all(glm::lessThanEqual(set.view().bounds.lo, vpl.position)));
      EXPECT_TRUE(glm::all(glm::greaterThanEqual(set.view().bounds.hi, vpl.position)));
    }
    EXPECT_NEAR(sum / sum_of(set.bounce_flux()), 1, 1e-5);
  }
}

TEST(VplTracing, LightsShineIntoTheRoom) {
  const VplWorld world(lit_rooms()[0]);
  VplSet set;
  set.trace(world.tracing(1000, 3));
  for (const Vpl& vpl : set.view().vpls) {
    const vec3 inwards = vec3(0, 0.25f, 0.5f) - vpl.position;
    EXPECT_GT(glm::dot(vpl.normal, inwards), 0);
    EXPECT_GT(vpl.epsilon, 0);
  }
}

// From outside, a convex shape catches all that comes through its box, and reflects it away.
TEST(VplTracing, LightFromInfinityMeetsAConvexShapeOnce) {
  SceneBuilder sun = grey_room(), sky = grey_room();
  sun.punctual(punctual(LightType::kDirectional, vec3(3)), vec3(0), vec3(1, -2, 0.5f));
  sky.scene.environment.radiance = vec3(0.7f);
  for (const Scene& scene : {sun.scene, sky.scene}) {
    const VplWorld world(scene);
    VplSet set;
    set.trace(world.tracing(4000, 3));
    EXPECT_NEAR(set.bounce_flux()[0] / set.emitted_flux(), kRho, 2e-3);  // the box has a margin
    EXPECT_EQ(set.bounce_flux()[1], 0);
    EXPECT_EQ(set.view().bounds.empty(), false);
  }
}

TEST(VplTracing, RouletteKeepsTheMeanFlux) {
  SceneBuilder b;
  b.room(vec3(-1), vec3(1, 1.5f, 2), b.material(vec3(0.7f, 0.5f, 0.2f)));
  b.punctual(punctual(LightType::kPoint, vec3(3)), vec3(0.2f, 0.3f, 0.1f), vec3(0, -1, 0));
  const VplWorld world(b.scene);
  VplSet set;
  VplTracing tracing = world.tracing(500, 10);
  set.trace(tracing);
  const double expected = sum_of(set.bounce_flux());  // without roulette there is no noise
  const std::uint64_t all_rays = set.rays();
  for (const int start : {1, 2}) {
    RunningMean total, first, last;
    std::uint64_t rays = 0;
    for (tracing.rng.frame = 0; tracing.rng.frame < 100; ++tracing.rng.frame) {
      tracing.roulette_start = start;
      set.trace(tracing);
      total.add(sum_of(set.bounce_flux()));
      last.add(set.bounce_flux()[9]);
      rays += set.rays();
      EXPECT_NEAR(set.bounce_flux()[0] / set.emitted_flux(), luminance(vec3(0.7f, 0.5f, 0.2f)), 1e-5);
    }
    EXPECT_TRUE(mean_within(total, expected));
    EXPECT_GT(last.mean(), 0);
    EXPECT_LT(rays, 100 * all_rays / 2);
  }
}

// --- where light arrives ---------------------------------------------------------------------------------------

// What the lights of the first bounce send on from each cell of the ground [-4,4]^2, y = 0.
class Ground {
 public:
  static constexpr int kCells = 8;

  static SceneBuilder scene() {
    SceneBuilder b;
    b.quad(vec3(-4, 0, 4), vec3(8, 0, 0), vec3(0, 0, -8), b.material(vec3(kRho)));
    return b;
  }

  // Expected irradiance of every place. Paths are samples: their fluxes give the standard error.
  void expect(const Scene& scene, int paths, const std::function<double(vec3)>& irradiance) {
    const VplWorld world(scene);
    VplSet set;
    set.trace(world.tracing(paths, 1));
    std::vector<double> sum(kCells * kCells, 0), squares(kCells * kCells, 0);
    for (const Vpl& vpl : set.view().vpls) {
      if (vpl.normal.y < 0.5f) continue;  // the back of the ground, a lamp
      EXPECT_NEAR(vpl.position.y, 0, 1e-5);
      const int x = std::clamp(static_cast<int>(vpl.position.x + 4), 0, kCells - 1);
      const int z = std::clamp(static_cast<int>(vpl.position.z + 4), 0, kCells - 1);
      const double flux = M_PI * static_cast<double>(vpl.intensity.y);
      sum[static_cast<std::size_t>(z * kCells + x)] += flux;
      squares[static_cast<std::size_t>(z * kCells + x)] += flux * flux;
    }
    double chi = 0;
    int compared = 0;
    for (int z = 0; z < kCells; ++z) {
      for (int x = 0; x < kCells; ++x) {
        const auto cell = static_cast<std::size_t>(z * kCells + x);
        const double expected = kRho * mean_over_cell(x, z, irradiance);  // a cell is one square metre
        const double error = std::sqrt(std::max(0.0, squares[cell] - sum[cell] * sum[cell] / paths));
        if (expected < 1e-12) {
          EXPECT_LT(sum[cell], 1e-6);
          continue;
        }
        if (sum[cell] * sum[cell] < 25 * squares[cell]) continue;  // too few paths for a mean to be normal
        EXPECT_TRUE(mean_within(sum[cell], error, expected, 4.5)) << x << "," << z;
        chi += (sum[cell] - expected) * (sum[cell] - expected) / (error * error);
        ++compared;
      }
    }
    EXPECT_GT(compared, 12);
    EXPECT_GT(chi_square_tail(chi, compared), 1e-4);
    EXPECT_LT(chi_square_tail(chi, compared), 1 - 1e-4);  // the standard error is no idle upper bound
  }

 private:
  static double mean_over_cell(int x, int z, const std::function<double(vec3)>& irradiance) {
    constexpr int kGrid = 16;
    double sum = 0;
    for (int k = 0; k < kGrid * kGrid; ++k) {
      const float dx = (static_cast<float>(k % kGrid) + 0.5f) / kGrid;
      const float dz = (static_cast<float>(k / kGrid) + 0.5f) / kGrid;
      sum += irradiance(vec3(static_cast<float>(x) - 4 + dx, 0, static_cast<float>(z) - 4 + dz));
    }
    return sum / (kGrid * kGrid);
  }
};

TEST(VplTracing, PointLightFollowsTheInverseSquare) {
  const vec3 at(0.5f, 2, -0.3f);
  SceneBuilder b = Ground::scene();
  b.punctual(punctual(LightType::kPoint, vec3(7)), at, vec3(0, -1, 0));
  Ground().expect(b.scene, 60000, [&](vec3 p) { return 7 * 2 / std::pow(double(glm::length(at - p)), 3); });
}

TEST(VplTracing, RangeEndsAPointLight) {
  const vec3 at(0.5f, 2, -0.3f);
  SceneBuilder b = Ground::scene();
  b.punctual(punctual(LightType::kPoint, vec3(7), 3.5f), at, vec3(0, -1, 0));
  Ground().expect(b.scene, 60000, [&](vec3 p) {
    const double d = glm::length(at - p);
    return 7 * 2 / (d * d * d) * std::clamp(1 - std::pow(d / 3.5, 4), 0.0, 1.0);
  });
}

TEST(VplTracing, SpotLightFadesBetweenItsCones) {
  const vec3 at(0.5f, 3, -0.3f), axis = glm::normalize(vec3(-0.3f, -1, 0.1f));
  SceneBuilder b = Ground::scene();
  b.punctual(punctual(LightType::kSpot, vec3(7)), at, axis);
  Ground().expect(b.scene, 60000, [&](vec3 p) {
    const double d = glm::length(p - at), cosine = glm::dot(p - at, axis) / d;
    const double ramp = std::clamp((cosine - std::cos(0.7)) / (std::cos(0.3) - std::cos(0.7)), 0.0, 1.0);
    return 7 * 3 / (d * d * d) * ramp * ramp;
  });
}

TEST(VplTracing, AreaLightFollowsLambertsFormula) {
  const std::array<vec3, 4> lamp{vec3(-1, 1.5f, -1), vec3(0.5f, 1.8f, -1), vec3(0.5f, 1.8f, 1), vec3(-1, 1.5f, 1)};
  SceneBuilder b = Ground::scene();
  b.quad(lamp[0], lamp[1] - lamp[0], lamp[3] - lamp[0], b.material(vec3(0), vec3(5)));  // front below
  Ground().expect(b.scene, 60000, [&](vec3 p) { return 5 * polygon_irradiance(p, vec3(0, 1, 0), lamp); });
}

TEST(VplTracing, LightFromInfinityIsTheSameEverywhere) {
  const vec3 along = glm::normalize(vec3(0.4f, -1, 0.3f));
  SceneBuilder sun = Ground::scene(), sky = Ground::scene();
  sun.punctual(punctual(LightType::kDirectional, vec3(2)), vec3(0), along);
  Ground().expect(sun.scene, 30000, [&](vec3) { return -2 * static_cast<double>(along.y); });
  sky.scene.environment.radiance = vec3(2);
  Ground().expect(sky.scene, 60000, [](vec3) { return 2 * M_PI; });
}

// The ground's normals lean: a sun is reflected by the cosine to them, though it arrives by the true one.
TEST(VplTracing, ShadingNormalsReflectByTheirOwnCosine) {
  const vec3 along = glm::normalize(vec3(0.4f, -1, 0.3f));
  for (const vec3 leaning : {vec3(0.3f, 1, -0.2f), vec3(-0.5f, 1, 0)}) {
    SceneBuilder b = Ground::scene();
    b.scene.meshes[0].normals.assign(b.scene.meshes[0].positions.size(), glm::normalize(leaning));
    b.punctual(punctual(LightType::kDirectional, vec3(2)), vec3(0), along);
    Ground().expect(b.scene, 30000,
                    [&](vec3) { return -2 * static_cast<double>(glm::dot(along, glm::normalize(leaning))); });
  }
}

TEST(VplTracing, CosineRatioIsBoundedAtGrazingLight) {
  Surface s = surface_at(vec3(0), vec3(0, 1, 0));
  EXPECT_EQ(adjoint_cosine_ratio(s), 1);
  s.wo = vec3(1, 0, 0);
  s.normal = glm::normalize(vec3(1, 1, 0));
  EXPECT_EQ(adjoint_cosine_ratio(s), 4);
  s.wo = glm::normalize(vec3(1, 0.05f, 0));
  EXPECT_EQ(adjoint_cosine_ratio(s), 4);
  s.wo = glm::normalize(vec3(1, 1, 0));
  EXPECT_NEAR(adjoint_cosine_ratio(s), std::sqrt(2.0f), 1e-5);
}

// A point light between the ground and a panel above it: what the lights on the panel send down, against quadrature
// over the panel.
TEST(VplTracing, ShadingByAllLightsIsOneBounce) {
  constexpr double kHeight = 1.6;
  const glm::dvec3 light(0.2, 0.7, 0.1);
  SceneBuilder b = Ground::scene();
  b.quad(vec3(-1, kHeight, -1), vec3(2, 0, 0), vec3(0, 0, 2), b.material(vec3(0.8f)));
  b.punctual(punctual(LightType::kPoint, vec3(5)), vec3(light), vec3(0, -1, 0));
  const VplWorld world(b.scene);
  VplSet set;
  constexpr int kPaths = 40000;
  set.trace(world.tracing(kPaths, 1));
  for (const glm::dvec3 x : {glm::dvec3(0), glm::dvec3(1, 0, 0.5), glm::dvec3(-2, 0, 1)}) {
    double sum = 0, squares = 0, expected = 0;
    for (const Vpl& vpl : set.view().vpls) {
      const glm::dvec3 down = x - glm::dvec3(vpl.position);
      const double d = glm::length(down), cosine = glm::dot(down, glm::dvec3(vpl.normal)) / d;
      if (vpl.normal.y > -0.5f || cosine <= 0) continue;
      const double irradiance = static_cast<double>(vpl.intensity.y) * cosine * -down.y / (d * d * d);
      sum += irradiance;
      squares += irradiance * irradiance;
    }
    constexpr int kGrid = 200;
    for (int k = 0; k < kGrid * kGrid; ++k) {
      const glm::dvec3 y((k % kGrid + 0.5) / kGrid * 2 - 1, kHeight, (k / kGrid + 0.5) / kGrid * 2 - 1);
      const double down = glm::length(x - y);
      const double radiosity = 0.8 * 5 * (kHeight - light.y) / std::pow(glm::length(light - y), 3);
      expected += radiosity / M_PI * kHeight * kHeight / std::pow(down, 4) * 4 / (kGrid * kGrid);
    }
    EXPECT_TRUE(mean_within(sum, std::sqrt(squares - sum * sum / kPaths), expected, 4));
  }
}

// --- choice of lights ----------------------------------------------------------------------------------------

// Lamps of unequal power, each in a closed cell of its own around (3i, 0, 0).
Scene cells(const std::vector<float>& intensities) {
  SceneBuilder b;
  const int wall = b.material(vec3(0.5f));
  for (std::size_t i = 0; i < intensities.size(); ++i) {
    const vec3 at(3 * static_cast<float>(i), 0, 0);
    b.room(at - 1.0f, at + 1.0f, wall);
    b.punctual(punctual(LightType::kPoint, vec3(intensities[i])), at, vec3(0, -1, 0));
  }
  return b.scene;
}

TEST(VplTracing, EveryLightStartsItsShareOfThePaths) {
  const std::vector<float> intensities{1, 0, 2.5f, 0.01f, 7, 0.4f, 0, 3};
  const VplWorld world(cells(intensities));
  double total = 0;
  for (const float i : intensities) total += i;
  constexpr int kPaths = 60;
  std::vector<RunningMean> counts(intensities.size());
  VplSet set;
  for (std::uint32_t frame = 0; frame < 1000; ++frame) {
    set.trace(world.tracing(kPaths, 1, frame));
    std::vector<int> started(intensities.size(), 0);
    for (const Vpl& vpl : set.view().vpls) ++started[static_cast<std::size_t>(std::lround(vpl.position.x / 3))];
    for (std::size_t i = 0; i < started.size(); ++i) {
      const double share = kPaths * double{intensities[i]} / total;
      EXPECT_GE(started[i], std::floor(share));
      EXPECT_LE(started[i], std::ceil(share));
      counts[i].add(started[i]);
    }
  }
  for (std::size_t i = 0; i < counts.size(); ++i) {
    EXPECT_TRUE(mean_within(counts[i], kPaths * double{intensities[i]} / total, 4, 1e-9)) << i;
  }
}

// Every light carries its own flux, however many paths it got.
TEST(VplTracing, FluxIsDividedAmongTheLights) {
  const std::vector<float> intensities{1, 2.5f, 7, 3};
  const VplWorld world(cells(intensities));
  VplSet set;
  std::vector<RunningMean> means(4);
  for (std::uint32_t frame = 0; frame < 300; ++frame) {
    set.trace(world.tracing(30, 1, frame));
    std::vector<double> flux(4, 0);
    for (const Vpl& vpl : set.view().vpls)
      flux[static_cast<std::size_t>(std::lround(vpl.position.x / 3))] += M_PI * static_cast<double>(vpl.intensity.y);
    for (std::size_t i = 0; i < 4; ++i) means[i].add(flux[i]);
    EXPECT_NEAR(set.emitted_flux() / (13.5 * 4 * M_PI), 1, 1e-5);
  }
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_TRUE(mean_within(means[i], 0.5 * 4 * M_PI * static_cast<double>(intensities[i]), 4, 1e-4)) << i;
}

TEST(VplTracing, LightsWithoutFluxAreNeverFound) {
  const std::vector<double> cumulative{0, 0, 2, 2, 2, 5, 5};
  EXPECT_EQ(find_light(cumulative, 0), 2u);
  EXPECT_EQ(find_light(cumulative, 1.999), 2u);
  EXPECT_EQ(find_light(cumulative, 2), 5u);
  EXPECT_EQ(find_light(cumulative, 5 * (1 - 0x1p-53)), 5u);
}

// --- robustness --------------------------------------------------------------------------------------------------

// All kinds of lights over an open box.
Scene everything() {
  Scene scene = triangle_cloud(40, 0.2f);
  const int wall = add_material(scene, vec3(0));
  const vec3 a(-6, -6, -6), b(6, -6, -6), c(6, -6, 6), d(-6, -6, 6), up(0, 12, 0);
  add_node(scene, {add_mesh(scene, wall, {a, c, b, a, d, c, a, b, b + up, a, b + up, a + up, b, c, c + up})});
  add_light(scene, punctual(LightType::kDirectional, vec3(3, 2, 1)), vec3(0));
  scene.nodes.back().rotation = vec4(-0.7071068f, 0, 0, 0.7071068f);  // -Z turned to -Y: shines down
  scene.environment.radiance = vec3(0.2f, 0.3f, 0.5f);
  for (int i = 0; i < 10; ++i)
    add_light(scene, punctual(i % 2 ? LightType::kSpot : LightType::kPoint, vec3(30), i % 3 ? 0.0f : 9.0f),
              vec3(static_cast<float>(i) - 5, 1, 2));
  return scene;
}

TEST(VplTracing, SameBitsForAnyThreadCount) {
  const VplWorld world(everything());
  std::vector<Vpl> first;
  double flux = 0;
  VplSet set;
  for (const std::size_t threads : {1u, 2u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    set.trace(world.tracing(20000, 3));
    const VplView view = set.view();
    EXPECT_GT(view.vpls.size(), 500u);
    if (first.empty()) {
      first.assign(view.vpls.begin(), view.vpls.end());
      flux = set.emitted_flux();
    }
    ASSERT_EQ(view.vpls.size(), first.size());
    EXPECT_EQ(std::memcmp(view.vpls.data(), first.data(), first.size() * sizeof(Vpl)), 0);
    EXPECT_EQ(set.emitted_flux(), flux);
  }
}

TEST(VplTracing, FramesAndSeedsDiffer) {
  const VplWorld world(everything());
  VplSet a, b;
  a.trace(world.tracing(1000, 2, 0));
  b.trace(world.tracing(1000, 2, 1));
  ASSERT_FALSE(a.view().vpls.empty());
  EXPECT_NE(a.view().vpls[0].position, b.view().vpls[0].position);
}

void expect_no_lights(VplSet& set) {
  EXPECT_TRUE(set.view().vpls.empty());
  EXPECT_TRUE(set.view().bounds.empty());
  EXPECT_EQ(set.bytes(), 0u);
  EXPECT_EQ(sum_of(set.bounce_flux()), 0);
}

TEST(VplTracing, NothingComesOfNothing) {
  VplSet set;
  const VplWorld lit(lit_rooms()[0]);
  set.trace(lit.tracing(100, 2));  // buffers are not empty from now on
  EXPECT_FALSE(set.view().vpls.empty());

  set.trace(lit.tracing(0, 2));
  expect_no_lights(set);
  set.trace(lit.tracing(100, 0));
  expect_no_lights(set);
  EXPECT_TRUE(set.bounce_flux().empty());

  set.trace(VplWorld(grey_room().scene).tracing(100, 2));  // no lights
  expect_no_lights(set);
  EXPECT_EQ(set.emitted_flux(), 0);

  SceneBuilder dark = grey_room();
  dark.punctual(punctual(LightType::kPoint, vec3(0)), vec3(0), vec3(0, -1, 0));
  PunctualLight thin = punctual(LightType::kSpot, vec3(1));
  thin.inner_cone = thin.outer_cone = 0;
  dark.punctual(thin, vec3(0), vec3(0, -1, 0));
  dark.triangle(vec3(0), vec3(0), vec3(0), dark.material(vec3(1), vec3(1)));
  set.trace(VplWorld(dark.scene).tracing(100, 2));
  expect_no_lights(set);

  SceneBuilder black = grey_room(0);
  black.punctual(punctual(LightType::kPoint, vec3(1)), vec3(0), vec3(0, -1, 0));
  set.trace(VplWorld(black.scene).tracing(100, 2));
  expect_no_lights(set);
  EXPECT_NEAR(set.emitted_flux(), 4 * M_PI, 1e-4);
}

TEST(VplTracing, ScenesWithoutGeometryHaveNoLights) {
  SceneBuilder b;
  b.punctual(punctual(LightType::kPoint, vec3(1)), vec3(0), vec3(0, -1, 0));
  b.punctual(punctual(LightType::kDirectional, vec3(1)), vec3(0), vec3(0, -1, 0));
  b.scene.environment.radiance = vec3(1);
  VplSet set;
  set.trace(VplWorld(b.scene).tracing(100, 2));
  expect_no_lights(set);
  EXPECT_TRUE(std::isfinite(set.emitted_flux()));
}

// Boxes without height, width, or both.
TEST(VplTracing, FlatScenesAreLitFromInfinity) {
  for (const vec3 size : {vec3(1, 0, 1), vec3(0, 1, 1), vec3(1e-6f, 1e-6f, 1)}) {
    for (const vec3 along : {vec3(0, -1, 0), vec3(1, 0, 0), vec3(1, -1, 1)}) {
      SceneBuilder b;
      b.triangle(vec3(0), vec3(size.x, 0, 0), size, b.material(vec3(0.5f)));
      b.punctual(punctual(LightType::kDirectional, vec3(1)), vec3(0), along);
      b.scene.environment.radiance = vec3(1);
      VplSet set;
      set.trace(VplWorld(b.scene).tracing(1000, 2));
      EXPECT_TRUE(std::isfinite(set.emitted_flux()));
      for (const Vpl& vpl : set.view().vpls) EXPECT_TRUE(is_finite(vpl.position) && is_finite(vpl.intensity));
    }
  }
}

TEST(VplTracing, BrokenLightsAreLeftOut) {
  SceneBuilder b = grey_room();
  for (int i = 0; i < 4; ++i) b.punctual(punctual(LightType::kPoint, vec3(2)), vec3(0), vec3(0, -1, 0));
  b.punctual(punctual(LightType::kDirectional, vec3(1)), vec3(0), vec3(0, -1, 0));
  const VplWorld world(b.scene);
  VplTracing tracing = world.tracing(400, 2);
  std::vector<PunctualView> lights(tracing.lights.punctual.begin(), tracing.lights.punctual.end());
  lights[0].intensity = vec3(NAN);
  lights[1].intensity = vec3(kInfinity);
  lights[2].intensity = vec3(-1);
  std::vector<DirectionalView> suns(tracing.lights.directional.begin(), tracing.lights.directional.end());
  suns[0].irradiance = vec3(1, NAN, 1);
  tracing.lights.punctual = lights;
  tracing.lights.directional = suns;
  VplSet set;
  set.trace(tracing);
  EXPECT_EQ(set.view().vpls.size(), 800u);
  EXPECT_NEAR(set.emitted_flux(), 2 * 4 * M_PI, 1e-3);
}

}  // namespace
}  // namespace lumigrove
