#include "methods/light_bvh/light_bvh.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstring>

#include "light_fixtures.h"
#include "methods/light_bvh/light_bvh_costs.h"
#include "methods/light_sampling/direct_lighting_kernel.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

constexpr LightBvh::Options kBvhs[] = {{Hierarchy::kSaoh, Weights::kSaoh, true},
                                       {Hierarchy::kSaoh, Weights::kMinMax, true},
                                       {Hierarchy::kAgglomerative, Weights::kMinMax, true},
                                       {Hierarchy::kAgglomerative, Weights::kMinMax, false},
                                       {Hierarchy::kAgglomerative, Weights::kSaoh, true},
                                       {Hierarchy::kSaoh, Weights::kYuksel, true},
                                       {Hierarchy::kAgglomerative, Weights::kYuksel, false}};
constexpr Hierarchy kBuilders[] = {Hierarchy::kSaoh, Hierarchy::kAgglomerative};

std::string name_of(const LightBvh::Options& o) {
  return std::string(o.builder == Hierarchy::kSaoh ? "saoh tree" : "agglomerative tree") +
         (o.weights == Weights::kSaoh     ? ", saoh weights"
          : o.weights == Weights::kYuksel ? ", Yuksel's weights"
                                          : ", min-max weights") +
         (o.cones ? "" : " without cones");
}

struct BvhWorld {
  LightWorld lights;
  LightBvh bvh;

  BvhWorld(const Scene& scene, const LightBvh::Options& options) : lights(scene) {
    bvh.build(lights.lights(), options);
  }
  LightSampler sampler() const {
    LightSampler sampler = lights.sampler(LightChoice::kUniform);
    sampler.choice = LightChoice::kBvh;
    sampler.bvh = bvh.view();
    return sampler;
  }
};

// The emitters below an entry, left before right.
std::vector<std::uint32_t> emitters_below(const LightBvhView& bvh, std::uint32_t entry) {
  std::vector<std::uint32_t> waiting{bvh.link(entry)}, emitters;
  while (!waiting.empty()) {
    const std::uint32_t link = waiting.back();
    waiting.pop_back();
    if ((link & kBvhLeaf) != 0) {
      emitters.push_back(link & ~kBvhLeaf);
      continue;
    }
    waiting.push_back(bvh.nodes[link].child[1]);
    waiting.push_back(bvh.nodes[link].child[0]);
  }
  return emitters;
}

TEST(LightBvh, NodesAreSmall) { EXPECT_LE(sizeof(LightBvhNode) / 2, 64u); }

TEST(LightBvh, BoxesAndConesHoldTheirLightsAndSumsAdd) {
  for (const NamedScene& named : light_scenes()) {
    for (const Hierarchy builder : kBuilders) {
      const BvhWorld world(named.scene, {builder, Weights::kMinMax, true});
      const LightBvhView bvh = world.bvh.view();
      const LightView lights = world.lights.lights();
      for (std::uint32_t entry = 0; entry < 2 * bvh.count; ++entry) {
        if (entry == 1) continue;  // nothing stands beside the root
        const LightBvhNode& node = bvh.nodes[entry / 2];
        const LightNode<2>& box = node.bounds;
        const std::uint32_t c = entry % 2;
        const vec3 centre(box.centre_x[c], box.centre_y[c], box.centre_z[c]);
        const vec3 half(box.half_x[c], box.half_y[c], box.half_z[c]);
        const PackedCone cone{box.axis_x[c], box.axis_y[c], box.axis_z[c], box.radius[c]};
        double sum = 0, moment = 0;
        const std::vector<std::uint32_t> below = emitters_below(bvh, entry);
        EXPECT_EQ(node.count[c], below.size());
        std::uint32_t leaf = node.first + (c == 1 ? node.count[0] : 0);
        for (const std::uint32_t e : below) {
          const Box3 emitter = emitter_bounds(lights.emitters[e]);
          EXPECT_TRUE(glm::all(glm::lessThanEqual(centre - half, emitter.lo)));
          EXPECT_TRUE(glm::all(glm::greaterThanEqual(centre + half, emitter.hi)));
          const NormalCone normals = emission_cone(lights, lights.emitters[e]);
          EXPECT_LE(std::min(2.0f, glm::length(normals.axis - cone.axis()) + normals.radius), cone.width());
          const double intensity = emitter_intensity(lights, e) / lights.local_flux;
          sum += intensity;
          moment += intensity * intensity;
          EXPECT_EQ(bvh.emitter_leaves[e], leaf++);
        }
        EXPECT_NEAR(box.intensity[c], sum, 1e-4 * sum);
        EXPECT_NEAR(node.moment[c], moment, 1e-4 * moment);
      }
    }
  }
}

TEST(LightBvh, LeavesEveryEmitterWithFluxExactlyOnce) {
  for (const Hierarchy builder : kBuilders) {
    const BvhWorld world(punctual_cloud(120), {builder, Weights::kMinMax, true});
    const LightView lights = world.lights.lights();
    std::vector<int> seen(lights.emitters.size(), 0);
    for (const std::uint32_t e : emitters_below(world.bvh.view(), kBvhRoot)) ++seen[e];
    for (std::uint32_t e = 0; e < seen.size(); ++e) {
      EXPECT_EQ(seen[e], emitter_flux(lights, e) > 0 ? 1 : 0);
      EXPECT_EQ(world.bvh.view().emitter_leaves[e] != kNoEmitter, seen[e] == 1);
    }
  }
}

// --- the agglomerative builder against all pairs -------------------------------------------------------------

// Cost of the merge that made each node, by bottom-up union in the builder's order.
struct ReplayedMerge {
  float cost;
  EmitterCluster left, right;
};
EmitterCluster replay(const LightWorld& world, const LightBvhView& bvh, std::uint32_t link,
                      std::vector<ReplayedMerge>& merges) {
  const LightView lights = world.lights();
  if ((link & kBvhLeaf) != 0) return emitter_cluster(lights, link & ~kBvhLeaf, 1 / lights.local_flux);
  const EmitterCluster left = replay(world, bvh, bvh.nodes[link].child[0], merges);
  const EmitterCluster right = replay(world, bvh, bvh.nodes[link].child[1], merges);
  merges.push_back({pair_cost(left, right, lights.diagonal * lights.diagonal), left, right});
  return unite(left, right);
}

// Merging the cheapest of all pairs again and again: the costs, in order.
std::vector<float> greedy_costs(const LightWorld& world) {
  const LightView lights = world.lights();
  std::vector<EmitterCluster> clusters;
  for (std::uint32_t e = 0; e < lights.emitters.size(); ++e)
    if (emitter_intensity(lights, e) > 0) clusters.push_back(emitter_cluster(lights, e, 1 / lights.local_flux));
  std::vector<float> costs;
  while (clusters.size() > 1) {
    std::size_t a = 0, b = 1;
    float least = kInfinity;
    for (std::size_t i = 0; i < clusters.size(); ++i)
      for (std::size_t j = i + 1; j < clusters.size(); ++j) {
        const float cost = pair_cost(clusters[i], clusters[j], lights.diagonal * lights.diagonal);
        if (!(cost < least)) continue;
        least = cost;
        a = i, b = j;
      }
    costs.push_back(least);
    clusters[a] = unite(clusters[a], clusters[b]);
    clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(b));
  }
  return costs;
}

TEST(LightBvhAgglomerative, MakesTheMergesOfPickingTheCheapestOfAllPairs) {
  for (const Scene& scene : {triangle_cloud(200, 0.3f), triangle_cloud(80, 2.0f, 7), far_clusters_under_a_sky()}) {
    const BvhWorld world(scene, {Hierarchy::kAgglomerative, Weights::kMinMax, true});
    std::vector<ReplayedMerge> merges;
    replay(world.lights, world.bvh.view(), world.bvh.view().link(kBvhRoot), merges);
    std::sort(merges.begin(), merges.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
    const std::vector<float> greedy = greedy_costs(world.lights);
    ASSERT_EQ(merges.size(), greedy.size());
    for (std::size_t i = 0; i < greedy.size(); ++i) EXPECT_NEAR(merges[i].cost, greedy[i], 1e-4f * greedy[i]) << i;
  }
}

// With ties too: by ascending cost, each merge joins two clusters that are then nearest to one another.
TEST(LightBvhAgglomerative, EveryMergeJoinsMutuallyNearestClusters) {
  for (const NamedScene& named : light_scenes()) {
    const BvhWorld world(named.scene, {Hierarchy::kAgglomerative, Weights::kMinMax, true});
    const LightView lights = world.lights.lights();
    const float diagonal2 = lights.diagonal * lights.diagonal;
    std::vector<ReplayedMerge> merges;
    replay(world.lights, world.bvh.view(), world.bvh.view().link(kBvhRoot), merges);
    std::stable_sort(merges.begin(), merges.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
    std::vector<EmitterCluster> active;
    for (const std::uint32_t e : emitters_below(world.bvh.view(), kBvhRoot))
      active.push_back(emitter_cluster(lights, e, 1 / lights.local_flux));
    const auto same = [](const EmitterCluster& a, const EmitterCluster& b) {
      return a.box.lo == b.box.lo && a.box.hi == b.box.hi && a.intensity == b.intensity && a.cone.axis == b.cone.axis;
    };
    for (const ReplayedMerge& merge : merges) {
      for (const EmitterCluster* side : {&merge.left, &merge.right}) {
        const auto found =
            std::find_if(active.begin(), active.end(), [&](const EmitterCluster& c) { return same(c, *side); });
        ASSERT_NE(found, active.end()) << named.name;
        active.erase(found);
      }
      for (const EmitterCluster& other : active) {
        EXPECT_GE(pair_cost(merge.left, other, diagonal2), merge.cost * (1 - 1e-4f)) << named.name;
        EXPECT_GE(pair_cost(merge.right, other, diagonal2), merge.cost * (1 - 1e-4f)) << named.name;
      }
      active.push_back(unite(merge.left, merge.right));
    }
  }
}

TEST(LightBvhAgglomerative, CostIsSymmetricAndNeverFallsAsClustersGrow) {
  const LightWorld world(triangle_cloud(120, 0.5f));
  const LightView lights = world.lights();
  std::vector<EmitterCluster> c;
  for (std::uint32_t e = 0; e < 30; ++e) c.push_back(emitter_cluster(lights, 4 * e, 1 / lights.local_flux));
  for (std::size_t i = 0; i + 2 < c.size(); ++i) {
    EXPECT_EQ(pair_cost(c[i], c[i + 1], 2), pair_cost(c[i + 1], c[i], 2));
    EXPECT_GE(pair_cost(unite(c[i], c[i + 1]), c[i + 2], 2),
              std::max(pair_cost(c[i], c[i + 2], 2), pair_cost(c[i + 1], c[i + 2], 2)) * (1 - 1e-5f));
  }
}

// --- both builders -------------------------------------------------------------------------------------------

TEST(LightBvh, SameBitsForAnyThreadCount) {
  for (const Hierarchy builder : kBuilders) {
    const Scene scene = triangle_cloud(builder == Hierarchy::kSaoh ? 20000 : 1500, 0.01f);
    std::vector<std::vector<std::byte>> nodes;
    for (const std::size_t threads : {1u, 2u, 4u}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      const BvhWorld world(scene, {builder, Weights::kMinMax, true});
      const LightBvhView bvh = world.bvh.view();
      const auto* bytes = reinterpret_cast<const std::byte*>(bvh.nodes);
      nodes.emplace_back(bytes, bytes + bvh.count * sizeof(LightBvhNode));
    }
    EXPECT_EQ(nodes[0], nodes[1]);
    EXPECT_EQ(nodes[0], nodes[2]);
  }
}

TEST(LightBvh, SaohCostsLessThanSplittingInTheMiddle) {
  // Two groups that face opposite ways on one spot: only the orientation tells them apart.
  Scene scene;
  Stream random(3);
  std::vector<vec3> corners;
  for (int i = 0; i < 64; ++i) {
    const vec3 p = random.in_box(vec3(-1), vec3(1)) * vec3(1, 0.3f, 1) + vec3(0, i % 2 == 0 ? 0.4f : -0.4f, 0);
    const vec3 a(0.01f, 0, 0), b(0, 0, i % 2 == 0 ? -0.01f : 0.01f);
    corners.insert(corners.end(), {p, p + a, p + b});
  }
  add_node(scene, {add_mesh(scene, add_material(scene, vec3(1)), corners)});
  const BvhWorld world(scene, {Hierarchy::kSaoh, Weights::kSaoh, true});
  const LightNode<2>& top = world.bvh.view().nodes[world.bvh.view().link(kBvhRoot)].bounds;
  // Emitters of one direction on each side, although the boxes are longer in the other axes.
  EXPECT_LT(top.radius[0], 8);
  EXPECT_LT(top.radius[1], 8);
}

TEST(LightBvh, OneLightIsAlwaysFoundAndNoLightNever) {
  for (const LightBvh::Options& options : kBvhs) {
    Scene single;
    add_node(single, {add_mesh(single, add_material(single, vec3(1)),
                               {vec3(0, 1, 0), vec3(1, 1, 0), vec3(0, 1, 1)})});
    const BvhWorld alone(single, options);
    const TreeSample found =
        sample_light_bvh(alone.bvh.view(), kBvhRoot, vec3(0), vec3(0, 1, 0), vec2(0.99f, 0));
    EXPECT_EQ(found.emitter, 0u);
    EXPECT_EQ(found.pdf, 1.0f);
    std::uint32_t entries[kMaxSplit];
    EXPECT_EQ(split_light_bvh(alone.bvh.view(), vec3(0), vec3(0, 1, 0), {1, 16}, entries), 1);
    const BvhWorld dark(Scene{}, options);
    EXPECT_EQ(sample_light_bvh(dark.bvh.view(), kBvhRoot, vec3(0), vec3(0, 1, 0), vec2(0.5f)).emitter, kNoEmitter);
    EXPECT_EQ(split_light_bvh(dark.bvh.view(), vec3(0), vec3(0, 1, 0), {1, 16}, entries), 0);
  }
}

TEST(LightBvh, CoincidentLightsAreAllFoundWithTheirShare) {
  Scene scene;
  add_node(scene, {add_mesh(scene, add_material(scene, vec3(0)), {vec3(-1), vec3(1), vec3(1, -1, 1)})});
  for (int i = 0; i < 37; ++i) add_light(scene, {}, vec3(0, 2, 0));
  for (const LightBvh::Options& options : kBvhs) {
    const BvhWorld world(scene, options);
    for (std::uint32_t e = 0; e < 37; ++e)
      EXPECT_NEAR(pdf_light_bvh(world.bvh.view(), kBvhRoot, vec3(1, 0, 0), vec3(0, 1, 0), e), 1.0 / 37, 1e-5);
    EXPECT_TRUE(is_finite(
        sample_light_bvh(world.bvh.view(), kBvhRoot, vec3(0, 2, 0), vec3(0, 1, 0), vec2(0.5f)).pdf));
  }
}

TEST(LightBvh, ProbabilitiesSumToOneWhereEveryLightIsAbove) {
  Scene scene;
  Stream random(6);
  add_node(scene, {add_mesh(scene, add_material(scene, vec3(0)), {vec3(-5), vec3(5, -5, -5), vec3(5)})});
  for (int i = 0; i < 300; ++i) {
    PunctualLight light;
    light.color = random.in_box(vec3(0.01f), vec3(3));
    add_light(scene, light, random.in_box(vec3(-5), vec3(5)));
  }
  for (const LightBvh::Options& options : kBvhs) {
    const BvhWorld world(scene, options);
    for (int i = 0; i < 20; ++i) {
      const vec3 x = random.in_box(vec3(-6, -40, -6), vec3(6, -5.1f, 6));
      double sum = 0;
      for (std::uint32_t e = 0; e < world.lights.lights().emitters.size(); ++e)
        sum += pdf_light_bvh(world.bvh.view(), kBvhRoot, x, vec3(0, 1, 0), e);
      EXPECT_NEAR(sum, 1, 1e-4) << name_of(options);
    }
  }
}

TEST(LightBvh, ProbabilitiesNeverSumToMoreThanOne) {
  for (const NamedScene& named : light_scenes()) {
    for (const LightBvh::Options& options : kBvhs) {
      const BvhWorld world(named.scene, options);
      const LightBvhView bvh = world.bvh.view();
      for (const Surface& s : shading_points(60)) {
        double sum = 0;
        for (std::uint32_t e = 0; e < world.lights.lights().emitters.size(); ++e)
          sum += pdf_light_bvh(bvh, kBvhRoot, s.position, s.normal, e);
        EXPECT_LE(sum, 1 + 1e-4) << named.name << ", " << name_of(options);
      }
    }
  }
}

TEST(LightBvh, WalkReportsThePdfBitForBitBelowEveryPartOfASplit) {
  for (const NamedScene& named : light_scenes()) {
    for (const LightBvh::Options& options : kBvhs) {
      const BvhWorld world(named.scene, options);
      const LightBvhView bvh = world.bvh.view();
      Stream random(77);
      for (const Surface& s : shading_points(100)) {
        std::uint32_t entries[kMaxSplit];
        const int count = split_light_bvh(bvh, s.position, s.normal, {0.8f, 6}, entries);
        for (int i = 0; i < count; ++i) {
          const vec4 u = random.next();
          const TreeSample sample = sample_light_bvh(bvh, entries[i], s.position, s.normal, vec2(u.x, u.y));
          if (sample.emitter == kNoEmitter) continue;
          for (int j = 0; j < count; ++j)
            EXPECT_EQ(pdf_light_bvh(bvh, entries[j], s.position, s.normal, sample.emitter), i == j ? sample.pdf : 0.0f)
                << named.name << ", " << name_of(options);
        }
      }
    }
  }
}

TEST(LightBvh, FrequenciesFollowThePdf) {
  constexpr int kDraws = 30000;
  for (const NamedScene& named : light_scenes()) {
    for (const LightBvh::Options& options : kBvhs) {
      const BvhWorld world(named.scene, options);
      const LightBvhView bvh = world.bvh.view();
      const std::size_t n = world.lights.lights().emitters.size();
      Stream random(5);
      for (const Surface& s : shading_points(5, 31)) {
        const double p = walk_p_value(
            kDraws, n, random, [&](vec2 u) { return sample_light_bvh(bvh, kBvhRoot, s.position, s.normal, u); },
            [&](std::uint32_t e) { return pdf_light_bvh(bvh, kBvhRoot, s.position, s.normal, e); });
        // 140 tests in all: 1e-5 each keeps false alarms below one in seven hundred.
        EXPECT_GT(p, 1e-5) << named.name << ", " << name_of(options);
      }
    }
  }
}

// Property: light that can arrive has positive probability, from the root and in exactly one part of a split.
TEST(LightBvh, ContributionImpliesProbability) {
  for (const NamedScene& named : light_scenes()) {
    for (const LightBvh::Options& options : kBvhs) {
      const BvhWorld world(named.scene, options);
      const LightSampler sampler = world.sampler();
      Stream random(8);
      int compared = 0;
      for (const Surface& s : shading_points(150, 12)) {
        std::uint32_t entries[kMaxSplit];
        const int count = split_light_bvh(sampler.bvh, s.position, s.normal, {0.85f, 12}, entries);
        ASSERT_LE(count, 12);
        for (std::uint32_t e = 0; e < sampler.lights.emitters.size(); ++e) {
          const vec4 u = random.next();
          const EmitterPoint point =
              sample_emitter_point(sampler.scene, sampler.lights, e, s.position, vec2(u.x, u.y));
          if (!(max_component(point.incident) > 0) || !(glm::dot(point.wi, s.normal) > 1e-5f)) continue;
          ASSERT_GT(pdf_light_bvh(sampler.bvh, kBvhRoot, s.position, s.normal, e), 0.0f)
              << named.name << ", " << name_of(options) << ", emitter " << e;
          int parts = 0;
          for (int i = 0; i < count; ++i)
            parts += pdf_light_bvh(sampler.bvh, entries[i], s.position, s.normal, e) > 0;
          ASSERT_EQ(parts, 1) << named.name << ", " << name_of(options) << ", emitter " << e;
          ++compared;
        }
      }
      EXPECT_GT(compared, 500);
    }
  }
}

// --- splitting -----------------------------------------------------------------------------------------------

TEST(LightBvhSplit, MorePartsForLargerThresholdsAndNearerPoints) {
  const BvhWorld world(triangle_cloud(400, 0.1f), {Hierarchy::kSaoh, Weights::kSaoh, true});
  const auto parts = [&](vec3 x, float threshold, int cap) {
    std::uint32_t entries[kMaxSplit];
    return split_light_bvh(world.bvh.view(), x, vec3(0, 1, 0), {threshold, cap}, entries);
  };
  const vec3 near(0, -4, 0), far(0, -400, 0);
  EXPECT_EQ(parts(near, 0, 64), 1);
  EXPECT_LE(parts(near, 0.6f, 64), parts(near, 0.8f, 64));
  EXPECT_LT(parts(near, 0.6f, 64), parts(near, 0.95f, 64));
  EXPECT_EQ(parts(near, 1, 64), 64);
  EXPECT_EQ(parts(near, 1, 7), 7);
  EXPECT_EQ(parts(near, 1, 1), 1);
  EXPECT_LT(parts(far, 0.8f, 64), parts(near, 0.8f, 64));
}

TEST(LightBvhSplit, ScalingAndBrightnessChangeNothing) {
  constexpr float kScale = 1024;  // a power of two: exact in floating point
  const Scene scene = triangle_cloud(200, 0.3f);
  Scene scaled = scene;
  for (Mesh& mesh : scaled.meshes)
    for (vec3& p : mesh.positions) p *= kScale;
  for (const Hierarchy builder : kBuilders) {
    const BvhWorld a(scene, {builder, Weights::kSaoh, true}), b(scaled, {builder, Weights::kSaoh, true});
    for (const Surface& s : shading_points(100)) {
      std::uint32_t of_a[kMaxSplit], of_b[kMaxSplit];
      const int count = split_light_bvh(a.bvh.view(), s.position, s.normal, {0.8f, 16}, of_a);
      ASSERT_EQ(split_light_bvh(b.bvh.view(), s.position * kScale, s.normal, {0.8f, 16}, of_b), count);
      EXPECT_TRUE(std::equal(of_a, of_a + count, of_b));
    }
  }
}

// The kernel, all passes together: its mean is the exhaustive sum.
TEST(LightBvhSplit, MeanOverAllPassesIsTheExhaustiveSum) {
  constexpr int kRounds = 3000, kCap = 8, kPoints = 4;
  for (const NamedScene& named : light_scenes()) {
    for (const Hierarchy builder : kBuilders) {
      const BvhWorld world(named.scene, {builder, Weights::kSaoh, true});
      const LightSampler sampler = world.sampler();
      std::vector<Surface> surfaces = shading_points(kPoints, 43);
      std::vector<std::uint32_t> pixels{1, 2, 3, 4}, entries(kPoints * kCap);
      std::vector<std::uint8_t> counts(kPoints);
      std::vector<Ray> shadow(kPoints);
      std::vector<vec3> contribution(kPoints);
      const SplitKernel split{sampler.bvh, {0.85f, kCap}, surfaces, entries, counts};
      for (int i = 0; i < kPoints; ++i) split(i);
      RunningMean estimate[kPoints], truth[kPoints];
      for (std::uint32_t round = 0; round < kRounds; ++round) {
        double sum[kPoints] = {};
        for (int pass = 0; pass <= kCap; ++pass) {
          const DirectLightKernel kernel{sampler, {7, round, 0}, kDimLight + 4 * static_cast<std::uint32_t>(pass), 1,
                                         false, surfaces, pixels, shadow, contribution, {}, {},
                                         {entries, counts, kCap, pass}};
          kernel(0);
          for (std::size_t i = 0; i < kPoints; ++i) sum[i] += luminance(contribution[i]);
        }
        for (int i = 0; i < kPoints; ++i) estimate[i].add(sum[i]);
      }
      Stream random(21);
      for (std::size_t i = 0; i < kPoints; ++i) {
        LightSampler one = sampler;
        one.choice = LightChoice::kOne;
        for (int round = 0; round < 150; ++round) {
          double sum = 0;
          for (one.one = 0; one.one < light_count(one.lights); ++one.one) {
            const LightSample sample = sample_light(one, surfaces[i], random.next());
            const float cosine = std::max(0.0f, glm::dot(sample.wi, surfaces[i].normal));
            if (cosine > 0 && max_component(sample.weight) > 0)
              sum += luminance(bsdf_eval(surfaces[i], sample.wi) * sample.weight) * cosine;
          }
          truth[i].add(sum);
        }
        // 32 comparisons: 4.5 standard errors keep false alarms below one in a thousand.
        const double error = std::hypot(estimate[i].standard_error(), truth[i].standard_error());
        EXPECT_NEAR(estimate[i].mean(), truth[i].mean(), 4.5 * error + 1e-6 * truth[i].mean())
            << named.name << ", point " << i << ", parts " << int{counts[i]};
      }
    }
  }
}

TEST(LightBvh, OtherBuildersAreRefused) {
  LightBvh bvh;
  EXPECT_THROW(bvh.build(LightView{}, {Hierarchy::kPerfect, Weights::kMinMax, true}), Error);
}

}  // namespace
}  // namespace lumigrove
