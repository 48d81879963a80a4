// The audit of light samplers: it catches every kind of liar by name, and lets honest samplers pass.
#include "frame/audit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/rng.h"
#include "base/statistics.h"
#include "frame/audit_points.h"
#include "frame/audit_samplers.h"
#include "lights/emitter.h"
#include "light_scenes.h"
#include "lumigrove/scene.h"
#include "tool_runner.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;
using Json = nlohmann::json;

// --- a sampler of five lights that tells the truth, and what makes a liar of it -------------------------------------

struct Made {
  std::vector<double> light{1, 2, 4, 0.5, 2.5};           // what each sends
  std::vector<double> drawn{0.2, 0.2, 0.4, 0.05, 0.15};   // how often it is really drawn
  std::vector<double> claimed = drawn;
  double factor = 1;                                      // of all estimates
};

std::uint32_t pick(const std::vector<double>& p, double u) {
  for (std::uint32_t i = 0; i < p.size(); ++i) {
    if (u < p[i]) return i;
    u -= p[i];
  }
  return kNoCell;
}

AuditedSampler make(const Made& made) {
  AuditedSampler sampler;
  sampler.name = "made";
  sampler.lights = sampler.cells = static_cast<std::uint32_t>(made.light.size());
  sampler.at = [made](const AuditPoint&, std::uint32_t) {
    SamplerAtPoint at;
    at.parts = {1};
    at.draw = [made](std::size_t, std::uint32_t seed, std::span<std::uint32_t> cells) {
      for (std::uint32_t i = 0; i < cells.size(); ++i)
        cells[i] = pick(made.drawn, static_cast<double>(Rng{seed, 0, i}.uniform4(0).x));
    };
    at.pdf = [made](std::size_t, std::span<double> cells) {
      std::copy(made.claimed.begin(), made.claimed.end(), cells.begin());
    };
    at.estimate = [made](int count, std::uint32_t seed) {
      std::vector<double> estimates;
      for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i) {
        const std::uint32_t l = pick(made.drawn, static_cast<double>(Rng{seed, 1, i}.uniform4(0).x));
        estimates.push_back(l == kNoCell ? 0 : made.factor * made.light[l] / made.claimed[l]);
      }
      return estimates;
    };
    return at;
  };
  sampler.light = [made](const AuditPoint&, std::uint32_t) {
    std::vector<LightMoments> light;
    for (const double l : made.light) {
      const auto f = static_cast<float>(l);
      light.push_back({f, f * f, f, 0});
    }
    return light;
  };
  sampler.describe = [](std::uint32_t light) {
    LightName name{"point light", "lamp post " + std::to_string(light)};
    name.stable_id = 100 + light;
    return name;
  };
  return sampler;
}

AuditRow judged(const AuditedSampler& sampler, std::uint32_t seed = 1) {
  const std::vector<AuditPoint> points(12);
  AuditRow row = audit_sampler(sampler, points, {4096, seed, 1e-3});
  judge({&row, 1}, points, {4096, seed, 1e-3});
  return row;
}

// One sentence, which has the word.
void expect_broken(const AuditRow& row, const std::string& word) {
  ASSERT_EQ(row.failures.size(), 1u);
  EXPECT_NE(row.failures[0].find(word), std::string::npos) << row.failures[0];
}

TEST(Audit, HonestSamplersHold) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    const AuditRow row = judged(make({}), seed);
    EXPECT_TRUE(row.holds()) << row.failures[0];
    EXPECT_NEAR(row.mean_ratio, 1, 0.01);
    EXPECT_EQ(row.missed_count, 0u);
    EXPECT_EQ(row.tests, 25u);
  }
}

TEST(Audit, WrongProbabilitiesAreCaughtAndNamed) {
  Made liar;
  liar.claimed = {0.2, 0.2, 0.4, 0.02, 0.18};
  const AuditRow row = judged(make(liar));
  ASSERT_FALSE(row.holds());
  EXPECT_NE(row.failures[0].find("point light at node 'lamp post 3' (id 103)"), std::string::npos) << row.failures[0];
  EXPECT_LT(row.frequencies.corrected, 1e-6);
}

TEST(Audit, ProbabilitiesAboveOneAreCaught) {
  Made liar;
  for (double& p : liar.claimed) p *= 1.1;
  liar.factor = 1.1;  // makes up for it
  expect_broken(judged(make(liar)), "add up to 1.1");
}

TEST(Audit, MissedLightsAreNamedWithShareAndPlace) {
  Made liar;
  liar.drawn = liar.claimed = {0.2, 0.2, 0.4, 0, 0.2};
  liar.factor = 1 / 0.95;  // makes up for its share
  const AuditRow row = judged(make(liar));
  EXPECT_EQ(row.missed_count, 1u);
  expect_broken(row, "point light at node 'lamp post 3' (id 103), 5 % of the light at (");
  EXPECT_EQ(row.missed.at(0).light, 3u);
  EXPECT_EQ(row.missed.at(0).points, 12u);
}

TEST(Audit, LightsThatAreDrawnAgainstTheClaimAreCaught) {
  Made liar;
  liar.claimed[3] = 0;
  liar.light[3] = 0;
  const AuditRow row = judged(make(liar));
  ASSERT_FALSE(row.holds());
  EXPECT_EQ(row.frequencies.p, 0);
  EXPECT_NE(row.failures[0].find("lamp post 3"), std::string::npos) << row.failures[0];
}

TEST(Audit, BiasedEstimatesAreCaught) {
  for (const double factor : {0.98, 1.02, 0.0}) {
    Made liar;
    liar.factor = factor;
    expect_broken(judged(make(liar)), "biased");
  }
  Made broken;
  broken.factor = std::numeric_limits<double>::quiet_NaN();
  expect_broken(judged(make(broken)), "biased");
}

TEST(Audit, BiasThatIsAdmittedIsShownOnly) {
  Made made;
  made.factor = 0.9;
  AuditedSampler sampler = make(made);
  sampler.unbiased = false;
  const AuditRow row = judged(sampler);
  EXPECT_TRUE(row.holds());
  EXPECT_NEAR(row.mean_ratio, 0.9, 0.01);
}

// A light that is drawn once in very many estimates: most means are far too low, some far too high. Neither is bias.
TEST(Audit, RareBrightLightsFailNobody) {
  Made made;
  made.light = {1, 1000};
  made.drawn = made.claimed = {1 - 1e-5, 1e-5};
  for (std::uint32_t seed = 0; seed < 30; ++seed) {
    const AuditRow row = judged(make(made), seed);
    EXPECT_TRUE(row.holds()) << row.failures[0];
  }
}

TEST(Audit, DoesNotDependOnTheOrderOfRowsButCorrectsForAll) {
  const std::vector<AuditPoint> points(12);
  AuditRow one = audit_sampler(make({}), points, {});
  std::vector<AuditRow> many(20, one);
  judge({&one, 1}, points, {});
  judge(many, points, {});
  EXPECT_EQ(many[0].frequencies.p, one.frequencies.p);
  EXPECT_GT(many[0].frequencies.corrected, one.frequencies.corrected);
}

// --- bounds ------------------------------------------------------------------------------------------------------

TEST(Statistics, BernsteinBoundsTheTailOfRareHits) {
  // 200 draws of 1/p with p = 0.01: a sum of at least 7 hits has the probability 0.0042.
  constexpr double kP = 0.01, kDraws = 200;
  const double bound = bernstein_p_value((7 - kP * kDraws) / kP, kDraws * (1 / kP - 1), 1 / kP);
  EXPECT_GT(bound, 0.0042);
  EXPECT_LT(bound, 0.2);
  EXPECT_EQ(bernstein_p_value(0, 1, 1), 1);
  EXPECT_EQ(bernstein_p_value(1, 0, 0), 0);
  // Close to the normal tail where single numbers are small: 2 exp(-z^2 / 2).
  EXPECT_NEAR(bernstein_p_value(4, 1, 1e-6), 2 * std::exp(-8.0), 1e-7);
}

TEST(Statistics, SidakIsTheProbabilityOfAnyOfMany) {
  EXPECT_NEAR(sidak_p_value(0.01, 10), 1 - std::pow(0.99, 10), 1e-12);
  EXPECT_NEAR(sidak_p_value(1e-12, 1000), 1e-9, 1e-15);
  EXPECT_EQ(sidak_p_value(1, 3), 1);
  EXPECT_EQ(sidak_p_value(0, 3), 0);
}

// --- the samplers of a scene ---------------------------------------------------------------------------------------

// A room with lights of every kind, some of them named.
Scene small_room() {
  SceneBuilder b;
  const int wall = b.material(vec3(0.6f)), shiny = b.material(vec3(0.5f), vec3(0), 0.8f, 0.4f);
  b.quad(vec3(-3, 0, -3), vec3(0, 0, 6), vec3(6, 0, 0), wall);
  b.quad(vec3(-3, 0, -3), vec3(6, 0, 0), vec3(0, 3, 0), shiny);
  for (int i = 0; i < 12; ++i) {
    const float x = -2.5f + 0.4f * static_cast<float>(i);
    const int bright = b.material(vec3(0), vec3(1 + static_cast<float>(i % 4)));
    b.quad(vec3(x, i % 2 ? 2.5f : 0.6f, static_cast<float>(i % 3 - 1)), vec3(0.2f, 0, 0), vec3(0, 0, 0.1f), bright);
    b.scene.nodes.back().name = "strip " + std::to_string(i);
  }
  PunctualLight spot;
  spot.type = LightType::kSpot;
  spot.color = vec3(4, 1, 1);
  spot.outer_cone = 0.9f;
  spot.range = 6;
  b.punctual(spot, vec3(-2, 2.5f, 1), vec3(0.5f, -1, -0.4f));
  PunctualLight point;
  point.color = vec3(0.5f, 1, 2);
  b.punctual(point, vec3(1.5f, 1, 1), vec3(0, -1, 0));
  PunctualLight sun;
  sun.type = LightType::kDirectional;
  sun.color = vec3(0.4f);
  b.punctual(sun, vec3(0), vec3(0.4f, -1, -0.3f));
  b.punctual(sun, vec3(0), vec3(-0.6f, -1, 0.2f));
  b.scene.environment.radiance = vec3(0.1f);
  b.scene.name = "small room";
  validate(b.scene);
  return b.scene;
}

Settings small_view(const std::string& preset, const std::vector<std::pair<std::string, std::string>>& values) {
  Settings settings = make_preset(preset);
  for (const auto& [key, value] : values) set_value(settings, key, value);
  settings.width = settings.height = 32;
  settings.view = ViewSettings{vec3(0.3f, 1.7f, 3.4f), vec3(0, 0.7f, -1), vec3(0, 1, 0)};
  settings.indirect.vpls = 300;
  check(settings);
  return settings;
}

struct RoomAudit {
  RoomAudit(const Settings& settings, int count)
      : settings_(settings_of_audited_world(settings)), world(make_world(scene, settings_, stats)) {
    trace_vpls(*world, settings_, 0, stats);
    points = make_audit_points(*world, settings_, count);
    const auto cache = std::make_shared<LightCache>(points.size());
    const bool vpls = settings.indirect.transport == Transport::kVpl && !settings.indirect.joint;
    sampler = vpls ? audit_of_vpls(scene, *world, settings_, "x", cache)
                   : audit_of_direct(scene, *world, settings_, "x", cache);
  }
  AuditRow run(const AuditOptions& options) {
    AuditRow row = audit_sampler(sampler, points, options);
    judge({&row, 1}, points, options);
    return row;
  }

  const Scene scene = small_room();
  Settings settings_;
  RenderStats stats;
  std::unique_ptr<World> world;
  std::vector<AuditPoint> points;
  AuditedSampler sampler;
};

using Values = std::vector<std::pair<std::string, std::string>>;

TEST(Audit, SamplersOfEveryKindHoldInARoomOfAllLights) {
  const Values joint{{"indirect.transport", "vpl"}, {"indirect.joint", "true"}};
  const std::vector<std::pair<std::string, Values>> methods{
      {"tree", {}},
      {"tree", {{"direct.hierarchy", "two-level"}, {"direct.width", "4"}}},
      {"tree", joint},
      {"rtslc", {{"direct.cut_interleave", "2"}}},
      {"rtslc", {{"direct.hierarchy", "agglomerative"}, {"direct.cut_share", "1"}}},
      {"pool", {}},
      {"pool", joint},
      {"ats", {}},
      {"power", {}},
      {"uniform", {{"direct.spp", "3"}}},
      {"sst", {}},
      {"sst", {{"indirect.correction", "0.5"}}},
      {"slc", {}},
      {"slc", {{"indirect.selection", "power"}}},
      {"slc", {{"indirect.selection", "cut"}, {"indirect.hierarchy", "perfect"}, {"indirect.weights", "min-max"}}}};
  std::uint32_t seed = 0;
  for (const auto& [preset, values] : methods) {
    Settings settings = small_view(preset, values);
    settings.seed = ++seed;
    RoomAudit audit(settings, 12);
    const AuditRow row = audit.run({4096, seed, 1e-3});
    EXPECT_TRUE(row.holds()) << preset << ' ' << seed << ": " << row.failures[0];
    EXPECT_GT(row.points, 8u) << preset;
    if (row.unbiased) {
      EXPECT_NEAR(row.mean_ratio, 1, 0.1) << preset;
    }
  }
}

TEST(Audit, PointsAreSeenAndStrewnOnBothSides) {
  RoomAudit audit(small_view("tree", {}), 200);
  int seen = 0, below = 0;
  for (const AuditPoint& p : audit.points) {
    seen += p.seen ? 1 : 0;
    below += !p.seen && p.surface.position.y < 1e-4f && p.surface.normal.y < 0;
    EXPECT_GT(glm::dot(p.surface.normal, p.surface.wo), 0);
    EXPECT_NE(p.surface.instance, kNoId);
  }
  EXPECT_EQ(audit.points.size(), 200u);
  EXPECT_EQ(seen, 100);
  EXPECT_GT(below, 5);
}

// A tree that has forgotten a light: as if its leaf were another's.
TEST(Audit, ALightThatATreeForgotIsNamed) {
  RoomAudit audit(small_view("tree", {}), 12);
  const auto honest = audit.sampler.at;
  audit.sampler.at = [honest](const AuditPoint& point, std::uint32_t number) {
    SamplerAtPoint at = honest(point, number);
    at.pdf = [pdf = at.pdf](std::size_t part, std::span<double> cells) {
      pdf(part, cells);
      cells[8] = cells[9] = 0;  // both triangles of strip 4
    };
    at.draw = [draw = at.draw](std::size_t part, std::uint32_t seed, std::span<std::uint32_t> cells) {
      draw(part, seed, cells);
      std::replace_if(cells.begin(), cells.end(), [](std::uint32_t c) { return c == 8 || c == 9; }, kNoCell);
    };
    return at;
  };
  const AuditRow row = audit.run({4096, 1, 1e-3});
  EXPECT_EQ(row.missed_count, 2u);
  ASSERT_FALSE(row.holds());
  EXPECT_NE(row.failures[0].find("at node 'strip 4'"), std::string::npos) << row.failures[0];
}

// Estimates without the light of the suns.
TEST(Audit, KernelsThatLoseLightAreCaught) {
  RoomAudit audit(small_view("uniform", {}), 12);
  const auto honest = audit.sampler.at;
  audit.sampler.at = [honest](const AuditPoint& point, std::uint32_t number) {
    SamplerAtPoint at = honest(point, number);
    at.estimate = [estimate = at.estimate](int count, std::uint32_t seed) {
      std::vector<double> estimates = estimate(count, seed);
      for (double& e : estimates) e *= 0.9;
      return estimates;
    };
    return at;
  };
  expect_broken(audit.run({65536, 1, 1e-3}), "biased");
}

// --- the command -----------------------------------------------------------------------------------------------

class AuditCommand : public ToolTest {
 protected:
  Outcome audit(std::vector<std::string> more) {
    more.insert(more.begin(), "audit");
    return run(more);
  }
};

TEST_F(AuditCommand, AllMethodsHoldOnABuiltInScene) {
  const Outcome outcome = audit({"single", "--points", "4", "--draws", "512", "--set", "indirect.vpls=200"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  for (const PresetInfo& preset : presets()) {
    const Settings settings = make_preset(preset.name);
    if (settings.direct.selection != Selection::kAll) {
      EXPECT_NE(outcome.out.find(preset.name), std::string::npos) << preset.name;
    }
  }
  EXPECT_NE(outcome.out.find("holds"), std::string::npos);
}

TEST_F(AuditCommand, JsonHoldsEverySampler) {
  const Outcome outcome = audit({"cornell-lights", "--methods", "tree,power,path", "--points", "4", "--draws", "512",
                                 "--json", "--seed", "7"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json json = Json::parse(outcome.out);
  EXPECT_TRUE(json["holds"].get<bool>());
  EXPECT_EQ(json["points"].get<int>(), 4);
  EXPECT_EQ(json["seed"].get<int>(), 7);
  ASSERT_EQ(json["samplers"].size(), 2u);  // a path's lights are the tree's
  EXPECT_EQ(json["samplers"][0]["methods"], Json({"tree", "path"}));
  EXPECT_EQ(json["samplers"][1]["methods"], Json({"power"}));
  EXPECT_EQ(json["samplers"][0]["missed_lights"].get<int>(), 0);
  EXPECT_NEAR(json["samplers"][0]["mean_ratio"].get<double>(), 1, 0.2);
  EXPECT_GT(json["never_found"]["count"].get<int>(), 0);
  EXPECT_EQ(json["never_found"]["first"][0]["kind"], "triangle");
}

TEST_F(AuditCommand, DoesNotDependOnThreads) {
  const std::vector<std::string> words{"cornell-lights", "--methods", "rtslc,ats", "--points", "6", "--draws", "512", "-t"};
  std::vector<std::string> one = words, two = words;
  one.emplace_back("1");
  two.emplace_back("2");
  EXPECT_EQ(audit(one).out, audit(two).out);
}

TEST_F(AuditCommand, SettingsChangeTheSampler) {
  const Outcome two_level = audit({"cornell-lights", "--set", "direct.hierarchy=two-level", "--points", "4", "--draws", "512",
                                   "--set", "indirect.vpls=100"});
  EXPECT_EQ(two_level.status, 0) << two_level.err;
  EXPECT_NE(two_level.out.find("Left out: pool: "), std::string::npos) << two_level.out;
  const Outcome refused = audit({"cornell-lights", "--methods", "pool", "--set", "direct.hierarchy=two-level"});
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("perfect"), std::string::npos);
}

// A word of one sampler is broken on purpose: it cannot be from outside, so what follows from a broken claim is tested with
// a significance at which honest samplers fail.
TEST_F(AuditCommand, BrokenClaimsAreNamedAndChangeTheStatus) {
  int broken = 0;
  for (int seed = 0; seed < 12 && broken == 0; ++seed) {
    const Outcome outcome = audit({"cornell-lights", "--methods", "uniform", "--points", "24", "--draws", "4096",
                                   "--significance", "0.5", "--seed", std::to_string(seed)});
    if (outcome.status == 0) continue;
    ++broken;
    EXPECT_EQ(outcome.status, 3);
    EXPECT_NE(outcome.out.find("BROKEN"), std::string::npos) << outcome.out;
    EXPECT_EQ(outcome.err.find("lumigrove: uniform: "), 0u) << outcome.err;
  }
  EXPECT_EQ(broken, 1);
}

TEST_F(AuditCommand, RefusesWhatItCannotAudit) {
  const auto refused = [&](const std::vector<std::string>& words, int status, const std::string& word) {
    const Outcome outcome = audit(words);
    EXPECT_EQ(outcome.status, status) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
  };
  folder_.write("dark.obj", std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  refused({"dark.obj", "--quiet"}, 1, "nothing shines");
  refused({"single", "--methods", "trees"}, 1, "'tree'");
  refused({"single", "--methods", "exhaustive"}, 1, "draws no lights");
  refused({"single", "--points", "0"}, 2, "--points");
  refused({"single", "--draws", "many"}, 2, "--draws");
  refused({"single", "--significance", "0"}, 2, "--significance");
  refused({"single", "--significance", "nan"}, 2, "--significance");
  refused({"single", "--methods", "tree", "--preset", "tree"}, 2, "--preset");
  refused({}, 2, "SCENE");
}

TEST_F(AuditCommand, SceneWithoutSurfacesIsRefused) {
  folder_.write("empty.gltf", std::string(R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_lights_punctual"],
    "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point"}]}},
    "nodes":[{"extensions":{"KHR_lights_punctual":{"light":0}}}],"scenes":[{"nodes":[0]}],"scene":0})"));
  const Outcome outcome = audit({"empty.gltf", "--quiet", "--vp", "0", "0", "5", "--vi", "0", "0", "0"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("no surface"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace lumigrove
