#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "light_fixtures.h"
#include "light_scenes.h"
#include "lumigrove/renderer.h"
#include "methods/light_sampling/pool_lighting_kernel.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

// --- walks for a region --------------------------------------------------------------------------------------

// From the root.
std::vector<TreeSample> walk(const LightTreeView& tree, const WalkRegion& region, std::size_t count,
                             std::uint32_t seed) {
  Stream random(seed);
  std::vector<float> r(count), fresh(count);
  for (std::size_t i = 0; i < count; ++i) {
    const vec4 u = random.next();
    r[i] = std::min((static_cast<float>(i) + u.x) / static_cast<float>(count), 0x1.fffffep-1f);
    fresh[i] = u.y;
  }
  std::vector<WalkRange> ranges(count), next(count);
  std::vector<TreeSample> samples(count);
  const SortedStart start{whole_tree(tree), 0, static_cast<std::uint32_t>(count)};
  sample_light_tree_sorted(tree, region, {&start, 1}, {r, fresh, ranges, next}, samples);
  return samples;
}

float pdf_in_region(const LightTreeView& tree, const WalkRegion& region, std::uint32_t leaf) {
  return pdf_leaf_in_region(tree, region, whole_tree(tree), leaf);
}

std::vector<WalkRegion> some_regions(int n, std::uint32_t seed) {
  std::vector<WalkRegion> regions;
  Stream random(seed);
  for (int i = 0; i < n; ++i) {
    const float size = i % 3 == 0 ? 0.0f : 0.2f * static_cast<float>(i % 7);
    regions.push_back({random.in_box(vec3(-6), vec3(6)), vec3(random.next()) * size, random.direction(),
                       i % 4 == 0 ? 0.0f : 0.3f * static_cast<float>(i % 5)});
  }
  return regions;
}

TEST(RegionWalk, FrequenciesFollowThePdf) {
  for (const int width : {2, 4, 16}) {
    const LightWorld world(triangle_cloud(200, 0.2f, 21), {width, true, true});
    const LightTreeView tree = world.tree().view();
    for (const WalkRegion& region : some_regions(4, 22)) {
      std::vector<double> observed(tree.count + 1, 0), expected(tree.count + 1, 0);
      constexpr int kSeeds = 400, kWalks = 64;
      for (std::uint32_t seed = 0; seed < kSeeds; ++seed)
        for (const TreeSample& s : walk(tree, region, kWalks, seed * 997)) {
          const std::uint32_t leaf = s.pdf > 0 ? tree.emitter_leaves[s.emitter] : tree.count;
          ++observed[leaf];
          if (s.pdf > 0) {
            const float pdf = pdf_in_region(tree, region, leaf);
            ASSERT_NEAR(s.pdf, pdf, 1e-5f * pdf);
          }
        }
      double all = 0;
      for (std::uint32_t leaf = 0; leaf < tree.count; ++leaf)
        all += expected[leaf] = static_cast<double>(pdf_in_region(tree, region, leaf)) * kSeeds * kWalks;
      expected[tree.count] = kSeeds * kWalks - all;
      if (expected[tree.count] < 1e-3 * kSeeds * kWalks) {  // no dead branches, but for rounding
        observed.pop_back();
        expected.pop_back();
      }
      EXPECT_GT(chi_square_p_value(observed, expected), 1e-5) << "width " << width;
    }
  }
}

TEST(RegionWalk, OfAPointHasThePointsProbabilities) {
  for (const Weights weights : {Weights::kMinMax, Weights::kYuksel}) {
    const LightWorld world(uneven_mix(), {8, true, true, weights});
    const LightTreeView tree = world.tree().view();
    for (const Surface& s : shading_points(20))
      for (const TreeSample& sample : walk(tree, {s.position, vec3(0), s.normal, 0}, 32, 5))
        if (sample.pdf > 0) {
          const float pdf = pdf_light_tree<8>(tree, whole_tree(tree), s.position, s.normal, sample.emitter);
          EXPECT_NEAR(sample.pdf, pdf, 1e-5f * pdf);
        }
  }
}

TEST(RegionWalk, CanFindEveryLightThatReachesAPointOfIt) {
  int reached = 0;
  for (const int width : {2, 16})
    for (const std::uint32_t scene : {0u, 1u, 2u}) {
      const LightWorld world(scene == 0 ? triangle_cloud(120, 0.4f, 23) : scene == 1 ? punctual_cloud(60) : uneven_mix(),
                             {width, true, true});
      const LightTreeView tree = world.tree().view();
      const LightSampler sampler = world.sampler(LightChoice::kTree);
      Stream random(24);
      for (const WalkRegion& region : some_regions(12, 25)) {
        for (int k = 0; k < 6; ++k) {
          const vec3 x = region.centre + (2.0f * vec3(random.next()) - 1.0f) * region.half;
          vec3 n = glm::normalize(region.normal + random.direction() * (0.99f * region.spread));
          if (glm::length(n - region.normal) > region.spread) n = region.normal;
          for (std::uint32_t e = 0; e < sampler.lights.emitters.size(); ++e) {
            const std::uint32_t leaf = tree.emitter_leaves[e];
            const vec4 u = random.next();
            const LightSample sample = local_sample(sampler, surface_at(x, n), {e, 1}, vec2(u.x, u.y));
            if (!(max_component(sample.weight) > 0) || !(glm::dot(sample.wi, n) > 0)) continue;
            ASSERT_NE(leaf, kNoEmitter);
            EXPECT_GT(pdf_in_region(tree, region, leaf), 0);
            ++reached;
          }
        }
      }
    }
  EXPECT_GT(reached, 1000);
}

TEST(RegionCut, IsAPartitionAndResolvesWhatIsNear) {
  for (const int width : {2, 16}) {
    const LightWorld world(triangle_cloud(300, 0.2f, 26), {width, true, true});
    const LightTreeView tree = world.tree().view();
    for (const WalkRegion& region : some_regions(12, 27))
      for (const int size : {16, 64}) {
        AreaCut cut;
        with_width(width, [&](auto w) { select_cut(CutOfRegion<w>{tree, region, 0.01f}, size, cut); });
        ASSERT_LE(cut.count, size);
        std::vector<int> found(tree.count, 0);
        for (int k = 0; k < cut.count; ++k) {
          const Subtree& s = cut.nodes[k].subtree;
          std::uint64_t span = 1;
          for (int level = s.level + 1; level < tree.levels; ++level) span *= static_cast<std::uint64_t>(width);
          const std::uint64_t first = (s.node * static_cast<std::uint64_t>(width) + s.first) * span;
          for (std::uint64_t leaf = first; leaf < std::min<std::uint64_t>(first + s.children * span, tree.count); ++leaf)
            ++found[leaf];
        }
        EXPECT_EQ(std::count(found.begin(), found.end(), 1), static_cast<std::ptrdiff_t>(tree.count));
        if (cut.count < size) continue;
        // Walks from all nodes find each light with its share of the node.
        std::vector<SortedStart> starts;
        for (int k = 0; k < cut.count; ++k)
          starts.push_back({cut.nodes[k].subtree, static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(k) + 1});
        const auto count = static_cast<std::size_t>(cut.count);
        std::vector<float> r(count, 0.4f), fresh(count, 0.6f);
        std::vector<WalkRange> ranges(count), next(count);
        std::vector<TreeSample> samples(count);
        sample_light_tree_sorted(tree, region, starts, {r, fresh, ranges, next}, samples);
        for (std::size_t k = 0; k < count; ++k)
          if (samples[k].pdf > 0 && is_leaf(tree, starts[k].subtree)) {
            EXPECT_EQ(samples[k].pdf, 1);
          }
      }
  }
}

// --- lights of a pool ------------------------------------------------------------------------------------------

// Light and shadow ray of a pool's light, by lanes, against those of the emitter that it was made of.
TEST(LightPool, LanesAgreeWithScalars) {
  int lit = 0;
  for (const std::uint32_t scene : {0u, 1u, 2u}) {
    const LightWorld world(scene == 0 ? triangle_cloud(64, 0.5f, 31) : scene == 1 ? punctual_cloud(60) : uneven_mix());
    const LightSampler sampler = world.sampler(LightChoice::kTree);
    Stream random(32);
    for (Surface s : shading_points(12)) {
      s.diffuse = vec3(0.7f, 0.5f, 0.2f);
      s.specular = vec3(0.04f);
      s.roughness = 0.4f;
      s.wo = glm::normalize(s.normal + 0.5f * random.direction());
      SurfaceRows rows;
      for (int k = 0; k < kWalkBatch; ++k) rows.set(k, s);
      for (std::uint32_t first = 0; first + kPoolLanes <= sampler.lights.emitters.size(); first += kPoolLanes) {
        std::array<PoolLight, kPoolLanes> lights;
        std::array<const PoolLight*, kPoolLanes> pointers;
        alignas(64) std::array<float, kPoolLanes> weights, vpl_gloss{};
        std::array<Ray, kPoolLanes> rays;
        std::array<vec3, kPoolLanes> radiance;
        std::array<std::uint32_t, kPoolLanes> index;
        std::array<vec2, kPoolLanes> u;
        for (std::uint32_t k = 0; k < kPoolLanes; ++k) {
          const vec4 v = random.next();
          u[k] = vec2(v.x, v.y);
          lights[k] = make_pool_light(sampler, {first + k, 0.5f}, u[k]);
          pointers[k] = &lights[k];
          weights[k] = 3;
          index[k] = k;
          rays[k].tmax = -1;
          radiance[k] = vec3(0);
        }
        write_lit<kPoolLanes>(light_by_pool<kPoolLanes>(rows, 0, pointers.data(), weights.data(), vpl_gloss.data()), kPoolLanes,
                              index.data(), rays, radiance);
        for (std::uint32_t k = 0; k < kPoolLanes; ++k) {
          const LightSample sample = local_sample(sampler, s, {first + k, 0.25f}, u[k]);
          const vec3 expected = unoccluded_light(s, sample) * 1.5f;
          EXPECT_NEAR(glm::length(radiance[k] - expected), 0, 2e-4f * glm::length(expected) + 1e-9f);
          if (!(max_component(expected) > 0)) continue;
          const Ray ray = shadow_ray(s, sample, sampler.lights.diagonal);
          EXPECT_LT(glm::length(ray.direction - rays[k].direction), 1e-4f * glm::length(ray.direction));
          EXPECT_NEAR(ray.tmax, rays[k].tmax, 1e-4f);
          ++lit;
        }
      }
    }
  }
  EXPECT_GT(lit, 300);
}

// A light that lights a surface is one that the surface may take.
TEST(LightPool, WeightsArePositiveWhereLightArrives) {
  const LightWorld world(uneven_mix());
  const LightSampler sampler = world.sampler(LightChoice::kTree);
  Stream random(41);
  auto pool = std::make_unique<LightPool>();
  int lit = 0;
  for (const Surface& s : shading_points(60)) {
    std::array<float, kMaxPool> exact{};
    for (int j = 0; j < kMaxPool; ++j) {
      const auto e = static_cast<std::uint32_t>(random.next().x * static_cast<float>(sampler.lights.emitters.size()));
      const vec4 u = random.next();
      pool->set(j, make_pool_light(sampler, {e, 0.5f}, vec2(u.x, u.y)));
      const LightSample sample = local_sample(sampler, s, {e, 0.5f}, vec2(u.x, u.y));
      exact[static_cast<std::size_t>(j)] = luminance(unoccluded_light(s, sample)) * kPi;
    }
    PoolWeights weights;
    weights.set(*pool, kMaxPool, s.position, s.normal);
    float sum = 0;
    for (std::size_t j = 0; j < kMaxPool; ++j) {
      if (exact[j] > 1e-6f * weights.total) {
        EXPECT_GT(weights.weights[j], 0);
      }
      sum += weights.weights[j];
      EXPECT_NEAR(weights.sums[j], sum, 1e-4f * weights.total + 1e-12f);
      lit += exact[j] > 0 ? 1 : 0;
    }
    if (!(weights.total > 0)) continue;
    for (int k = 0; k < 16; ++k) {
      const float target = random.next().x * weights.total;
      const auto j = static_cast<std::size_t>(weights.pick(kMaxPool, target));
      EXPECT_GT(weights.weights[j], 0);
      EXPECT_GE(weights.sums[j], target * 0.9999f);
      EXPECT_LE(weights.sums[j] - weights.weights[j], target * 1.0001f + 1e-6f * weights.total);
    }
  }
  EXPECT_GT(lit, 200);
}

TEST(PoolLookup, NeighboursUseAllPoolsOfTheirArea) {
  for (const int m : {1, 2, 3, 4}) {
    PoolLookup lookup{{{64, 128, 128, 192}, 8 * m, 1, 7}, m, 64};
    std::vector<int> users(static_cast<std::size_t>(lookup.pools()), 0);
    for (int y = 128; y < 192; ++y)
      for (int x = 64; x < 128; ++x) {
        const int pool = lookup.pool_of({x, y});
        ASSERT_EQ(pool / lookup.pools_per_area(), lookup.areas.block_of({x, y}));
        ++users[static_cast<std::size_t>(pool)];
      }
    EXPECT_GT(*std::min_element(users.begin(), users.end()), 0);
    const int x = 66 / m * m, y = 130 / m * m;  // a quad of m x m pixels
    std::vector<int> pools;
    for (int k = 0; k < m * m; ++k) pools.push_back(lookup.pool_of({x + k % m, y + k / m}) % lookup.pools_per_area());
    std::sort(pools.begin(), pools.end());
    for (int k = 0; k < m * m; ++k) EXPECT_EQ(pools[static_cast<std::size_t>(k)], k / 2);  // two pixels each
  }
}

// --- whole frames ----------------------------------------------------------------------------------------------

// Surfaces that face everywhere and hide each other, lights of every kind.
Scene lights_of_all_kinds() {
  SceneBuilder b;
  const int wall = b.material(vec3(0.6f)), shiny = b.material(vec3(0.5f), vec3(0), 0.8f, 0.4f);
  b.quad(vec3(-3, 0, -3), vec3(0, 0, 6), vec3(6, 0, 0), wall);
  b.quad(vec3(-3, 0, -3), vec3(6, 0, 0), vec3(0, 3, 0), shiny);
  b.room(vec3(0.8f, 1.2f, 0.4f), vec3(-0.4f, 0.02f, -0.8f), b.material(vec3(0.3f, 0.6f, 0.4f)));
  Stream random(51);
  for (int i = 0; i < 24; ++i) {
    const int bright = b.material(vec3(0), random.in_box(vec3(0.5f), vec3(6)));
    const vec3 at = i < 12 ? random.in_box(vec3(-2.5f, 2.8f, -2.5f), vec3(2.5f, 3, 2.5f))
                           : random.in_box(vec3(-2, 0.3f, -2.3f), vec3(2, 1.5f, -1.2f));
    b.quad(at, vec3(0.1f, 0, 0), i < 12 ? vec3(0, 0, 0.1f) : vec3(0, 0.1f, 0), bright);
  }
  PunctualLight spot;
  spot.type = LightType::kSpot;
  spot.color = vec3(4, 1, 1);
  spot.outer_cone = 0.9f;
  spot.range = 6;
  b.punctual(spot, vec3(-2, 2.5f, 1), glm::normalize(vec3(0.5f, -1, -0.4f)));
  PunctualLight point;
  point.color = vec3(0.5f, 1, 2);
  b.punctual(point, vec3(1.5f, 1, 1), vec3(0, -1, 0));
  PunctualLight sun;
  sun.type = LightType::kDirectional;
  sun.color = vec3(0.4f);
  b.punctual(sun, vec3(0), glm::normalize(vec3(0.4f, -1, -0.3f)));
  b.scene.environment.radiance = vec3(0.1f);
  return b.scene;
}

Settings view_of_lights(const std::string& preset, int spp, std::uint32_t seed) {
  Settings settings = square_view(preset, 20, vec3(0.3f, 1.7f, 3.4f), vec3(0, 0.7f, -1), 60);
  settings.spp = spp;
  settings.seed = seed;
  settings.force_diffuse = false;
  return settings;
}

// Direct light (green) of 4 x 4 cells of an image.
std::vector<double> cells(const Image& image) {
  std::vector<double> sums(16, 0);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      sums[static_cast<std::size_t>(y * 4 / image.height * 4 + x * 4 / image.width)] += static_cast<double>(
          image.find("direct")->values[3 * static_cast<std::size_t>(y * image.width + x) + 1]);
  return sums;
}

// Pixels share lights, so that whole images are what is independent: one a seed.
TEST(LightPool, HasTheExhaustiveSumAsMean) {
  const Scene scene = lights_of_all_kinds();
  const std::vector<double> truth = cells(render(scene, view_of_lights("exhaustive", 400, 1000)));
  struct Variant {
    int size, samples, share, interleave, width;
  };
  for (const Variant& v : {Variant{64, 8, 8, 4, 16}, Variant{16, 3, 8, 1, 2}, Variant{32, 1, 4, 2, 8},
                           Variant{48, 20, 3, 3, 4}}) {
    std::vector<RunningMean> means(16);
    constexpr int kSeeds = 32;
    for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
      Settings settings = view_of_lights("pool", 8, seed);
      settings.direct.pool = v.size;
      settings.direct.spp = v.samples;
      settings.direct.cut_share = v.share;
      settings.direct.cut_interleave = v.interleave;
      settings.direct.width = v.width;
      const std::vector<double> values = cells(render(scene, settings));
      for (std::size_t c = 0; c < means.size(); ++c) means[c].add(values[c]);
    }
    for (std::size_t c = 0; c < means.size(); ++c)
      EXPECT_TRUE(mean_within(means[c], truth[c], 4.5, 2e-3 * truth[c]))
          << v.size << " lights, " << v.samples << " samples, cell " << c;
  }
}

double summed_variance(const Scene& scene, const Settings& settings) {
  const Image image = render(scene, settings);
  double sum = 0;
  for (const float v : image.find("variance")->values) sum += static_cast<double>(v);
  return sum;
}

// Virtual point lights have pools too, by themselves and together with the emitters.
TEST(LightPool, OfVplsHasTheSumOverThemAsMean) {
  Scene scene = lights_of_all_kinds();
  const auto settings_of = [&](const std::string& selection, bool joint, int spp, std::uint32_t seed) {
    Settings settings = view_of_lights("pool", spp, seed);
    settings.indirect.transport = Transport::kVpl;
    settings.indirect.vpls = 300;
    settings.indirect.bounces = 2;
    settings.indirect.keep_vpls = true;
    settings.indirect.joint = joint;
    set_value(settings, "indirect.weights", selection == "all" ? "distance-bounded" : "min-max");
    set_value(settings, "indirect.hierarchy", selection == "all" ? "substitute" : "perfect");
    set_value(settings, "indirect.selection", selection);
    settings.indirect.spp = selection == "all" ? 1 : 4;
    settings.indirect.cut_share = settings.indirect.cut_interleave = 2;
    return settings;
  };
  const auto indirect_sum = [](const Image& image, const char* layer) {
    double sum = 0;
    for (std::size_t i = 1; i < image.find(layer)->values.size(); i += 3)
      sum += static_cast<double>(image.find(layer)->values[i]);
    return sum;
  };
  // The lights of a seed are the same for all ways of choosing among them.
  RunningMean alone, joint, direct;
  constexpr int kSeeds = 24;
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    const Image truth = render(scene, settings_of("all", false, 4, seed));
    const Image pools = render(scene, settings_of("pool", false, 8, seed));
    const Image both = render(scene, settings_of("pool", true, 8, seed));
    const double expected = indirect_sum(truth, "indirect");
    alone.add(indirect_sum(pools, "indirect") / expected - 1);
    joint.add(indirect_sum(both, "indirect") / expected - 1);
    direct.add(indirect_sum(both, "direct") / indirect_sum(pools, "direct") - 1);
  }
  EXPECT_TRUE(mean_within(alone, 0, 4.5, 2e-3));
  EXPECT_TRUE(mean_within(joint, 0, 4.5, 2e-3));
  EXPECT_TRUE(mean_within(direct, 0, 4.5, 2e-3));
  EXPECT_LT(alone.standard_error(), 0.02);
}

TEST(LightPool, IsLessNoisyThanWalksOfEveryPixel) {
  Scene scene = lights_of_all_kinds();
  scene.environment.radiance = vec3(0);
  scene.lights.pop_back();  // no sun, no sky
  scene.nodes.pop_back();
  Settings walks = view_of_lights("tree", 48, 3), pool = view_of_lights("pool", 48, 3);
  walks.direct.spp = pool.direct.spp = 8;
  pool.direct.cut_share = pool.direct.cut_interleave = 2;  // few pixels see far
  EXPECT_LT(summed_variance(scene, pool), 0.7 * summed_variance(scene, walks));
}

// Tiles light rows of areas one after another where they can.
TEST(LightPool, DoesNotDependOnThreadsOrOnCropsAlongTiles) {
  const Scene scene = lights_of_all_kinds();
  Settings settings = view_of_lights("pool", 2, 0);
  settings.width = 96;
  settings.height = 80;
  settings.threads = 4;
  const Image whole = render(scene, settings);
  settings.threads = 1;
  EXPECT_EQ(render(scene, settings).find("direct")->values, whole.find("direct")->values);
  settings.pixel_bounds = std::array<int, 4>{64, 96, 64, 80};
  const Image crop = render(scene, settings);
  for (int y = 64; y < 80; ++y)
    for (int x = 64; x < 96; ++x) {
      const std::size_t i = 3 * static_cast<std::size_t>(y * 96 + x);
      ASSERT_EQ(crop.find("direct")->values[i], whole.find("direct")->values[i]);
    }
}

TEST(LightPool, RefusesWhatItDoesNotCombineWith) {
  Settings settings = view_of_lights("pool", 1, 0);
  settings.direct.mis = true;
  EXPECT_THROW(check(settings), Error);
  settings.direct.mis = false;
  settings.direct.hierarchy = Hierarchy::kTwoLevel;
  EXPECT_THROW(check(settings), Error);
  settings.direct.hierarchy = Hierarchy::kPerfect;
  settings.direct.cut_interleave = 5;
  EXPECT_THROW(check(settings), Error);
}

}  // namespace
}  // namespace lumigrove
