#include "methods/light_sampling/light_sampler_kernel.h"

#include <gtest/gtest.h>

#include "light_fixtures.h"
#include "methods/light_sampling/direct_lighting_kernel.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

// The exhaustive sum: every light in turn, many points on each.
RunningMean exhaustive(LightSampler sampler, const Surface& s, int rounds, Stream& random) {
  RunningMean mean;
  sampler.choice = LightChoice::kOne;
  for (int i = 0; i < rounds; ++i) {
    double sum = 0;
    for (sampler.one = 0; sampler.one < light_count(sampler.lights); ++sampler.one)
      sum += sample_value(sample_light(sampler, s, random.next()), s);
    mean.add(sum);
  }
  return mean;
}

TEST(AliasTable, FrequenciesFollowTheWeightsAndZeroIsNeverDrawn) {
  const std::vector<float> weights{0, 1, 2, 0, 0.001f, 5, 0, 1e-6f, 3, 0};
  AliasTable table;
  table.build(weights);
  std::vector<double> observed(weights.size(), 0), expected;
  constexpr int kDraws = 200000;
  for (const float w : weights) expected.push_back(kDraws * static_cast<double>(table.view().pdf(w)));
  Stream random(1);
  for (int i = 0; i < kDraws; ++i) {
    const vec4 u = random.next();
    ++observed[sample_alias(table.view(), u.x, u.y)];
  }
  EXPECT_GT(chi_square_p_value(observed, expected), 1e-4);
}

TEST(AliasTable, AllZeroHasNoTotal) {
  AliasTable table;
  table.build(std::vector<float>(5, 0.0f));
  EXPECT_EQ(table.view().total, 0.0f);
}

// Uniform, power, tree and light BVH against the exhaustive sum on four scenes, points inside and outside of boxes.
TEST(LightSampler, MeanOfEverySelectionIsTheExhaustiveSum) {
  constexpr int kDraws = 60000;
  for (const NamedScene& named : light_scenes()) {
    const LightWorld world(named.scene), yuksel(named.scene, {16, true, true, Weights::kYuksel});
    Stream random(21);
    for (const Surface& s : shading_points(5, 43)) {
      const RunningMean truth = exhaustive(world.sampler(LightChoice::kUniform), s, 300, random);
      std::vector<LightSampler> samplers{yuksel.sampler(LightChoice::kTree)};
      for (const LightChoice choice : {LightChoice::kUniform, LightChoice::kPower, LightChoice::kTree, LightChoice::kBvh})
        samplers.push_back(world.sampler(choice));
      for (const LightSampler& sampler : samplers) {
        RunningMean mean;
        for (int i = 0; i < kDraws; ++i) mean.add(sample_value(sample_light(sampler, s, random.next()), s));
        const double error = std::hypot(mean.standard_error(), truth.standard_error());
        // 100 comparisons: 4.5 standard errors keep false alarms below one in a thousand.
        EXPECT_NEAR(mean.mean(), truth.mean(), 4.5 * error + 1e-6 * truth.mean())
            << named.name << ", choice " << static_cast<int>(sampler.choice);
      }
    }
  }
}

// The density of a drawn point, asked for again, is the one it was drawn with.
TEST(LightSampler, PdfOfASampleIsTheSamplePdf) {
  for (const NamedScene& named : light_scenes()) {
    const LightWorld world(named.scene);
    for (const LightChoice choice : {LightChoice::kUniform, LightChoice::kPower, LightChoice::kTree, LightChoice::kBvh}) {
      const LightSampler sampler = world.sampler(choice);
      Stream random(4);
      int compared = 0;
      for (const Surface& s : shading_points(400, 7)) {
        const LightSample sample = sample_light(sampler, s, random.next());
        if (!(sample.pdf > 0)) continue;
        const float pdf = sample.emitter == kNoEmitter ? pdf_light_environment(sampler, s, sample.wi)
                                                       : pdf_light(sampler, s, sample.emitter,
                                                                   s.position + sample.wi * sample.distance);
        EXPECT_NEAR(pdf / sample.pdf, 1, 0.02) << named.name;  // the point was rounded on the way
        ++compared;
      }
      if (!world.lights().emitters.empty() && named.name != std::string("punctual cloud")) {
        EXPECT_GT(compared, 20) << named.name;
      }
    }
  }
}

// 0 to 3 directional lights beside 0 or many local ones, with and without a sky: frequencies of the groups
// follow their probabilities, and nothing that shines is left out.
TEST(LightSampler, GroupsAreChosenWithTheirProbabilities) {
  for (int suns = 0; suns <= 3; ++suns) {
    for (const bool local : {false, true}) {
      for (const bool sky : {false, true}) {
        Scene scene = local ? triangle_cloud(40, 0.3f) : Scene{};
        if (!local)
          add_node(scene,
                   {add_mesh(scene, add_material(scene, vec3(0)), {vec3(-5), vec3(5, -5, -5), vec3(5)})});
        for (int i = 0; i < suns; ++i) {
          PunctualLight sun;
          sun.type = LightType::kDirectional;
          sun.color = vec3(static_cast<float>(i + 1));
          add_light(scene, sun, vec3(0));
          const float half = 0.5f * static_cast<float>(i);
          scene.nodes.back().rotation = vec4(-std::sin(0.785398f + half), 0, 0, std::cos(0.785398f + half));
        }
        if (sky) scene.environment.radiance = vec3(0.5f);
        const LightWorld world(scene);
        const LightSampler sampler = world.sampler(LightChoice::kTree);
        const Surface s = surface_at(vec3(0.5f), vec3(0, 1, 0));
        const GroupProbabilities p = group_probabilities(sampler, s);
        const double total = p.local + p.directional + p.environment;
        if (!local && suns == 0 && !sky) {
          EXPECT_EQ(total, 0);
          continue;
        }
        EXPECT_NEAR(total, 1, 1e-6);
        EXPECT_EQ(p.local > 0, local);
        EXPECT_EQ(p.directional > 0, suns > 0);
        EXPECT_EQ(p.environment > 0, sky);
        Stream random(6);
        constexpr int kDraws = 20000;
        std::vector<double> observed(3, 0), expected{kDraws * double{p.local}, kDraws * double{p.directional},
                                                     kDraws * double{p.environment}};
        for (int i = 0; i < kDraws; ++i) {
          const LightSample sample = sample_light(sampler, s, random.next());
          if (sample.distance == kInfinity && sample.pdf == 0)
            ++observed[1];
          else if (sample.distance == kInfinity)
            ++observed[2];
          else
            ++observed[0];
        }
        EXPECT_GT(chi_square_p_value(observed, expected), 1e-4)
            << suns << " suns, local " << local << ", sky " << sky;
      }
    }
  }
}

// Noise must not depend on how finely an emitter is meshed: one quad of 2 and one of 2000 triangles, equal
// power.
TEST(LightSampler, VarianceDoesNotDependOnTheNumberOfTriangles) {
  const auto quad = [](int cells) {
    std::vector<vec3> corners;
    for (int i = 0; i < cells; ++i)
      for (int j = 0; j < cells; ++j) {
        const auto at = [&](int a, int b) {
          return vec3(static_cast<float>(a) / static_cast<float>(cells) - 0.5f, 0,
                      static_cast<float>(b) / static_cast<float>(cells) - 0.5f);
        };
        corners.insert(corners.end(),
                       {at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
      }
    return corners;
  };
  Scene scene;
  const int material = add_material(scene, vec3(1));
  const int coarse = add_mesh(scene, material, quad(1)), fine = add_mesh(scene, material, quad(32));
  add_node(scene, {coarse}).translation = vec3(-10, 3, 0);
  add_node(scene, {fine}).translation = vec3(10, 3, 0);
  const LightWorld world(scene);
  for (const LightChoice choice : {LightChoice::kPower, LightChoice::kTree}) {
    const LightSampler sampler = world.sampler(choice);
    double variance[2];  // relative
    for (int side = 0; side < 2; ++side) {
      const Surface s = surface_at(vec3(side == 0 ? -10.0f : 10.0f, 0, 0), vec3(0, 1, 0));
      Stream random(11);
      RunningMean mean;
      for (int i = 0; i < 100000; ++i) mean.add(sample_value(sample_light(sampler, s, random.next()), s));
      variance[side] = mean.variance() / (mean.mean() * mean.mean());
    }
    // By power the points drawn are the same. The tree chooses among 2000 triangles by bounds, which is not free: one
    // box at the top holds the coarse quad and an eighth of the fine one.
    if (choice == LightChoice::kPower) {
      EXPECT_LT(variance[1], 1.1 * variance[0]);
    } else {
      EXPECT_LT(variance[1], 0.25);
    }
  }
}

// Walks that go down together end where each would alone.
TEST(DirectLightKernel, BatchesOfWalksMatchSingleSamples) {
  const LightWorld world(far_clusters_under_a_sky());
  std::vector<Surface> surfaces = shading_points(150);
  for (std::size_t i = 0; i < 150; i += 7) surfaces[i].instance = kNoId;
  std::vector<std::uint32_t> pixels(150);
  for (std::uint32_t i = 0; i < 150; ++i) pixels[i] = 1000 + i;
  std::vector<Ray> shadow(150);
  std::vector<vec3> contribution(150);
  const Rng rng{5, 6, 0};
  for (const LightChoice choice : {LightChoice::kTree, LightChoice::kBvh}) {
    const LightSampler sampler = world.sampler(choice);
    const DirectLightKernel kernel{sampler, rng, kDimLight, 1, false, surfaces, pixels, shadow, contribution};
    for (int batch = 0; batch < walk_batches(150); ++batch) kernel(batch);
    int lit = 0;
    for (std::size_t i = 0; i < 150; ++i) {
      vec3 expected(0);
      if (surfaces[i].instance != kNoId) {
        const vec4 u = Rng{rng.seed, rng.frame, pixels[i]}.uniform4(kDimLight);
        const LightSample sample = sample_light(sampler, surfaces[i], u);
        const float cosine = glm::dot(surfaces[i].normal, sample.wi);
        if (max_component(sample.weight) > 0 && cosine > 0)
          expected = bsdf_eval(surfaces[i], sample.wi) * sample.weight * cosine;
      }
      // Grazing cosines lose digits, and lanes round otherwise than single numbers.
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(contribution[i][c], expected[c], 1e-4f * expected[c]) << i;
      lit += max_component(contribution[i]) > 0;
    }
    EXPECT_GT(lit, 40);
  }
}

TEST(DirectLightKernel, MarksRaysThatCarryNothingAsUntraced) {
  const LightWorld world(triangle_cloud(100, 0.3f));
  std::vector<Surface> surfaces = shading_points(200);
  for (std::size_t i = 0; i < 50; ++i) surfaces[i].instance = kNoId;
  std::vector<std::uint32_t> pixels(200);
  for (std::uint32_t i = 0; i < 200; ++i) pixels[i] = i;
  std::vector<Ray> shadow(200);
  std::vector<vec3> contribution(200);
  const DirectLightKernel kernel{world.sampler(LightChoice::kUniform),
                                 {1, 0, 0},
                                 kDimLight,
                                 1,
                                 false,
                                 surfaces,
                                 pixels,
                                 shadow,
                                 contribution};
  for (int batch = 0; batch < walk_batches(200); ++batch) kernel(batch);
  int traced = 0;
  for (std::size_t k = 0; k < 200; ++k) {
    EXPECT_EQ(shadow[k].tmax >= shadow[k].tmin, max_component(contribution[k]) > 0);
    traced += shadow[k].tmax >= shadow[k].tmin;
    if (k < 50) {
      EXPECT_EQ(contribution[k], vec3(0));
    }
  }
  EXPECT_GT(traced, 20);
}

}  // namespace
}  // namespace lumigrove
