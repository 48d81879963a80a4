#include "methods/light_tree/two_level_tree.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>

#include "instance_fixtures.h"
#include "lumigrove/renderer.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

constexpr LightTree::Options kTopTrees[] = {
    {2, false, true}, {4, true, true}, {8, true, true}, {16, true, true}, {2, false, true, Weights::kYuksel},
    {16, true, true, Weights::kYuksel}};

std::string name_of(const NamedScene& scene, const LightTree::Options& tree) {
  return std::string(scene.name) + ", width " + std::to_string(tree.width) +
         (tree.cones ? " with cones" : "") + (tree.weights == Weights::kYuksel ? ", Yuksel's weights" : "");
}

TreeSample draw(const LightSampler& sampler, const Surface& s, Stream& random) {
  const vec4 u = random.next();
  return choose_emitter(sampler, s, vec2(u.x, u.y));
}

// --- probabilities -----------------------------------------------------------------------------------------

TEST(TwoLevelTree, ProbabilitiesNeverExceedOneAndSumToItInsideTheLights) {
  for (const NamedScene& named : instance_scenes()) {
    for (const LightTree::Options& options : kTopTrees) {
      const TwoLevelWorld world(named.scene, options);
      const LightSampler sampler = world.sampler();
      double best = 0;
      for (const Surface& s : shading_points(60)) {
        double sum = 0;
        for (std::uint32_t e = 0; e < sampler.lights.emitters.size(); ++e)
          sum += pdf_choose_emitter(sampler, s, e);
        // A dead branch below a live one loses its share, so the sum may fall short, never exceed.
        EXPECT_LE(sum, 1 + 1e-4) << name_of(named, options);
        best = std::max(best, sum);
      }
      EXPECT_NEAR(best, 1, 1e-4) << name_of(named, options);
    }
  }
}

TEST(TwoLevelTree, WalkReportsThePdfBitForBit) {
  for (const NamedScene& named : instance_scenes()) {
    for (const LightTree::Options& options : kTopTrees) {
      const TwoLevelWorld world(named.scene, options);
      const LightSampler sampler = world.sampler();
      Stream random(77);
      int compared = 0;
      for (const Surface& s : shading_points(300)) {
        const TreeSample sample = draw(sampler, s, random);
        if (sample.emitter == kNoEmitter) continue;
        ASSERT_LT(sample.emitter, sampler.lights.emitters.size());
        EXPECT_EQ(sample.pdf, pdf_choose_emitter(sampler, s, sample.emitter)) << name_of(named, options);
        ++compared;
      }
      EXPECT_GT(compared, 100) << name_of(named, options);
    }
  }
}

TEST(TwoLevelTree, FrequenciesFollowThePdf) {
  constexpr int kDraws = 20000;
  for (const NamedScene& named : instance_scenes()) {
    for (const LightTree::Options& options : kTopTrees) {
      const TwoLevelWorld world(named.scene, options);
      const LightSampler sampler = world.sampler();
      const std::size_t n = sampler.lights.emitters.size();
      Stream random(5);
      for (const Surface& s : shading_points(3, 31)) {
        const double p = walk_p_value(
            kDraws, n, random, [&](vec2 u) { return choose_emitter(sampler, s, u); },
            [&](std::uint32_t e) { return pdf_choose_emitter(sampler, s, e); });
        // 144 tests in all: 1e-5 each keeps false alarms below one in six hundred.
        EXPECT_GT(p, 1e-5) << name_of(named, options);
      }
    }
  }
}

// The walks of a batch, each in another mesh, are those that would be taken one by one.
TEST(TwoLevelTree, BatchesWalkAsSinglePointsDo) {
  const TwoLevelWorld world(with_points(instances_of(40, turn)));
  const LightSampler sampler = world.sampler();
  const std::vector<Surface> surfaces = shading_points(kWalkBatch);
  WalkPoints points;
  Stream random(6), again(6);
  for (int i = 0; i < kWalkBatch; ++i) {
    const vec4 u = random.next();
    points.set(i, surfaces[static_cast<std::size_t>(i)].position,
               surfaces[static_cast<std::size_t>(i)].normal, vec2(u.x, u.y));
  }
  TreeSample samples[kWalkBatch];
  sample_emitters(sampler, {whole_tree(sampler.tree)}, points, kWalkBatch, samples);
  for (int i = 0; i < kWalkBatch; ++i) {
    const TreeSample single = draw(sampler, surfaces[static_cast<std::size_t>(i)], again);
    EXPECT_EQ(samples[i].emitter, single.emitter);
    EXPECT_EQ(samples[i].pdf, single.pdf);
  }
}

// --- unbiased ----------------------------------------------------------------------------------------------

// Property: light that can arrive has positive probability, however the instance is bent and wherever it is.
TEST(TwoLevelTree, ContributionImpliesProbability) {
  std::vector<NamedScene> scenes = instance_scenes();
  const Scene far = instances_of(24, [](Stream& r) { return turn(r) * stretch(vec3(1, 2, 1)); });
  scenes.push_back({"far away", far});
  for (Node& node : scenes.back().scene.nodes) node.matrix[3] += vec4(3000, 0, -2000, 0);
  for (const NamedScene& named : scenes) {
    const vec3 shift = named.name == std::string("far away") ? vec3(3000, 0, -2000) : vec3(0);
    for (const LightTree::Options& options : kTopTrees) {
      const TwoLevelWorld world(named.scene, options);
      const LightSampler sampler = world.sampler();
      Stream random(8);
      for (Surface s : shading_points(100, 12)) {
        s.position += shift;
        for (std::uint32_t e = 0; e < sampler.lights.emitters.size(); ++e) {
          const vec4 u = random.next();
          const EmitterPoint point =
              sample_emitter_point(sampler.scene, sampler.lights, e, s.position, vec2(u.x, u.y));
          if (!(max_component(point.incident) > 0) || !(glm::dot(point.wi, s.normal) > 1e-5f)) continue;
          ASSERT_GT(pdf_choose_emitter(sampler, s, e), 0.0f) << name_of(named, options) << ", emitter " << e;
        }
      }
    }
  }
}

TEST(TwoLevelTree, MeanIsTheExhaustiveSum) {
  constexpr int kDraws = 30000, kRounds = 100;
  for (const NamedScene& named : instance_scenes()) {
    const TwoLevelWorld world(named.scene), yuksel(named.scene, {16, true, true, Weights::kYuksel});
    const LightSampler sampler = world.sampler(), by_yuksel = yuksel.sampler();
    Stream random(21);
    for (const Surface& s : shading_points(4, 43)) {
      LightSampler every = sampler;
      every.choice = LightChoice::kOne;
      RunningMean truth;
      for (int i = 0; i < kRounds; ++i) {
        double sum = 0;
        for (every.one = 0; every.one < light_count(every.lights); ++every.one)
          sum += sample_value(sample_light(every, s, random.next()), s);
        truth.add(sum);
      }
      for (const LightSampler* by_tree : {&sampler, &by_yuksel}) {
        RunningMean mean;
        for (int i = 0; i < kDraws; ++i) mean.add(sample_value(sample_light(*by_tree, s, random.next()), s));
        const double error = std::hypot(mean.standard_error(), truth.standard_error());
        // 64 comparisons: 4.5 standard errors keep false alarms below one in a thousand.
        EXPECT_NEAR(mean.mean(), truth.mean(), 4.5 * error + 1e-6 * truth.mean()) << named.name;
      }
    }
  }
}

TEST(TwoLevelTree, RendersTheImageOfTheSingleTreeWithAndWithoutMis) {
  Scene scene = with_points(instances_of(12, [](Stream& r) { return turn(r) * stretch(vec3(-1, 2, 0.5f)); }));
  add_node(scene, {add_mesh(scene, add_material(scene, vec3(0)),
                            {vec3(-20, -7, -20), vec3(-20, -7, 20), vec3(20, -7, 20), vec3(-20, -7, -20),
                             vec3(20, -7, 20), vec3(20, -7, -20)})});
  Settings settings = make_preset("tree");
  settings.width = settings.height = 24;
  settings.spp = 64;
  settings.view = ViewSettings{vec3(0, 12, 16), vec3(0, -4, 0), vec3(0, 1, 0)};
  const auto total = [&](Hierarchy hierarchy, bool mis) {
    settings.direct.hierarchy = hierarchy;
    settings.direct.mis = mis;
    const Image image = render(scene, settings);
    double sum = 0;
    for (const float v : image.find("direct")->values) sum += static_cast<double>(v);
    return sum;
  };
  const double single = total(Hierarchy::kPerfect, false);
  EXPECT_GT(single, 0);
  EXPECT_NEAR(total(Hierarchy::kTwoLevel, false) / single, 1, 0.02);
  EXPECT_NEAR(total(Hierarchy::kTwoLevel, true) / single, 1, 0.02);
}

// --- structure ---------------------------------------------------------------------------------------------

void expect_same_bits(const TwoLevelWorld& a, const TwoLevelWorld& b) {
  const LightTreeView x = a.tree().top().view(), y = b.tree().top().view();
  ASSERT_EQ(x.count, y.count);
  ASSERT_EQ(a.tree().top().bytes(), b.tree().top().bytes());
  const std::size_t nodes = a.tree().top().bytes() - 4 * x.count;
  EXPECT_EQ(std::memcmp(x.nodes, y.nodes,
                        nodes - 4 * (a.tree().view().punctual_first + a.lights().punctual.size())),
            0);
  const LightSampler sa = a.sampler(), sb = b.sampler();
  Stream ra(3), rb(3);
  for (const Surface& s : shading_points(500)) {
    const TreeSample one = draw(sa, s, ra), other = draw(sb, s, rb);
    EXPECT_EQ(one.emitter, other.emitter);
    EXPECT_EQ(one.pdf, other.pdf);
  }
}

TEST(TwoLevelTree, MovingAnInstanceRebuildsTheTopLevelOnly) {
  TwoLevelWorld world(with_points(instances_of(40, turn)));
  EXPECT_EQ(world.tree().meshes_built(), 4);
  Stream random(4);
  for (int frame = 0; frame < 3; ++frame) {
    for (Node& node : world.scene().nodes) node.matrix[3] += vec4(random.direction(), 0);
    world.scene().nodes[7].matrix = world.scene().nodes[7].matrix * stretch(vec3(-1, 2, 1));
    world.update();
    EXPECT_EQ(world.tree().meshes_built(), 4);
    expect_same_bits(world, TwoLevelWorld(world.scene()));
  }
}

TEST(TwoLevelTree, SharedMeshesAreStoredOnce) {
  const TwoLevelWorld few(instances_of(4, turn)), many(instances_of(400, turn));
  EXPECT_EQ(few.tree().mesh_bytes(), many.tree().mesh_bytes());
  EXPECT_EQ(many.tree().meshes_built(), 4);
  EXPECT_EQ(many.tree().top().view().count, 400u);
}

TEST(TwoLevelTree, SameBitsForAnyThreadCount) {
  Scene scene = instances_of(3000, [](Stream& r) { return turn(r) * stretch(vec3(1, 0.5f, 2)); });
  std::vector<vec3> large;
  Stream random(9);
  for (int i = 0; i < 20000; ++i)
    add_triangle_of_size(large, random, random.in_box(vec3(-1), vec3(1)), 0.01f);
  add_node(scene, {add_mesh(scene, add_material(scene, vec3(1)), large)});
  std::vector<std::unique_ptr<TwoLevelWorld>> worlds;
  for (const std::size_t threads : {1u, 2u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    worlds.push_back(std::make_unique<TwoLevelWorld>(scene));
  }
  expect_same_bits(*worlds[0], *worlds[1]);
  expect_same_bits(*worlds[0], *worlds[2]);
}

TEST(TwoLevelTree, ScalingTheSceneChangesNoProbability) {
  constexpr float kScale = 1024;  // a power of two: exact in floating point
  const Scene scene =
      with_points(instances_of(24, [](Stream& r) { return turn(r) * stretch(vec3(1, -2, 1)); }));
  Scene scaled = scene;  // the meshes stay, their instances grow
  for (Node& node : scaled.nodes) {
    node.translation *= kScale;
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 3; ++r) node.matrix[c][r] *= kScale;
  }
  for (PunctualLight& light : scaled.lights) light.color *= kScale * kScale;  // as flux of surfaces grows
  const TwoLevelWorld a(scene), b(scaled);
  for (Surface s : shading_points(100)) {
    Surface t = s;
    t.position *= kScale;
    for (std::uint32_t e = 0; e < a.lights().emitters.size(); ++e)
      EXPECT_EQ(pdf_choose_emitter(a.sampler(), s, e), pdf_choose_emitter(b.sampler(), t, e));
  }
}

// Where instances keep shapes, a triangle's share of its mesh at x is its share of the unmoved mesh at x'.
TEST(TwoLevelTree, SharesWithinAMeshDoNotDependOnTheInstanceUnderUniformScale) {
  constexpr LightTree::Options kNoCones{2, false,
                                        true};  // these are widened by the quantisation of a turned axis
  const vec3 moved(5, 6, 7);
  Scene still, placed;
  add_shared_meshes(still);
  placed = still;
  add_node(still, {1});
  Node& node = add_node(placed, {1});
  node.translation = moved;
  node.scale = vec3(-4);  // also mirrors
  const TwoLevelWorld a(still, kNoCones), b(placed, kNoCones);
  for (const Surface& s : shading_points(50)) {
    Surface t = s;
    t.position = s.position * -4.0f + moved;
    t.normal = -s.normal;
    for (std::uint32_t e = 0; e < a.lights().emitters.size(); ++e) {
      const float p = pdf_choose_emitter(a.sampler(), s, e), q = pdf_choose_emitter(b.sampler(), t, e);
      EXPECT_NEAR(p, q, 1e-3f * q + 1e-6f);
    }
  }
}

// Intensities of the top level add to those of all emitters, exactly where shapes are kept and for flat meshes.
TEST(TwoLevelTree, InstancesWeighAsTheEmittersTheyShow) {
  std::vector<NamedScene> scenes = instance_scenes();
  std::erase_if(scenes, [](const NamedScene& s) {
    return s.name == std::string("stretched") || s.name == std::string("sheared") ||
           s.name == std::string("flattened");
  });
  Scene flat;
  add_shared_meshes(flat);
  Node& panel = add_node(flat, {3});  // textured, in a plane
  panel.has_matrix = true;
  panel.matrix = shear() * stretch(vec3(3, 1, 0.2f));
  scenes.push_back({"flat", flat});
  for (const NamedScene& named : scenes) {
    const TwoLevelWorld world(named.scene);
    const LightView lights = world.lights();
    double total = 0, exact = 0;
    const LightTreeView top = world.tree().top().view();
    for (const float intensity : top.level<16>(0)->intensity) total += intensity;
    for (std::uint32_t e = 0; e < lights.emitters.size(); ++e)
      exact += emitter_intensity(lights, e) / lights.local_flux;
    EXPECT_NEAR(total, exact, 1e-3 * exact) << named.name;
  }
}

TEST(TwoLevelTree, NothingShinesInADarkScene) {
  const TwoLevelWorld world{Scene{}};
  Stream random(1);
  EXPECT_EQ(draw(world.sampler(), surface_at(vec3(0), vec3(0, 1, 0)), random).emitter, kNoEmitter);
  Scene one;
  add_shared_meshes(one);
  add_node(one, {2}).translation = vec3(0, 3, 0);
  const TwoLevelWorld alone(one);
  const TreeSample found = draw(alone.sampler(), surface_at(vec3(0, 8, 0), vec3(0, -1, 0)), random);
  EXPECT_EQ(found.emitter, 0u);
  EXPECT_EQ(found.pdf, 1.0f);
}

}  // namespace
}  // namespace lumigrove
