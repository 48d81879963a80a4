// Virtual point lights as emitters: light trees over them, alone and jointly with the emitters of a scene.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "frame/frame.h"
#include "light_scenes.h"
#include "lights/vpl_light_set.h"
#include "lumigrove/error.h"
#include "methods/light_bvh/light_bvh.h"
#include "methods/light_sampling/direct_lighting_kernel.h"
#include "methods/vpl_sampling/vpl_sampler_kernel.h"
#include "substitute_fixtures.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

constexpr float kClamp = 0.2f;  // 1/m^2; reached by lights nearer than 2.2 m

// A set of lights, and all that chooses among them.
class VplLights {
 public:
  VplLights(std::vector<Vpl> vpls, int width, bool cones, LightBvh::Options bvh) : vpls_(std::move(vpls)) {
    const float floor = bvh.floor;
    Box3 bounds;
    for (const Vpl& vpl : vpls_) bounds = unite(bounds, vpl.position);
    set_.gather({vpls_, bounds, 10}, kClamp);
    tree_.build(set_.view(), {width, cones, true, cones ? Weights::kMinMax : Weights::kYuksel, floor});
    bvh_.build(set_.view(), bvh);
    std::vector<float> flux;
    for (std::uint32_t i = 0; i < vpls_.size(); ++i) flux.push_back(emitter_flux(set_.view(), i));
    alias_.build(flux);
  }
  VplLights(const VplLights&) = delete;
  VplLights& operator=(const VplLights&) = delete;

  const std::vector<Vpl>& vpls() const { return vpls_; }
  LightView lights() const { return set_.view(); }
  LightSampler sampler(LightChoice choice) const {
    LightSampler sampler;
    sampler.lights = set_.view();
    sampler.choice = choice;
    sampler.alias = alias_.view();
    sampler.tree = tree_.view();
    sampler.bvh = bvh_.view();
    return sampler;
  }

 private:
  std::vector<Vpl> vpls_;
  VplLightSet set_;
  LightTree tree_;
  LightBvh bvh_;
  AliasTable alias_;
};

struct TreeKind {
  int width;
  bool cones;
  LightBvh::Options bvh;
};
std::vector<TreeKind> tree_kinds() {
  return {{2, false, {Hierarchy::kSaoh, Weights::kSaoh, true}},
          {16, true, {Hierarchy::kAgglomerative, Weights::kMinMax, true, 0.7f}},
          {8, true, {Hierarchy::kSaoh, Weights::kSaoh, true, 3}},
          {4, true, {Hierarchy::kSaoh, Weights::kYuksel, false, 20}}};  // wider than all
}

// What one light sends to the viewer, by the code of virtual point lights.
vec3 sent_by(const Vpl& vpl, const Surface& s) { return vpl_light(s, exact_vpl(vpl, 1), kClamp, Lobes::kBoth); }

TEST(VplLightTree, EmittersSayWhatTheirLightsAre) {
  const VplLights world(one_bright(90).vpls, 16, true, {});
  const LightView lights = world.lights();
  double flux = 0;
  for (std::uint32_t i = 0; i < 90; ++i) {
    const Vpl& vpl = world.vpls()[i];
    const Emitter& e = lights.emitters[i];
    EXPECT_TRUE(e.vpl());
    EXPECT_FALSE(e.triangle() || e.punctual());
    EXPECT_EQ(e.index(), i);
    EXPECT_EQ(emitter_intensity(lights, i), luminance(vpl.intensity));
    EXPECT_FLOAT_EQ(emitter_flux(lights, i), kPi * luminance(vpl.intensity));
    EXPECT_EQ(emitter_bounds(e).lo, vpl.position);
    EXPECT_EQ(emitter_bounds(e).hi, vpl.position);
    EXPECT_EQ(emission_cone(lights, e).axis, vpl.normal);
    EXPECT_EQ(emission_cone(lights, e).radius, 0);
    flux += static_cast<double>(emitter_flux(lights, i));
  }
  EXPECT_NEAR(static_cast<double>(lights.local_flux) / flux, 1, 1e-5);
  EXPECT_EQ(sizeof(Emitter), 40u);
}

// The same light and the same shadow segment as vpl_light and vpl_shadow_ray give.
TEST(VplLightTree, ALightSendsWhatTheSubstituteTreesLightsSend) {
  int clamped = 0;
  for (const NamedVpls& named : {cloud(150), flat_plane(120), coincident(20)}) {
    const VplLights world(named.vpls, 16, true, {});
    LightSampler sampler = world.sampler(LightChoice::kOne);
    int lit = 0;
    for (Surface& s : walk_surfaces(120)) {
      s.epsilon = 1e-4f;
      for (sampler.one = 0; sampler.one < world.vpls().size(); ++sampler.one) {
        const Vpl& vpl = world.vpls()[sampler.one];
        const LightSample sample = sample_light(sampler, s, vec4(0.5f));
        const vec3 expected = sent_by(vpl, s), found = unoccluded_light(s, sample);
        for (int c = 0; c < 3; ++c) ASSERT_NEAR(found[c], expected[c], 1e-4f * expected[c] + 1e-9f) << named.name;
        if (!(max_component(expected) > 0)) continue;
        ++lit;
        const float d2 = length_squared(vpl.position - s.position);
        clamped += glm::dot(s.position - vpl.position, vpl.normal) > kClamp * d2 * glm::sqrt(d2);
        const Ray there = shadow_ray(s, sample, 10), back = vpl_shadow_ray(s, exact_vpl(vpl, 1));
        EXPECT_EQ(there.tmax, 1);
        EXPECT_LT(glm::length(there.origin + there.direction - back.origin), 1e-4f);
        EXPECT_LT(glm::length(back.origin + back.direction - there.origin), 1e-4f);
      }
    }
    EXPECT_GT(lit, 300) << named.name;
  }
  EXPECT_GT(clamped, 10);
}

TEST(VplLightTree, EveryLightThatContributesHasAProbabilityAndTheyAddUp) {
  for (const NamedVpls& named : vpl_sets())
    for (const TreeKind& kind : tree_kinds()) {
      const VplLights world(named.vpls, kind.width, kind.cones, kind.bvh);
      for (const LightChoice choice : {LightChoice::kTree, LightChoice::kBvh}) {
        const LightSampler sampler = world.sampler(choice);
        for (const Surface& s : walk_surfaces(48)) {
          double sum = 0;
          for (std::uint32_t e = 0; e < world.vpls().size(); ++e) {
            const float pdf = pdf_choose_emitter(sampler, s, e);
            sum += static_cast<double>(pdf);
            if (max_component(sent_by(world.vpls()[e], s)) > 0) {
              ASSERT_GT(pdf, 0) << named.name << " light " << e;
            }
          }
          EXPECT_LT(sum, 1 + 1e-4) << named.name;
        }
      }
    }
}

TEST(VplLightTree, FrequenciesFollowTheProbabilities) {
  constexpr int kDraws = 20000;
  for (const NamedVpls& named : {cloud(150), two_walls(100), one_bright(90)})
    for (const TreeKind& kind : tree_kinds()) {
      const VplLights world(named.vpls, kind.width, kind.cones, kind.bvh);
      for (const LightChoice choice : {LightChoice::kTree, LightChoice::kBvh}) {
        const LightSampler sampler = world.sampler(choice);
        Stream random(51);
        for (const Surface& s : walk_surfaces(2, 52)) {
          std::vector<double> observed(world.vpls().size() + 1, 0), expected;
          double sum = 0;
          for (std::uint32_t e = 0; e < world.vpls().size(); ++e) {
            const auto pdf = static_cast<double>(pdf_choose_emitter(sampler, s, e));
            expected.push_back(kDraws * pdf);
            sum += pdf;
          }
          expected.push_back(kDraws * std::max(0.0, 1 - sum));  // dead branches
          for (int i = 0; i < kDraws; ++i) {
            const vec4 u = random.next();
            const TreeSample sample = choose_emitter(sampler, s, vec2(u.x, u.y));
            ++observed[sample.pdf > 0 ? sample.emitter : world.vpls().size()];
            if (!(sample.pdf > 0)) continue;
            EXPECT_NEAR(pdf_choose_emitter(sampler, s, sample.emitter) / sample.pdf, 1, 1e-4) << named.name;
          }
          // 48 comparisons.
          EXPECT_GT(chi_square_p_value(observed, expected), 1e-5) << named.name;
        }
      }
    }
}

TEST(VplLightTree, MeanOfEverySelectionIsTheSumOfAll) {
  constexpr int kDraws = 20000;
  for (const NamedVpls& named : {cloud(150), flat_plane(120), two_walls(100)})
    for (const TreeKind& kind : tree_kinds()) {
      const VplLights world(named.vpls, kind.width, kind.cones, kind.bvh);
      Stream random(53);
      for (const Surface& s : walk_surfaces(3, 54)) {
        double truth = 0;
        for (const Vpl& vpl : world.vpls()) truth += static_cast<double>(luminance(sent_by(vpl, s)));
        for (const LightChoice choice :
             {LightChoice::kUniform, LightChoice::kPower, LightChoice::kTree, LightChoice::kBvh}) {
          const LightSampler sampler = world.sampler(choice);
          RunningMean mean;
          for (int i = 0; i < kDraws; ++i)
            mean.add(static_cast<double>(luminance(unoccluded_light(s, sample_light(sampler, s, random.next())))));
          // 144 comparisons.
          EXPECT_TRUE(mean_within(mean, truth, 4.9, 1e-4 * truth)) << named.name << ", " << static_cast<int>(choice);
        }
      }
    }
}

// --- many at once ------------------------------------------------------------------------------------------------

// Emitters of a scene and virtual point lights behind them.
class JointLights {
 public:
  JointLights() : scene_(far_clusters_under_a_sky()), vpls_(cloud(200).vpls) {
    Box3 bounds;
    for (const Vpl& vpl : vpls_) bounds = unite(bounds, vpl.position);
    set_.gather_behind(scene_.lights(), {vpls_, bounds, 10}, kClamp);
    tree_.build(set_.view(), kTree);
    bvh_.build(set_.view(), {Hierarchy::kSaoh, Weights::kSaoh, true});
  }
  const LightWorld& scene() const { return scene_; }
  LightView lights() const { return set_.view(); }
  LightSampler sampler(LightChoice choice) const {
    LightSampler sampler = scene_.sampler(LightChoice::kUniform);
    sampler.choice = choice;
    sampler.lights = set_.view();
    sampler.tree = tree_.view();
    sampler.bvh = bvh_.view();
    return sampler;
  }

 private:
  LightWorld scene_;
  std::vector<Vpl> vpls_;
  VplLightSet set_;
  LightTree tree_;
  LightBvh bvh_;
};

TEST(JointLightTree, EmittersKeepTheirNumbersAndFluxAddsUp) {
  const JointLights joint;
  const LightView before = joint.scene().lights(), after = joint.lights();
  ASSERT_EQ(after.emitters.size(), before.emitters.size() + 200);
  EXPECT_EQ(std::memcmp(after.emitters.data(), before.emitters.data(), before.emitters.size_bytes()), 0);
  double flux = static_cast<double>(before.local_flux);
  for (std::size_t e = before.emitters.size(); e < after.emitters.size(); ++e) {
    EXPECT_TRUE(after.emitters[e].vpl());
    flux += static_cast<double>(emitter_flux(after, static_cast<std::uint32_t>(e)));
  }
  EXPECT_NEAR(static_cast<double>(after.local_flux) / flux, 1, 1e-5);
  EXPECT_EQ(after.directional.size(), before.directional.size());
  EXPECT_EQ(after.environment_flux, before.environment_flux);
}

// Triangles, virtual point lights and lights at infinity that batches choose: as each alone, and told apart.
TEST(JointLightTree, BatchesMatchSingleSamplesAndTellTheirKinds) {
  const JointLights joint;
  constexpr std::size_t kCount = 300;
  std::vector<Surface> surfaces = walk_surfaces(kCount);
  for (std::size_t i = 0; i < kCount; i += 7) surfaces[i].instance = kNoId;
  std::vector<std::uint32_t> pixels(kCount);
  for (std::uint32_t i = 0; i < kCount; ++i) pixels[i] = 1000 + i;
  std::vector<Ray> shadow(kCount);
  std::vector<vec3> contribution(kCount);
  std::vector<std::uint8_t> from_vpl(kCount);
  const Rng rng{5, 6, 0};
  for (const LightChoice choice : {LightChoice::kUniform, LightChoice::kTree, LightChoice::kBvh})
    for (const bool gloss : {false, true}) {
      LightSampler sampler = joint.sampler(choice);
      sampler.vpl_gloss = gloss;
      sampler.vpl_mirror_roughness = 0.1f;
      const DirectLightKernel kernel{sampler, rng,    kDimLight,    1,  false, surfaces, pixels,
                                     shadow,  contribution, {}, {},    {},       from_vpl};
      for (int batch = 0; batch < walk_batches(kCount); ++batch) kernel(batch);
      int vpls = 0, others = 0;
      for (std::size_t i = 0; i < kCount; ++i) {
        if (surfaces[i].instance == kNoId) {
          EXPECT_EQ(contribution[i], vec3(0));
          continue;
        }
        const vec4 u = Rng{rng.seed, rng.frame, pixels[i]}.uniform4(kDimLight);
        const LightSample sample = sample_light(sampler, surfaces[i], u);
        const vec3 expected = unoccluded_light(surfaces[i], sample);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(contribution[i][c], expected[c], 2e-4f * expected[c]) << i;
        if (!(max_component(contribution[i]) > 0)) continue;
        EXPECT_EQ(from_vpl[i] != 0, sample.from_vpl);
        ++(sample.from_vpl ? vpls : others);
        const Ray ray = shadow_ray(surfaces[i], sample, joint.lights().diagonal);
        EXPECT_LT(glm::length(shadow[i].direction * shadow[i].tmax - ray.direction * ray.tmax),
                  1e-3f * glm::length(ray.direction))
            << i;
      }
      EXPECT_GT(vpls, choice == LightChoice::kUniform ? 5 : 20);
      EXPECT_GT(others, 20);
    }
}

TEST(VplLightTree, GlossIsLitAsAskedFor) {
  const VplLights world(cloud(150).vpls, 16, true, {});
  LightSampler sampler = world.sampler(LightChoice::kOne);
  int differ = 0;
  for (const Surface& s : walk_surfaces(60)) {
    for (sampler.one = 0; sampler.one < 150; sampler.one += 7) {
      const Vpl& vpl = world.vpls()[sampler.one];
      for (const bool gloss : {false, true}) {
        for (const float mirror_roughness : {0.0f, 0.3f}) {
          sampler.vpl_gloss = gloss;
          sampler.vpl_mirror_roughness = mirror_roughness;
          const bool both = gloss && s.roughness > mirror_roughness;
          const vec3 expected = vpl_light(s, exact_vpl(vpl, 1), kClamp, both ? Lobes::kBoth : Lobes::kDiffuse);
          const vec3 found = unoccluded_light(s, sample_light(sampler, s, vec4(0.5f)));
          for (int c = 0; c < 3; ++c) ASSERT_NEAR(found[c], expected[c], 1e-4f * expected[c]);
          differ += both && expected != vpl_light(s, exact_vpl(vpl, 1), kClamp, Lobes::kDiffuse);
        }
      }
    }
  }
  EXPECT_GT(differ, 20);
}

// --- frames ------------------------------------------------------------------------------------------------------

// A room with a glossy floor, a box, lamps of several kinds and some sky through a window.
Scene room_of_lamps() {
  SceneBuilder b;
  b.room(vec3(-2, 0, -2), vec3(2, 3, 2), b.material(vec3(0.7f, 0.6f, 0.5f)));
  b.quad(vec3(-2, 0.01f, -2), vec3(0, 0, 4), vec3(4, 0, 0), b.material(vec3(0.5f), vec3(0), 0.3f, 0.5f));
  b.room(vec3(1, 1, 0.5f), vec3(0.2f, 0.02f, -0.4f), b.material(vec3(0.3f, 0.6f, 0.4f)));  // fronts outside
  b.quad(vec3(-0.4f, 2.9f, -0.3f), vec3(0.6f, 0, 0), vec3(0, 0, 0.6f), b.material(vec3(0), vec3(5)), 2, 2);
  PunctualLight lamp;
  lamp.type = LightType::kPoint;
  lamp.color = vec3(3, 2, 1);
  b.punctual(lamp, vec3(-1, 2.2f, 0.6f), vec3(0, -1, 0));
  return b.scene;
}

Settings room_view(int size = 12) {
  Settings settings = square_view("sst", size, vec3(0.3f, 1.7f, 1.8f), vec3(0, 0.7f, -1), 75);
  settings.force_diffuse = false;
  settings.indirect.vpls = 500;
  settings.indirect.keep_vpls = true;
  return settings;
}

// Settings of how lights are chosen, applied to `direct` or `indirect`.
using Values = std::vector<std::pair<std::string, std::string>>;
struct NamedValues {
  const char* name;
  Values values;
  int spp;
};
std::vector<NamedValues> tree_selections() {
  return {{"perfect", {{"hierarchy", "perfect"}, {"weights", "min-max"}, {"width", "4"}}, 120},
          {"cones, three samples", {{"hierarchy", "perfect"}, {"weights", "min-max"}, {"cones", "true"}, {"spp", "3"}}, 50},
          {"yuksel", {{"hierarchy", "perfect"}, {"weights", "yuksel"}}, 120},
          {"saoh", {{"hierarchy", "saoh"}, {"weights", "saoh"}}, 120},
          {"agglomerative, split", {{"hierarchy", "agglomerative"}, {"weights", "min-max"}, {"split", "0.8"}}, 30},
          {"cut", {{"hierarchy", "perfect"}, {"weights", "min-max"}, {"selection", "cut"}, {"spp", "8"}}, 30},
          {"cut of a BVH",
           {{"hierarchy", "saoh"}, {"weights", "saoh"}, {"selection", "cut"}, {"spp", "8"}},
           30},
          {"interleaved cut",
           {{"hierarchy", "perfect"}, {"weights", "min-max"}, {"selection", "cut"}, {"spp", "8"}, {"cut_interleave", "2"}},
           80}};
}
Settings with_values(Settings settings, const std::string& prefix, const NamedValues& named) {
  for (const auto& [key, value] : named.values) set_value(settings, prefix + "." + key, value);
  settings.spp = named.spp;
  return settings;
}

struct LayerMeans {
  RunningMean direct, indirect;
};
// Of renders of several frames under the virtual point lights of the first.
LayerMeans layer_means(const Scene& scene, Settings settings, int renders) {
  RenderStats stats;
  const std::unique_ptr<World> world = make_world(scene, settings, stats);
  trace_vpls(*world, settings, 0, stats);
  const int spp = std::max(1, settings.spp / renders);
  LayerMeans means;
  for (settings.frame = 0; settings.frame < renders; ++settings.frame) {
    Film film(settings.width, settings.height);
    for (int sample = 0; sample < spp; ++sample) render_sample(*world, settings, sample, film, stats);
    const Image image = develop(film, spp);
    means.direct.add(image_mean(image, "direct").mean);
    means.indirect.add(image_mean(image, "indirect").mean);
  }
  return means;
}

double mean_of_all_vpls() {
  Settings settings = room_view();
  settings.indirect.selection = Selection::kAll;
  return layer_means(room_of_lamps(), settings, 1).indirect.mean();
}

// Student's t of few renders has wider tails than a normal: 6 standard errors of 10 renders are met by chance once in five
// thousand.
constexpr int kRenders = 10;
constexpr double kErrors = 6;

TEST(FrameVplTree, EverySelectionHasTheMeanOfAllVpls) {
  const double truth = mean_of_all_vpls();
  EXPECT_GT(truth, 0.01);
  for (const NamedValues& named : tree_selections()) {
    SCOPED_TRACE(named.name);
    const Settings settings = with_values(room_view(), "indirect", named);
    ASSERT_NO_THROW(check(settings));
    const LayerMeans means = layer_means(room_of_lamps(), settings, kRenders);
    EXPECT_TRUE(mean_within(means.indirect, truth, kErrors, 1e-4 * truth));
    EXPECT_LT(means.indirect.standard_error(), 0.02 * truth);
  }
}

TEST(FrameVplTree, JointLayersHaveTheMeansOfSeparateOnes) {
  Settings separate = room_view();
  separate.direct.selection = Selection::kAll;
  separate.direct.spp = 4;
  separate.spp = 80;
  const RunningMean direct = layer_means(room_of_lamps(), separate, kRenders).direct;
  const double indirect = mean_of_all_vpls();
  std::vector<NamedValues> selections = tree_selections();
  selections.push_back({"BSDF samples", {{"mis", "true"}, {"spp", "2"}}, 60});
  selections.push_back({"cut, BSDF samples", {{"mis", "true"}, {"selection", "cut"}, {"spp", "8"}}, 30});
  selections.push_back({"power", {{"selection", "power"}, {"hierarchy", "none"}, {"spp", "16"}}, 40});
  for (const NamedValues& named : selections) {
    SCOPED_TRACE(named.name);
    Settings settings = with_values(room_view(), "direct", named);
    settings.indirect.joint = true;
    ASSERT_NO_THROW(check(settings));
    const LayerMeans means = layer_means(room_of_lamps(), settings, kRenders);
    const double error = std::hypot(means.direct.standard_error(), direct.standard_error());
    EXPECT_TRUE(mean_within(means.direct.mean(), error, direct.mean(), kErrors, 1e-4 * direct.mean()));
    EXPECT_TRUE(mean_within(means.indirect, indirect, kErrors, 1e-4 * indirect));
    EXPECT_LT(error, 0.03 * direct.mean());
    EXPECT_LT(means.indirect.standard_error(), 0.05 * indirect);
  }
  Settings all = room_view();
  all.direct.selection = Selection::kAll;
  all.indirect.joint = true;
  EXPECT_NEAR(layer_means(room_of_lamps(), all, 1).indirect.mean() / indirect, 1, 1e-3);
}

// Rays from mirrors and for the clamp are lit where they arrive by the same lights.
TEST(FrameVplTree, GatheredLightIsTheSame) {
  Settings substitute = room_view();
  substitute.indirect.stop = Stop::kLeaf;
  substitute.indirect.compensate = true;
  substitute.indirect.mirror_roughness = 0.6f;
  substitute.spp = 150;
  Settings tree = with_values(substitute, "indirect", tree_selections()[0]);
  Settings joint = substitute;
  joint.indirect.joint = true;
  tree.spp = joint.spp = 150;
  const RunningMean expected = layer_means(room_of_lamps(), substitute, kRenders).indirect;
  for (const Settings& settings : {tree, joint}) {
    const RunningMean found = layer_means(room_of_lamps(), settings, kRenders).indirect;
    const double error = std::hypot(found.standard_error(), expected.standard_error());
    EXPECT_TRUE(mean_within(found.mean(), error, expected.mean(), kErrors));
    EXPECT_LT(error, 0.05 * expected.mean());
  }
}

TEST(FrameVplTree, SameBitsForAnyNumberOfThreads) {
  for (const NamedValues& named : tree_selections())
    for (const bool joint : {false, true}) {
      SCOPED_TRACE(named.name);
      Settings settings = with_values(room_view(70), joint ? "direct" : "indirect", named);  // four tiles
      settings.indirect.joint = joint;
      settings.indirect.keep_vpls = false;
      settings.spp = 2;
      settings.threads = 1;
      const Image one = render(room_of_lamps(), settings);
      settings.threads = 4;
      const Image four = render(room_of_lamps(), settings);
      for (const char* layer : {"direct", "indirect"}) EXPECT_EQ(one.find(layer)->values, four.find(layer)->values);
    }
}

TEST(FrameVplTree, StructuresAreNamedForWhatTheyServe) {
  const auto names = [](Settings settings) {
    RenderStats stats;
    settings.width = settings.height = 4;
    settings.spp = 1;
    render(room_of_lamps(), settings, &stats);
    std::string all;
    for (const StructureStats& s : stats.structures) all += s.name + (s.of_vpls ? " (VPLs); " : "; ");
    return all;
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  const std::string tree = names(with_values(room_view(), "indirect", tree_selections()[0]));
  EXPECT_TRUE(has(tree, "VPL light tree (VPLs)") && has(tree, "perfect tree;") && !has(tree, "substitute")) << tree;
  const std::string saoh = names(with_values(room_view(), "indirect", tree_selections()[3]));
  EXPECT_TRUE(has(saoh, "VPL SAOH tree (VPLs)")) << saoh;
  Settings joint = room_view();
  joint.indirect.joint = true;
  const std::string one = names(joint);
  EXPECT_TRUE(has(one, "joint light tree (VPLs)") && !has(one, "perfect tree") && !has(one, "substitute")) << one;
  EXPECT_TRUE(has(names(room_view()), "substitute tree (VPLs)"));
}

// A dark scene leaves no lights: nothing to choose from, and nothing is chosen.
TEST(FrameVplTree, NoVplsAreNoLight) {
  SceneBuilder b;
  b.room(vec3(-2, 0, -2), vec3(2, 3, 2), b.material(vec3(0.7f)));
  for (const NamedValues& named : tree_selections())
    for (const bool joint : {false, true}) {
      Settings settings = with_values(room_view(4), joint ? "direct" : "indirect", named);
      settings.indirect.joint = joint;
      settings.spp = 1;
      EXPECT_EQ(image_mean(render(b.scene, settings), "").mean, 0) << named.name;
    }
}

TEST(FrameVplTree, SenselessCombinationsAreRefusedInOneSentence) {
  const auto refusal = [](const Values& values, bool joint = false) {
    Settings s = make_preset("sst");
    s.indirect.joint = joint;
    for (const auto& [key, value] : values) set_value(s, key, value);
    try {
      check(s);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const auto expect_says = [](const std::string& text, const std::vector<std::string>& parts) {
    for (const std::string& part : parts) EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  EXPECT_EQ(refusal({}), "");
  EXPECT_EQ(refusal({}, true), "");
  EXPECT_EQ(refusal({{"indirect.hierarchy", "perfect"}, {"indirect.weights", "min-max"}}), "");
  expect_says(refusal({{"indirect.hierarchy", "perfect"}}),
              {"indirect.weights 'distance-bounded' needs indirect.hierarchy 'substitute'", "use 'min-max'"});
  expect_says(refusal({{"indirect.hierarchy", "saoh"}, {"indirect.weights", "in-box"}}), {"use 'min-max' or 'yuksel' or 'saoh'"});
  expect_says(refusal({{"indirect.weights", "saoh"}}),
              {"needs indirect.hierarchy 'saoh' or 'agglomerative'", "'distance-bounded' or 'in-box' or 'yuksel'"});
  expect_says(refusal({{"indirect.selection", "cut"}}), {"indirect.selection 'cut' cuts light trees", "use 'perfect'"});
  expect_says(refusal({{"indirect.selection", "cut"}, {"indirect.hierarchy", "none"}}), {"use 'perfect'"});
  expect_says(refusal({{"indirect.split", "0.5"}}), {"indirect.split needs"});
  expect_says(refusal({{"indirect.hierarchy", "perfect"}, {"indirect.weights", "min-max"}, {"indirect.correction", "0.5"}}),
              {"indirect.correction"});
  expect_says(refusal({{"indirect.hierarchy", "perfect"}, {"indirect.weights", "min-max"}, {"indirect.show", "true"}}),
              {"indirect.show", "substitute"});
  expect_says(refusal({{"indirect.correction", "0.5"}}, true), {"indirect.joint false"});
  expect_says(refusal({{"indirect.transport", "path"}}, true), {"indirect.transport is 'path'; use 'vpl'"});
  expect_says(refusal({{"direct.hierarchy", "two-level"}}, true), {"use 'perfect', 'saoh' or 'agglomerative'"});
  expect_says(refusal({{"direct.selection", "pool"}, {"direct.hierarchy", "two-level"}}, true), {"direct.selection 'pool'", "set direct.hierarchy 'perfect'"});
}

}  // namespace
}  // namespace lumigrove
