#include "methods/vpl_sampling/indirect_lighting.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <memory>

#include "device/device.h"
#include "frame/frame.h"
#include "light_fixtures.h"
#include "light_scenes.h"
#include "lumigrove/renderer.h"
#include "methods/reference/path.h"
#include "methods/vpl_sampling/gather.h"
#include "scene/surface_kernel.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

PunctualLight point_light(vec3 color) {
  PunctualLight light;
  light.type = LightType::kPoint;
  light.color = color;
  return light;
}

// A closed room with a diffuse and a glossy half, a box in it, and a lamp.
Scene glossy_room() {
  SceneBuilder b;
  b.room(vec3(-2, 0, -2), vec3(2, 3, 2), b.material(vec3(0.7f, 0.6f, 0.5f)));
  b.quad(vec3(-2, 0.01f, -2), vec3(0, 0, 4), vec3(2, 0, 0), b.material(vec3(0.5f), vec3(0), 0.6f, 0.4f));
  const int box = b.material(vec3(0.3f, 0.6f, 0.4f), vec3(0), 0, 0.6f);
  b.room(vec3(1, 1, 0.5f), vec3(0.2f, 0.02f, -0.4f), box);  // fronts outside
  b.punctual(point_light(vec3(4)), vec3(-0.6f, 2.3f, 0.4f), vec3(0, -1, 0));
  return b.scene;
}

// A world with virtual point lights, and surfaces that rays from `eye` find.
class VplRoom {
 public:
  explicit VplRoom(Scene scene, int vpls = 300, int bounces = 3)
      : scene_(std::move(scene)), settings_(make_preset("sst")) {
    settings_.indirect.vpls = vpls;
    settings_.indirect.bounces = bounces;
    settings_.indirect.roulette_start = 100;
    world_ = make_world(scene_, settings_, stats_);
    trace(0);
  }
  VplRoom(const VplRoom&) = delete;
  VplRoom& operator=(const VplRoom&) = delete;

  // Lights of another sample, and both ways of choosing among them.
  void trace(int sample) {
    for (const Selection selection : {Selection::kPower, Selection::kRoot}) {
      Settings one = settings_;
      one.indirect.selection = selection;
      trace_vpls(*world_, one, sample, stats_);
    }
  }
  void build(Topology topology) {
    settings_.indirect.topology = topology;
    trace(0);
  }

  IndirectLighting lighting(Selection selection, int sample = 0) const {
    Settings settings = settings_;
    settings.indirect.selection = selection;
    settings.indirect.stop = Stop::kLeaf;
    return make_indirect_lighting(*world_, settings, sample);
  }
  DirectLighting direct(int sample = 0) const { return make_direct_lighting(*world_, settings_, sample); }
  const World& world() const { return *world_; }

  std::vector<Surface> surfaces(int n, vec3 eye, std::uint32_t seed = 5) const {
    std::vector<Ray> rays(static_cast<std::size_t>(n));
    Stream random(seed);
    for (Ray& ray : rays) {
      ray.origin = eye;
      ray.direction = random.direction();
      ray.tmax = kInfinity;
    }
    return surfaces_of(rays);
  }
  std::vector<Surface> surfaces_of(const std::vector<Ray>& rays) const {
    std::vector<Hit> hits(rays.size());
    std::vector<Surface> found(rays.size());
    world_->geometry->tracer.closest(rays, hits, Coherence::kIncoherent);
    launch(static_cast<int>(rays.size()), SurfaceKernel{world_->geometry->arrays.view(), rays, hits, found, false});
    return found;
  }

 private:
  Scene scene_;
  Settings settings_;
  RenderStats stats_;
  std::unique_ptr<World> world_;
};

constexpr vec3 kEye(0.3f, 1.7f, 1.2f);

std::vector<std::uint32_t> numbered(std::size_t n, std::uint32_t first = 0) {
  std::vector<std::uint32_t> pixels(n);
  for (std::size_t i = 0; i < n; ++i) pixels[i] = first + static_cast<std::uint32_t>(i);
  return pixels;
}

std::vector<vec3> light_of(const IndirectLighting& lighting, std::span<const Surface> surfaces,
                           std::uint32_t first_pixel = 0) {
  IndirectBuffers buffers;
  std::vector<vec3> sum(surfaces.size(), vec3(0));
  add_indirect_light(lighting, surfaces, numbered(surfaces.size(), first_pixel), kDimIndirect, buffers, sum);
  return sum;
}

std::vector<vec3> sum_of_all(const VplRoom& room, const std::vector<Surface>& surfaces, bool gloss = true) {
  IndirectLighting all = room.lighting(Selection::kAll);
  all.sampler.gloss = gloss;
  return light_of(all, surfaces);
}

// Mean luminance of many samples at every surface: each is repeated with random numbers of its own.
std::vector<RunningMean> means_of(const IndirectLighting& lighting, const std::vector<Surface>& surfaces, int samples) {
  std::vector<Surface> repeated;
  for (int k = 0; k < samples; ++k) repeated.insert(repeated.end(), surfaces.begin(), surfaces.end());
  const std::vector<vec3> light = light_of(lighting, repeated);
  std::vector<RunningMean> means(surfaces.size());
  for (std::size_t i = 0; i < light.size(); ++i)
    means[i % surfaces.size()].add(static_cast<double>(luminance(light[i])));
  return means;
}

// 4.9 standard errors: one false alarm in a thousand among a thousand tests.
constexpr double kSigmas = 4.9;

void expect_means(const std::vector<RunningMean>& means, const std::vector<vec3>& truth) {
  for (std::size_t i = 0; i < means.size(); ++i) {
    const double expected = static_cast<double>(luminance(truth[i]));
    EXPECT_TRUE(mean_within(means[i], expected, kSigmas, 1e-4 * expected)) << "surface " << i;
  }
}

int count_gloss(const IndirectLighting& lighting, const std::vector<Surface>& surfaces) {
  int count = 0;
  for (const Surface& s : surfaces) count += lights_gloss(lighting.sampler, s);
  return count;
}

constexpr int kSurfaces = 20, kSamples = 4000;

TEST(IndirectLighting, MeanOfUniformAndPowerIsTheSumOfAll) {
  const VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(kSurfaces, kEye);
  EXPECT_GT(count_gloss(room.lighting(Selection::kAll), surfaces), 3);
  for (const bool gloss : {false, true}) {
    const std::vector<vec3> truth = sum_of_all(room, surfaces, gloss);
    for (const Selection selection : {Selection::kUniform, Selection::kPower}) {
      IndirectLighting lighting = room.lighting(selection);
      lighting.sampler.gloss = gloss;
      SCOPED_TRACE(selection == Selection::kPower ? "power" : "uniform");
      expect_means(means_of(lighting, surfaces, kSamples), truth);
    }
  }
}

TEST(IndirectLighting, MeanOfWalksToLeavesIsTheSumOfAll) {
  VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(kSurfaces, kEye);
  for (const bool gloss : {false, true}) {
    const std::vector<vec3> truth = sum_of_all(room, surfaces, gloss);
    for (const Topology topology : {Topology::kRadix, Topology::kPerfect}) {
      room.build(topology);
      for (const Weights weight : {Weights::kDistanceBounded, Weights::kInBox, Weights::kYuksel}) {
        IndirectLighting lighting = room.lighting(Selection::kRoot);
        lighting.sampler.gloss = gloss;
        lighting.sampler.walk.weight = weight;
        lighting.sampler.walk.cones = weight != Weights::kInBox;
        SCOPED_TRACE((topology == Topology::kRadix ? "radix, weight " : "perfect, weight ") +
                     std::to_string(static_cast<int>(weight)) + (gloss ? ", gloss" : ""));
        expect_means(means_of(lighting, surfaces, kSamples), truth);
      }
    }
  }
}

TEST(IndirectLighting, SeveralSamplesHaveTheSameMeanAndLessNoise) {
  const VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(kSurfaces, kEye);
  IndirectLighting lighting = room.lighting(Selection::kRoot);
  const std::vector<RunningMean> one = means_of(lighting, surfaces, 2000);
  lighting.spp = 4;
  const std::vector<RunningMean> four = means_of(lighting, surfaces, 2000);
  expect_means(four, sum_of_all(room, surfaces));
  double ratio = 0;
  for (std::size_t i = 0; i < four.size(); ++i) ratio += one[i].variance() / four[i].variance() / kSurfaces;
  EXPECT_NEAR(ratio, 4, 0.6);
}

TEST(IndirectLighting, WalksAreLessNoisyThanPowerAndPowerThanUniform) {
  const VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(60, kEye, 6);
  const auto noise = [&](Selection selection) {
    double sum = 0;
    for (const RunningMean& mean : means_of(room.lighting(selection), surfaces, 400))
      sum += mean.mean() > 0 ? mean.variance() / (mean.mean() * mean.mean()) : 0;
    return sum;
  };
  EXPECT_LT(1.5 * noise(Selection::kRoot), noise(Selection::kUniform));
  EXPECT_LT(noise(Selection::kRoot), noise(Selection::kPower));
}

// --- substitutes -------------------------------------------------------------------------------------------------

TEST(IndirectLighting, SubstitutesAreNearTheSumOfAllButBiased) {
  const VplRoom room(glossy_room(), 60);
  const std::vector<Surface> surfaces = room.surfaces(kSurfaces, kEye);
  const std::vector<vec3> truth = sum_of_all(room, surfaces);
  IndirectLighting lighting = room.lighting(Selection::kRoot);
  lighting.sampler.walk.substitutes = true;
  const std::vector<RunningMean> means = means_of(lighting, surfaces, 20000);
  double found = 0, expected = 0, chi = 0;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const double exact = static_cast<double>(luminance(truth[i]));
    found += means[i].mean();
    expected += exact;
    chi += std::pow((means[i].mean() - exact) / means[i].standard_error(), 2);
  }
  EXPECT_NEAR(found / expected, 1, 0.1);
  EXPECT_LT(chi_square_tail(chi, kSurfaces), 1e-6) << chi;
}

TEST(IndirectLighting, CorrectedSubstitutesHaveNoBias) {
  VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(kSurfaces, kEye);
  for (const bool gloss : {false, true}) {
    const std::vector<vec3> truth = sum_of_all(room, surfaces, gloss);
    for (const Topology topology : {Topology::kRadix, Topology::kPerfect}) {
      room.build(topology);
      for (const float q : {0.25f, 1.0f}) {
        IndirectLighting lighting = room.lighting(Selection::kRoot);
        lighting.sampler.gloss = gloss;
        lighting.sampler.walk.substitutes = true;
        lighting.sampler.correction = q;
        SCOPED_TRACE(q);
        expect_means(means_of(lighting, surfaces, kSamples), truth);
      }
    }
  }
}

TEST(IndirectLighting, TracesSayWhatTheWalksDid) {
  const VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(2000, kEye);
  for (const bool substitutes : {false, true}) {
    IndirectLighting lighting = room.lighting(Selection::kRoot);
    lighting.sampler.walk.substitutes = substitutes;
    lighting.sampler.correction = substitutes ? 0.5f : 0;
    IndirectBuffers buffers;
    buffers.wants_traces = true;
    std::vector<vec3> sum(surfaces.size(), vec3(0));
    add_indirect_light(lighting, surfaces, numbered(surfaces.size()), kDimIndirect, buffers, sum);
    ASSERT_EQ(buffers.traces.size(), surfaces.size());
    int substituted = 0, boxed = 0;
    for (const VplTrace& trace : buffers.traces) {
      EXPECT_GE(trace.steps, 1);
      EXPECT_LE(trace.steps, 40);
      EXPECT_EQ(trace.size > 0, trace.substitute);
      EXPECT_LE(trace.size, lighting.sampler.lights.diagonal);
      substituted += trace.substitute;
      boxed += trace.boxed;
      if (!trace.substitute) {
        EXPECT_FALSE(trace.boxed);
      }
    }
    EXPECT_EQ(substituted > 0, substitutes);
    EXPECT_EQ(boxed > 0, substitutes);
  }
}

// Surfaces are lit many at once; each must get what it would get alone, by scalar code.
TEST(IndirectLightKernel, BatchesMatchSingleSamples) {
  const VplRoom room(glossy_room());
  std::vector<Surface> surfaces = room.surfaces(700, kEye);
  for (std::size_t i = 0; i < surfaces.size(); i += 11) surfaces[i].instance = kNoId;
  const std::vector<std::uint32_t> pixels = numbered(surfaces.size());
  const std::size_t n = surfaces.size();
  for (const bool substitutes : {false, true}) {
    IndirectLighting lighting = room.lighting(Selection::kRoot);
    VplSampler& sampler = lighting.sampler;
    sampler.walk.substitutes = substitutes;
    std::vector<Ray> shadow(n);
    std::vector<vec3> contribution(n);
    const IndirectLightKernel kernel{sampler, lighting.rng, kDimIndirect, 1, CorrectionPart::kSubstitute,
                                     surfaces, pixels, shadow, contribution, {}, {}};
    for (int batch = 0; batch < indirect_batches(static_cast<int>(n)); ++batch) kernel(batch);
    int lit = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Surface& s = surfaces[i];
      const Rng rng{lighting.rng.seed, lighting.rng.frame, pixels[i]};
      const vec4 u = rng.uniform4(kDimIndirect);
      const float p = diffuse_walk_probability(sampler, s);
      const bool diffuse = u.x < p;
      SubstituteWalkPoints points;
      points.set(0, s, vec3(u.y, u.z, u.w), !diffuse);
      WalkResult walk;
      diffuse ? walk_substitute_tree<false>(sampler.walk, points, 1, &walk)
              : walk_substitute_tree<true>(sampler.walk, points, 1, &walk);
      vec3 expected(0);
      Ray ray;
      if (walk.end != WalkEnd::kDead && s.instance != kNoId) {
        VplPoint light = vpl_of_walk(sampler, walk, rng.uniform4(kDimIndirect + 4));
        light.intensity /= diffuse ? p : 1 - p;
        expected = vpl_light(s, light, sampler.clamp, diffuse ? Lobes::kDiffuse : Lobes::kGloss);
        ray = vpl_shadow_ray(s, light);
      }
      ASSERT_EQ(max_component(expected) > 0, shadow[i].tmax >= shadow[i].tmin) << i;
      ASSERT_LE(glm::length(contribution[i] - expected), 1e-3f * glm::length(expected)) << i;
      if (!(max_component(expected) > 0)) continue;
      ++lit;
      ASSERT_LE(glm::length(shadow[i].origin - ray.origin), 1e-4f) << i;
      ASSERT_LE(glm::length(shadow[i].direction - ray.direction), 1e-4f) << i;
      ASSERT_NEAR(shadow[i].tmin, ray.tmin, 1e-4f) << i;
      ASSERT_EQ(shadow[i].tmax, 1.0f) << i;
    }
    EXPECT_GT(lit, 200);
  }
}

// --- the clamp ---------------------------------------------------------------------------------------------------

TEST(IndirectLighting, NoContributionExceedsTheClamp) {
  const VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(400, kEye);
  const VplView lights = room.lighting(Selection::kAll).sampler.lights;
  const float d2 = lights.diagonal * lights.diagonal;
  int clamped = 0;
  for (const float clamp : {2 / d2, 215 / d2}) {
    for (const Surface& s : surfaces) {
      for (std::size_t k = 0; k < lights.vpls.size(); k += 5) {
        const VplPoint light = exact_vpl(lights.vpls[k], 1);
        const vec3 wi = glm::normalize(light.position - s.position);
        const vec3 most = light.intensity * bsdf_eval(s, wi) * (clamp * std::max(0.0f, glm::dot(wi, s.normal)));
        const vec3 with = vpl_light(s, light, clamp, Lobes::kBoth);
        const vec3 without = vpl_light(s, light, kInfinity, Lobes::kBoth);
        ASSERT_TRUE(glm::all(glm::lessThanEqual(with, most * 1.00001f)));
        ASSERT_TRUE(glm::all(glm::lessThanEqual(with, without)));
        clamped += max_component(with) < 0.999f * max_component(without);
      }
    }
  }
  EXPECT_GT(clamped, 1000);
}

TEST(IndirectLighting, InfiniteClampIsNone) {
  const VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(500, kEye);
  IndirectLighting infinite = room.lighting(Selection::kRoot), large = infinite, tight = infinite;
  infinite.sampler.clamp = kInfinity;
  large.sampler.clamp = 1e30f;
  tight.sampler.clamp *= 0.01f;
  const std::vector<vec3> a = light_of(infinite, surfaces), b = light_of(large, surfaces);
  const std::vector<vec3> c = light_of(tight, surfaces);
  EXPECT_EQ(a, b);
  int less = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_LE(c[i].y, a[i].y);
    less += c[i].y < a[i].y;
  }
  EXPECT_GT(less, 50);
}

TEST(IndirectLighting, LobesAddUpToTheBsdf) {
  const VplRoom room(glossy_room());
  const VplView lights = room.lighting(Selection::kAll).sampler.lights;
  for (const Surface& s : room.surfaces(50, kEye)) {
    for (std::size_t k = 0; k < lights.vpls.size(); k += 9) {
      const VplPoint light = exact_vpl(lights.vpls[k], 2);
      const vec3 both = vpl_light(s, light, 10, Lobes::kBoth);
      const vec3 parts = vpl_light(s, light, 10, Lobes::kDiffuse) + vpl_light(s, light, 10, Lobes::kGloss);
      EXPECT_LE(glm::length(both - parts), 1e-5f * glm::length(both));
    }
  }
}

// --- edges -------------------------------------------------------------------------------------------------------

TEST(IndirectLighting, NoLightsAddNothing) {
  Scene dark = glossy_room();
  dark.lights[0].color = vec3(0);
  const VplRoom room(dark);
  const std::vector<Surface> surfaces = room.surfaces(100, kEye);
  for (const Selection selection : {Selection::kUniform, Selection::kPower, Selection::kRoot, Selection::kAll}) {
    const IndirectLighting lighting = room.lighting(selection);
    ASSERT_EQ(lighting.sampler.lights.vpls.size(), 0u);
    for (const vec3 light : light_of(lighting, surfaces)) EXPECT_EQ(light, vec3(0));
  }
}

TEST(IndirectLighting, OneLightIsTheSumOfAllByAnyChoice) {
  const VplRoom room(glossy_room(), 1, 1);
  const std::vector<Surface> surfaces = room.surfaces(200, kEye);
  ASSERT_EQ(room.lighting(Selection::kAll).sampler.lights.vpls.size(), 1u);
  const std::vector<vec3> truth = sum_of_all(room, surfaces, false);
  int lit = 0;
  for (const Selection selection : {Selection::kUniform, Selection::kPower, Selection::kRoot}) {
    for (const bool substitutes : {false, true}) {
      IndirectLighting lighting = room.lighting(selection);
      lighting.sampler.gloss = false;
      lighting.sampler.walk.substitutes = substitutes;
      const std::vector<vec3> found = light_of(lighting, surfaces);
      for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_LE(glm::length(found[i] - truth[i]), 1e-5f * glm::length(truth[i]));
        lit += max_component(found[i]) > 0;
      }
    }
  }
  EXPECT_GT(lit, 100);
}

TEST(IndirectLighting, NothingHitGetsNothing) {
  const VplRoom room(glossy_room());
  std::vector<Surface> surfaces = room.surfaces(300, kEye);
  const std::vector<Surface> hit = surfaces;
  for (std::size_t i = 0; i < surfaces.size(); i += 3) surfaces[i].instance = kNoId;
  for (const Selection selection : {Selection::kUniform, Selection::kRoot, Selection::kAll}) {
    IndirectLighting lighting = room.lighting(selection);
    lighting.sampler.walk.substitutes = selection == Selection::kRoot;
    lighting.sampler.correction = selection == Selection::kRoot ? 0.5f : 0;
    const std::vector<vec3> found = light_of(lighting, surfaces), whole = light_of(lighting, hit);
    for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], i % 3 == 0 ? vec3(0) : whole[i]) << i;
  }
}

TEST(IndirectLighting, BatchesMayBeSplitAnywhere) {
  const VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(700, kEye);
  const std::span<const Surface> all(surfaces);
  for (const bool substitutes : {false, true}) {
    IndirectLighting lighting = room.lighting(Selection::kRoot);
    lighting.sampler.walk.substitutes = substitutes;
    lighting.sampler.correction = substitutes ? 0.3f : 0;
    lighting.spp = 2;
    const std::vector<vec3> whole = light_of(lighting, all);
    for (const std::size_t cut : {1u, 64u, 333u}) {
      std::vector<vec3> parts = light_of(lighting, all.first(cut));
      const std::vector<vec3> rest = light_of(lighting, all.subspan(cut), static_cast<std::uint32_t>(cut));
      parts.insert(parts.end(), rest.begin(), rest.end());
      EXPECT_EQ(parts, whole) << cut;
    }
  }
}

TEST(IndirectLighting, SameBitsForAnyNumberOfThreads) {
  const VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(20000, kEye);
  IndirectLighting lighting = room.lighting(Selection::kRoot);
  lighting.sampler.walk.substitutes = true;
  lighting.sampler.correction = 0.25f;
  std::vector<std::vector<vec3>> light;
  for (const std::size_t threads : {1u, 2u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    light.push_back(light_of(lighting, surfaces));
  }
  EXPECT_EQ(light[0], light[1]);
  EXPECT_EQ(light[0], light[2]);
}

// --- one more ray ------------------------------------------------------------------------------------------------

Scene grey_box() {
  SceneBuilder b;
  b.room(vec3(-1, -1, -1), vec3(1, 1, 1), b.material(vec3(0.5f)));
  b.punctual(point_light(vec3(3)), vec3(0.1f, 0.2f, -0.1f), vec3(0, -1, 0));
  return b.scene;
}

void make_diffuse(std::vector<Surface>& surfaces) {
  for (Surface& s : surfaces) s.specular = vec3(0);
}

// Indirect light of so many bounces by path tracing.
RunningMean light_by_paths(const VplRoom& room, const std::vector<Surface>& surfaces, int bounces, int samples) {
  std::vector<Surface> repeated;
  for (int k = 0; k < samples; ++k) repeated.insert(repeated.end(), surfaces.begin(), surfaces.end());
  PathTracing tracing;
  tracing.lighting = room.direct();
  tracing.first_spp = 1;
  tracing.max_bounces = bounces;
  tracing.roulette_start = 100;
  tracing.force_diffuse = true;
  PathBuffers buffers;
  std::vector<vec3> direct(repeated.size(), vec3(0)), indirect(repeated.size(), vec3(0));
  add_path_light(tracing, repeated, numbered(repeated.size()), buffers, direct, indirect);
  RunningMean mean;
  for (const vec3 light : indirect) mean.add(static_cast<double>(luminance(light)));
  return mean;
}

// Mean over many sets of lights of what the clamp leaves, and of that and the compensation.
struct Compensated {
  RunningMean clamped, with_direct, whole;
};
Compensated compensate(VplRoom& room, const std::vector<Surface>& surfaces, float clamp, int sets) {
  Compensated result;
  for (int k = 0; k < sets; ++k) {
    room.trace(k);
    IndirectLighting lighting = room.lighting(Selection::kRoot, k);
    lighting.sampler.clamp = clamp;
    IndirectBuffers buffers;
    std::vector<vec3> sum(surfaces.size(), vec3(0));
    const std::vector<std::uint32_t> pixels = numbered(surfaces.size());
    add_indirect_light(lighting, surfaces, pixels, kDimIndirect, buffers, sum);
    std::vector<vec3> direct_only = sum, whole = sum;
    Gather gather{room.direct(k), lighting, true, true};
    GatherBuffers gather_buffers;
    add_gathered_light(gather, surfaces, pixels, gather_buffers, whole);
    gather.indirect.sampler.lights.vpls = {};
    add_gathered_light(gather, surfaces, pixels, gather_buffers, direct_only);
    const auto mean = [&](const std::vector<vec3>& light) {
      double total = 0;
      for (const vec3 l : light) total += static_cast<double>(luminance(l)) / static_cast<double>(light.size());
      return total;
    };
    result.clamped.add(mean(sum));
    result.with_direct.add(mean(direct_only));
    result.whole.add(mean(whole));
  }
  return result;
}

TEST(Gather, CompensationGivesBackWhatTheClampTakes) {
  VplRoom room(grey_box(), 400, 1);
  std::vector<Surface> surfaces = room.surfaces(500, vec3(0.1f, 0, 0.2f));
  make_diffuse(surfaces);
  const RunningMean one = light_by_paths(room, surfaces, 1, 60), two = light_by_paths(room, surfaces, 2, 60);
  const Compensated found = compensate(room, surfaces, 0.3f, 150);
  EXPECT_LT(found.clamped.mean(), 0.85 * one.mean());  // a tight clamp: there is something to give back
  // With the emitters alone at the arrivals, nothing is missing and nothing too much.
  const double error = std::hypot(found.with_direct.standard_error(), one.standard_error());
  EXPECT_TRUE(mean_within(found.with_direct.mean(), error, one.mean()));
  EXPECT_LT(found.with_direct.standard_error(), 0.02 * one.mean());
  // With the lights too, part of a second bounce is added.
  EXPECT_GT(found.whole.mean(), found.with_direct.mean());
  EXPECT_LT(found.whole.mean(), two.mean());
}

TEST(Gather, WithoutClampOrMirrorsNoRayIsTraced) {
  const VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(200, kEye);
  IndirectLighting lighting = room.lighting(Selection::kRoot);
  lighting.sampler.clamp = kInfinity;
  lighting.sampler.mirror_roughness = 0;
  GatherBuffers buffers;
  std::vector<vec3> sum(surfaces.size(), vec3(0));
  add_gathered_light({room.direct(), lighting, true, false}, surfaces, numbered(200), buffers, sum);
  EXPECT_EQ(buffers.rays_traced, 0u);
  for (const vec3 light : sum) EXPECT_EQ(light, vec3(0));
}

// A small patch of a wall, lit by a spot that shines on nothing else, before a mirror.
TEST(Gather, MirrorRaysHaveTheMeanOfTheGlossOfAllLights) {
  SceneBuilder b;
  b.quad(vec3(-3, 0, -1), vec3(0, 0, 5), vec3(6, 0, 0), b.material(vec3(0.9f), vec3(0), 1, 0.08f));  // floor
  b.quad(vec3(-0.25f, 0.75f, -1), vec3(0.5f, 0, 0), vec3(0, 0.5f, 0), b.material(vec3(0.8f)));         // patch, +z
  PunctualLight spot = point_light(vec3(20));
  spot.type = LightType::kSpot;
  spot.inner_cone = 0.02f;
  spot.outer_cone = 0.05f;
  b.punctual(spot, vec3(0, 1, 3), vec3(0, 0, -1));
  VplRoom room(b.scene, 6000, 1);
  ASSERT_GT(room.lighting(Selection::kAll).sampler.lights.vpls.size(), 5000u);

  // The eye sees the middle of the patch by way of the floor.
  const vec3 eye(0, 1.5f, 2.5f), image(0, -1, -1);
  std::vector<Ray> rays(12);
  Stream random(9);
  for (Ray& ray : rays) {
    ray.origin = eye;
    ray.direction = glm::normalize(image + random.in_box(vec3(-0.1f), vec3(0.1f)) - eye);
    ray.tmax = kInfinity;
  }
  const std::vector<Surface> surfaces = room.surfaces_of(rays);
  for (const Surface& s : surfaces) ASSERT_LT(s.roughness, 0.09f);

  RunningMean all;  // over sets of lights
  for (int set = 0; set < 8; ++set) {
    room.trace(set);
    IndirectLighting every = room.lighting(Selection::kAll);
    every.sampler.clamp = kInfinity;
    double sum = 0;
    for (const vec3 light : light_of(every, surfaces)) sum += static_cast<double>(luminance(light));
    all.add(sum);
  }
  IndirectLighting none = room.lighting(Selection::kRoot);
  none.sampler.lights.vpls = {};
  none.sampler.mirror_roughness = 0.1f;
  RunningMean mirror;
  for (int k = 0; k < 1500; ++k) {
    DirectLighting direct = room.direct(k);
    none.rng = direct.rng;
    GatherBuffers buffers;
    std::vector<vec3> sum(surfaces.size(), vec3(0));
    add_gathered_light({direct, none, false, false}, surfaces, numbered(surfaces.size()), buffers, sum);
    double total = 0;
    for (const vec3 light : sum) total += static_cast<double>(luminance(light));
    mirror.add(total);
  }
  const double error = std::hypot(all.standard_error(), mirror.standard_error());
  EXPECT_TRUE(mean_within(mirror.mean(), error, all.mean()));
  EXPECT_LT(error, 0.03 * all.mean());
  EXPECT_GT(all.mean(), 0);
}

TEST(Gather, MirrorsGetNoGlossFromWalks) {
  const VplRoom room(glossy_room());
  const std::vector<Surface> surfaces = room.surfaces(500, kEye);
  IndirectLighting lighting = room.lighting(Selection::kRoot), diffuse = lighting;
  lighting.sampler.mirror_roughness = 1;
  diffuse.sampler.gloss = false;
  EXPECT_EQ(light_of(lighting, surfaces), light_of(diffuse, surfaces));
}

}  // namespace
}  // namespace lumigrove
