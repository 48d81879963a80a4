#include "methods/light_tree/light_tree.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>

#include "light_fixtures.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

constexpr LightTree::Options kTrees[] = {{2, false, true},  {4, false, true}, {8, false, true}, {16, false, true},
                                         {2, true, true},   {4, true, true},  {8, true, true},  {16, true, true},
                                         {2, false, true, Weights::kYuksel},  {4, true, true, Weights::kYuksel},
                                         {8, false, true, Weights::kYuksel},  {16, true, true, Weights::kYuksel}};

std::string name_of(const LightTree::Options& tree) {
  return "width " + std::to_string(tree.width) + (tree.cones ? " with cones" : "") +
         (tree.weights == Weights::kYuksel ? ", Yuksel's weights" : "");
}

template <int W>
void expect_nodes_hold_their_leaves(const LightWorld& world) {
  const LightTreeView tree = world.tree().view();
  const LightView lights = world.lights();
  std::uint32_t span = 1;  // leaves below a child
  for (int level = tree.levels - 1; level >= 0; --level, span *= W) {
    for (std::uint32_t leaf = 0; leaf < tree.count; leaf += span) {
      const LightNode<W>& node = tree.level<W>(level)[leaf / span / W];
      const std::uint32_t c = leaf / span % W;
      const vec3 centre(node.centre_x[c], node.centre_y[c], node.centre_z[c]);
      const vec3 half(node.half_x[c], node.half_y[c], node.half_z[c]);
      const vec3 axis = vec3(node.axis_x[c], node.axis_y[c], node.axis_z[c]) / kConeAxis;
      const float radius = 2 * static_cast<float>(node.radius[c]) / kConeRadius;
      double sum = 0;
      for (std::uint32_t k = leaf; k < std::min(tree.count, leaf + span); ++k) {
        const Emitter& emitter = lights.emitters[tree.leaf_emitters[k]];
        const Box3 box = emitter_bounds(emitter);
        EXPECT_TRUE(glm::all(glm::lessThanEqual(centre - half, box.lo)));
        EXPECT_TRUE(glm::all(glm::greaterThanEqual(centre + half, box.hi)));
        const NormalCone cone = emission_cone(lights, emitter);
        EXPECT_LE(std::min(2.0f, glm::length(cone.axis - axis) + cone.radius), radius);
        sum += emitter_intensity(lights, tree.leaf_emitters[k]) / lights.local_flux;
      }
      EXPECT_NEAR(node.intensity[c], sum, 1e-4 * sum);
    }
  }
}

TEST(LightTree, BoxesAndConesHoldTheirLeavesAndIntensitiesAdd) {
  expect_nodes_hold_their_leaves<2>(LightWorld(uneven_mix(), {2, true, true}));
  expect_nodes_hold_their_leaves<4>(LightWorld(triangle_cloud(200, 0.3f), {4, true, true}));
  expect_nodes_hold_their_leaves<8>(LightWorld(uneven_mix(), {8, true, true}));
  expect_nodes_hold_their_leaves<16>(LightWorld(punctual_cloud(120), {16, true, true}));
}

TEST(LightTree, LeavesEveryEmitterWithFluxExactlyOnce) {
  const LightWorld world(punctual_cloud(120));
  const LightTreeView tree = world.tree().view();
  std::vector<int> seen(world.lights().emitters.size(), 0);
  for (std::uint32_t leaf = 0; leaf < tree.count; ++leaf) ++seen[tree.leaf_emitters[leaf]];
  for (std::uint32_t e = 0; e < seen.size(); ++e) {
    EXPECT_EQ(seen[e], emitter_flux(world.lights(), e) > 0 ? 1 : 0);
    EXPECT_EQ(tree.emitter_leaves[e] != kNoEmitter, seen[e] == 1);
  }
}

TEST(LightTree, ProbabilitiesSumToOneOrToNothingOnADeadBranch) {
  for (const NamedScene& named : light_scenes()) {
    for (const LightTree::Options& tree_options : kTrees) {
      const LightWorld world(named.scene, tree_options);
      for (const Surface& s : shading_points(60)) {
        double sum = 0;
        for (std::uint32_t e = 0; e < world.lights().emitters.size(); ++e)
          sum += pdf_tree(world.tree().view(), whole_tree(world.tree().view()), s.position, s.normal, e);
        // A dead branch below a live one loses its share, so the sum may fall short, never exceed.
        EXPECT_LE(sum, 1 + 1e-4) << named.name << ", " << name_of(tree_options);
      }
    }
  }
}

TEST(LightTree, WalkReportsThePdfBitForBit) {
  for (const NamedScene& named : light_scenes()) {
    for (const LightTree::Options& tree_options : kTrees) {
      const LightWorld world(named.scene, tree_options);
      Stream random(77);
      for (const Surface& s : shading_points(200)) {
        const vec4 u = random.next();
        const TreeSample sample = sample_tree(world.tree().view(), s.position, s.normal, vec2(u.x, u.y));
        if (sample.emitter == kNoEmitter) continue;
        EXPECT_EQ(sample.pdf, pdf_tree(world.tree().view(), whole_tree(world.tree().view()), s.position, s.normal, sample.emitter))
            << named.name << ", " << name_of(tree_options);
      }
    }
  }
}

TEST(LightTree, FrequenciesFollowThePdf) {
  constexpr int kDraws = 40000;
  for (const NamedScene& named : light_scenes()) {
    for (const LightTree::Options& tree_options : kTrees) {
      const LightWorld world(named.scene, tree_options);
      const LightTreeView tree = world.tree().view();
      const std::size_t n = world.lights().emitters.size();
      Stream random(5);
      for (const Surface& s : shading_points(6, 31)) {
        const double p = walk_p_value(
            kDraws, n, random, [&](vec2 u) { return sample_tree(tree, s.position, s.normal, u); },
            [&](std::uint32_t e) { return pdf_tree(tree, whole_tree(tree), s.position, s.normal, e); });
        // 288 tests in all: 1e-5 each keeps false alarms below one in three hundred.
        EXPECT_GT(p, 1e-5) << named.name << ", " << name_of(tree_options);
      }
    }
  }
}

// Yuksel's weights of up to 16 lights under one node, without cones: cosine bound times intensity, over the squared
// distance to each box unless that is less than the box's diagonal for any light above the horizon.
TEST(LightTree, YukselsWeightsAreTheirFormula) {
  const LightWorld world(triangle_cloud(16, 1.0f, 17), {16, false, true, Weights::kYuksel});
  const LightTreeView tree = world.tree().view();
  const LightView lights = world.lights();
  ASSERT_EQ(tree.levels, 1);
  int near_points = 0, far_points = 0;
  for (const Surface& s : shading_points(400)) {
    std::vector<double> plain(lights.emitters.size()), distance2 = plain;
    bool too_near = false, unclear = false;
    for (std::uint32_t e = 0; e < lights.emitters.size(); ++e) {
      const Box3 box = emitter_bounds(lights.emitters[e]);
      const glm::dvec3 lo(box.lo - s.position), hi(box.hi - s.position), n(s.normal);
      const glm::dvec3 nearest = glm::clamp(glm::dvec3(0), lo, hi);
      const glm::dvec3 top = glm::mix(lo, hi, glm::greaterThan(n, glm::dvec3(0)));
      const double diagonal2 = glm::dot(hi - lo, hi - lo);
      distance2[e] = glm::dot(nearest, nearest);
      const double cosine = std::clamp(glm::dot(top, n) / std::sqrt(std::max(distance2[e], 1e-12)), 0.0, 1.0);
      plain[e] = cosine * static_cast<double>(emitter_intensity(lights, e));
      too_near = too_near || (plain[e] > 0 && distance2[e] < diagonal2);
      unclear = unclear || std::abs(distance2[e] - diagonal2) < 1e-3 * diagonal2 || (cosine > 0 && cosine < 0.02);
    }
    if (unclear) continue;
    ++(too_near ? near_points : far_points);
    double sum = 0;
    for (std::size_t e = 0; e < plain.size(); ++e) sum += too_near ? plain[e] : plain[e] / distance2[e];
    for (std::uint32_t e = 0; e < plain.size(); ++e) {
      const double share = sum > 0 ? (too_near ? plain[e] : plain[e] / distance2[e]) / sum : 0.0;
      EXPECT_NEAR(pdf_tree(tree, whole_tree(tree), s.position, s.normal, e), share, 1e-3 * share + 1e-9);
    }
  }
  EXPECT_GT(near_points, 30);
  EXPECT_GT(far_points, 50);
}

// Property: light that can arrive has positive probability, at points inside and outside boxes and at grazing
// angles.
TEST(LightTree, ContributionImpliesProbability) {
  for (const NamedScene& named : light_scenes()) {
    for (const LightTree::Options& tree_options : kTrees) {
      const LightWorld world(named.scene, tree_options);
      const LightSampler sampler = world.sampler(LightChoice::kTree);
      Stream random(8);
      for (const Surface& s : shading_points(300, 12)) {
        for (std::uint32_t e = 0; e < sampler.lights.emitters.size(); ++e) {
          const vec4 u = random.next();
          const EmitterPoint point =
              sample_emitter_point(sampler.scene, sampler.lights, e, s.position, vec2(u.x, u.y));
          if (!(max_component(point.incident) > 0) || !(glm::dot(point.wi, s.normal) > 1e-5f)) continue;
          ASSERT_GT(pdf_tree(sampler.tree, whole_tree(sampler.tree), s.position, s.normal, e), 0.0f) << named.name << ", emitter " << e;
        }
      }
    }
  }
}

TEST(LightTree, PointsOnALightAreSampledSafely) {
  const Scene scene = punctual_cloud(50);
  const LightWorld world(scene);
  for (const Emitter& emitter : world.lights().emitters) {
    const TreeSample sample = sample_tree(world.tree().view(), emitter.p0, vec3(0, 1, 0), vec2(0.5f, 0.5f));
    EXPECT_TRUE(is_finite(sample.pdf));
  }
}

TEST(LightTree, OneLightIsAlwaysFoundAndNoLightNever) {
  for (const LightTree::Options& tree_options : kTrees) {
    Scene single;
    add_node(single, {add_mesh(single, add_material(single, vec3(1)),
                               {vec3(0, 1, 0), vec3(1, 1, 0), vec3(0, 1, 1)})});
    const LightWorld alone(single, tree_options);
    const TreeSample found = sample_tree(alone.tree().view(), vec3(0), vec3(0, 1, 0), vec2(0.99f, 0));
    EXPECT_EQ(found.emitter, 0u);
    EXPECT_EQ(found.pdf, 1.0f);
    const LightWorld dark(Scene{}, tree_options);
    EXPECT_EQ(sample_tree(dark.tree().view(), vec3(0), vec3(0, 1, 0), vec2(0.5f)).emitter, kNoEmitter);
  }
}

TEST(LightTree, CoincidentLightsShareEqually) {
  Scene scene;
  add_node(scene, {add_mesh(scene, add_material(scene, vec3(0)), {vec3(-1), vec3(1), vec3(1, -1, 1)})});
  for (int i = 0; i < 37; ++i) add_light(scene, {}, vec3(0, 2, 0));
  for (const LightTree::Options& tree_options : kTrees) {
    const LightWorld world(scene, tree_options);
    for (std::uint32_t e = 0; e < 37; ++e)
      EXPECT_NEAR(pdf_tree(world.tree().view(), whole_tree(world.tree().view()), vec3(1, 0, 0), vec3(0, 1, 0), e), 1.0 / 37, 1e-5);
  }
}

TEST(LightTree, SameBitsForAnyThreadCount) {
  const Scene scene = triangle_cloud(20000, 0.01f);
  std::vector<std::vector<std::byte>> nodes;
  for (const std::size_t threads : {1u, 2u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const LightWorld world(scene);
    const LightTreeView tree = world.tree().view();
    nodes.emplace_back(tree.nodes, tree.nodes + (world.tree().bytes() - 8 * std::size_t{tree.count}));
  }
  EXPECT_EQ(nodes[0], nodes[1]);
  EXPECT_EQ(nodes[0], nodes[2]);
}

TEST(LightTree, ScalingTheSceneChangesNoProbability) {
  for (const Weights weights : {Weights::kMinMax, Weights::kYuksel}) {
    constexpr float kScale = 1024;  // a power of two: exact in floating point
    Scene scene = uneven_mix(), scaled = scene;
    for (Mesh& mesh : scaled.meshes)
      for (vec3& p : mesh.positions) p *= kScale;
    for (Node& node : scaled.nodes) node.translation *= kScale;
    for (PunctualLight& light : scaled.lights) light.color *= kScale * kScale;  // as flux of surfaces grows
    const LightTree::Options options{16, true, true, weights};
    const LightWorld a(scene, options), b(scaled, options);
    for (const Surface& s : shading_points(100))
      for (std::uint32_t e = 0; e < a.lights().emitters.size(); ++e)
        EXPECT_EQ(pdf_tree(a.tree().view(), whole_tree(a.tree().view()), s.position, s.normal, e),
                  pdf_tree(b.tree().view(), whole_tree(b.tree().view()), s.position * kScale, s.normal, e));
  }
}

TEST(LightTree, AMillionLightsStayWithinTheirBytesAndAreReachable) {
  const LightWorld world(triangle_cloud(1000000, 0.001f));
  const LightTreeView tree = world.tree().view();
  EXPECT_EQ(tree.count, 1000000u);
  const double bytes =
      static_cast<double>(world.tree().bytes() - 4 * tree.count + tree.count * sizeof(Emitter));
  EXPECT_LE(bytes / tree.count, 80.0);  // without the optional emitter -> leaf table
  Stream random(3);
  for (const Surface& s : shading_points(1000)) {
    const vec4 u = random.next();
    const TreeSample sample = sample_tree(tree, s.position, s.normal, vec2(u.x, u.y));
    if (sample.emitter == kNoEmitter) continue;
    EXPECT_GT(sample.pdf, 0.0f);
    EXPECT_LT(sample.emitter, tree.count);
  }
}

TEST(LightTree, OtherWidthsAreRefused) {
  LightTree tree;
  EXPECT_THROW(tree.build(LightView{}, {3, false, false}), Error);
}

}  // namespace
}  // namespace lumigrove
