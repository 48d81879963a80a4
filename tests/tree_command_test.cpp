// `lumigrove tree`: what it explains is what a render does, and what it prints adds up.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "lumigrove/image.h"
#include "lumigrove/scene.h"
#include "tool_runner.h"

namespace lumigrove {
namespace {

using Json = nlohmann::json;

// On a small tree of a small image.
class TreeCommand : public ToolTest {
 protected:
  Outcome tree(const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"tree", "cornell-lights", "--set", "indirect.vpls=3000"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }

  Json tree_json(std::vector<std::string> more) {
    more.emplace_back("--json");
    const Outcome outcome = tree(more);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return Json::parse(outcome.out);
  }
};

void expect_refused(const Outcome& outcome, const std::string& word) {
  EXPECT_NE(outcome.status, 0);
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
}

// --- refusals ------------------------------------------------------------------------------------------------

TEST_F(TreeCommand, PixelOutsideTheImageIsRefused) {
  expect_refused(tree({"--size", "32x18", "--pixel", "32,0"}), "--pixel");
  expect_refused(tree({"--size", "32x18", "--pixel", "0,-1"}), "--pixel");
}

TEST_F(TreeCommand, SceneWithoutVplsIsRefused) {
  folder_.write("dark.obj", std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  expect_refused(run({"tree", "dark.obj", "--quiet"}), "virtual point lights");
}

TEST_F(TreeCommand, PixelWithoutSurfaceIsRefused) {
  folder_.write("one.obj", std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  expect_refused(run({"tree", "one.obj", "--quiet", "--environment", "1,1,1", "--size", "32x18", "--vp", "0", "0", "9",
                      "--vi", "0", "0", "90", "--pixel", "0,0"}),
                 "no surface");
}

TEST_F(TreeCommand, UnknownOverlayIsRefusedWithTheValidOnes) {
  const Outcome outcome = tree({"--overlay", "arrows", "-o", "a.png"});
  expect_refused(outcome, "arrows");
  for (const char* valid : {"vpls", "ellipses", "steps", "size"})
    EXPECT_NE(outcome.err.find(valid), std::string::npos) << valid;
}

TEST_F(TreeCommand, OutputsThatCannotBeWrittenAreRefusedBeforeAnyWork) {
  expect_refused(run({"tree", "no such scene.glb", "--export", "missing/tree.json"}), "missing");
  expect_refused(run({"tree", "no such scene.glb", "--export", "tree.txt"}), "tree.txt");
  expect_refused(run({"tree", "no such scene.glb", "--overlay", "vpls", "-o", "missing/a.png"}), "missing");
  expect_refused(run({"tree", "no such scene.glb", "--overlay", "vpls", "-o", "a.exr"}), "a.exr");
  EXPECT_TRUE(folder_.entries().empty());
}

TEST_F(TreeCommand, OptionsWithoutEffectAreRefused) {
  expect_refused(tree({"--gloss"}), "--pixel");
  expect_refused(tree({"--samples", "100"}), "--pixel");
  expect_refused(tree({"--overlay", "vpls"}), "-o");
  expect_refused(tree({"-o", "a.png"}), "--overlay");
  expect_refused(tree({"--overlay", "vpls", "-o", "a.png", "--pixel", "0,0"}), "--pixel");
  expect_refused(tree({"--preset", "path"}), "'path'");
  expect_refused(tree({"--preset", "slc", "--overlay", "size", "-o", "a.png"}), "indirect.stop");
  expect_refused(tree({"--pixel", "9,9", "--gloss", "--set", "indirect.gloss=false"}), "indirect.gloss");
}

// --- statistics ----------------------------------------------------------------------------------------------

TEST_F(TreeCommand, StatisticsAddUp) {
  const Json report = tree_json({"--size", "64x36"});
  const Json& tree = report["tree"];
  const Json& walks = report["walks"];
  EXPECT_GT(report["vpls"].get<int>(), 1000);
  EXPECT_EQ(tree["inner_nodes"].get<int>(), report["vpls"].get<int>() - 1);
  EXPECT_GE(tree["depth_mean"].get<double>(), std::log2(report["vpls"].get<double>()) - 1e-9);
  EXPECT_GE(tree["depth_max"].get<double>(), tree["depth_mean"].get<double>());
  EXPECT_NEAR(
      walks["leaf_share"].get<double>() + walks["substitute_share"].get<double>() + walks["dead_share"].get<double>(),
      1, 1e-12);
  EXPECT_GT(walks["substitute_share"].get<double>(), 0);
  EXPECT_LE(walks["inside_beyond_offset_share"].get<double>(), walks["inside_share"].get<double>());
  EXPECT_LE(walks["steps_max"].get<int>(), tree["depth_max"].get<int>());
  EXPECT_EQ(tree["nu"]["100%"].get<double>(), 1);
}

TEST_F(TreeCommand, StatisticsDoNotDependOnThreads) {
  const auto without_times = [](const std::string& text) {
    return std::regex_replace(text, std::regex("[0-9.]+ ms"), "");
  };
  const Outcome one = tree({"--size", "64x36", "-t", "1"}), two = tree({"--size", "64x36", "-t", "2"});
  EXPECT_EQ(one.status, 0) << one.err;
  EXPECT_EQ(without_times(one.out), without_times(two.out));
}

TEST_F(TreeCommand, WalksToLeavesNeverEndAtSubstitutes) {
  const Json report = tree_json({"--size", "64x36", "--preset", "slc"});
  EXPECT_EQ(report["preset"], "slc");
  EXPECT_EQ(report["walks"]["substitute_share"].get<double>(), 0);
}

// --- one pixel -----------------------------------------------------------------------------------------------

void expect_consistent_walk(const Json& report) {
  double product = 1;
  for (const Json& step : report["steps"]) {
    const Json& left = step["children"][0];
    const Json& right = step["children"][1];
    EXPECT_NEAR(left["probability"].get<double>() + right["probability"].get<double>(), 1, 1e-5);
    const double truth = left["true_share"].get<double>() + right["true_share"].get<double>();
    EXPECT_TRUE(truth == 0 || std::abs(truth - 1) < 1e-9) << truth;
    const int taken = step["taken"].get<int>();
    ASSERT_GE(taken, 0);
    const double beyond = step["random"].get<double>() - left["probability"].get<double>();
    if (std::abs(beyond) > 1e-3) {
      EXPECT_EQ(taken, beyond > 0 ? 1 : 0);
    }
    product *= step["children"][static_cast<std::size_t>(taken)]["probability"].get<double>();
  }
  EXPECT_NEAR(product / report["drawn"]["probability"].get<double>(), 1, 1e-4);
  const Json& last = report["steps"].back();
  const Json& end = last["children"][last["taken"].get<std::size_t>()];
  const bool light = report["drawn"]["end"] == "light";
  EXPECT_EQ(end[light ? "light" : "node"], report["drawn"]["number"]);
  EXPECT_TRUE(light || end["usable"].get<bool>());
}

TEST_F(TreeCommand, PrintedProbabilitiesMultiplyToTheTotal) {
  int walks = 0;
  for (const char* pixel : {"8,9", "16,9", "24,9", "16,14"}) {
    for (const bool gloss : {false, true}) {
      std::vector<std::string> arguments{"--size", "32x18", "--pixel", pixel};
      if (gloss) arguments.emplace_back("--gloss");
      const Json report = tree_json(arguments);
      if (report["drawn"]["end"] == "dead") continue;
      SCOPED_TRACE(pixel);
      expect_consistent_walk(report);
      EXPECT_EQ(report["lobe"], gloss ? "gloss" : "diffuse");
      ++walks;
    }
  }
  EXPECT_GE(walks, 6);
}

TEST_F(TreeCommand, ExplainsTheSampleThatARenderTakes) {
  const std::vector<std::string> common{"cornell-lights", "--preset", "sst",    "--set", "indirect.vpls=3000",
                                        "--size",         "32x18",    "--seed", "5",     "--force-diffuse"};
  std::vector<std::string> render{"render"};
  render.insert(render.end(), common.begin(), common.end());
  render.insert(render.end(), {"-o", "image.exr", "--quiet"});
  ASSERT_EQ(run(render).status, 0);
  const Image image = read_image(folder_ / "image.exr");
  const Layer* indirect = image.find("indirect");
  ASSERT_NE(indirect, nullptr);
  int lit = 0;
  for (int x = 2; x < 32; x += 3) {
    const std::size_t at = 3 * (static_cast<std::size_t>(12) * 32 + static_cast<std::size_t>(x));
    std::vector<std::string> words{"tree", "--json", "--pixel", fmt::format("{},12", x)};
    words.insert(words.end(), common.begin(), common.end());
    const Outcome outcome = run(words);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const Json drawn = Json::parse(outcome.out)["drawn"];
    if (drawn["end"] == "dead") continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const double explained = drawn["contribution"][c].get<double>();
      EXPECT_NEAR(static_cast<double>(indirect->values[at + c]), explained, 1e-3 * explained) << x;  // half floats
      lit += explained > 0;
    }
  }
  EXPECT_GE(lit, 6);
}

TEST_F(TreeCommand, LeafWalksHaveTheTruthForAMean) {
  for (const bool gloss : {false, true}) {
    std::vector<std::string> arguments{"--size", "32x18", "--pixel", "16,14", "--preset", "slc", "--samples", "20000"};
    if (gloss) arguments.emplace_back("--gloss");
    const Json report = tree_json(arguments);
    const auto y = [](const Json& c) {
      return 0.2126 * c[0].get<double>() + 0.7152 * c[1].get<double>() + 0.0722 * c[2].get<double>();
    };
    const Json& samples = report["samples"];
    const double unoccluded = y(report["truth"]["unoccluded"]), arriving = y(report["truth"]["arriving"]);
    EXPECT_GT(arriving, 0);
    EXPECT_LE(arriving, unoccluded);
    EXPECT_NEAR(samples["unoccluded_y"].get<double>(), unoccluded,
                4 * samples["unoccluded_standard_error_y"].get<double>());
    EXPECT_NEAR(samples["mean_y"].get<double>(), arriving, 4 * samples["standard_error_y"].get<double>());
  }
}

TEST_F(TreeCommand, TextNamesTheStepsAndTheTruth) {
  const Outcome outcome = tree({"--size", "32x18", "--pixel", "16,14", "--samples", "100"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  for (const char* word : {"position", "roughness", "prob.", "drawn", "unoccluded", "truth", "100 walks"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << "\n" << outcome.out;
}

// --- files ---------------------------------------------------------------------------------------------------

std::size_t column(const Json& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  EXPECT_NE(found, names.end()) << name;
  return static_cast<std::size_t>(found - names.begin());
}

TEST_F(TreeCommand, JsonRootCarriesTheLightOfAllVpls) {
  ASSERT_EQ(tree({"--export", "tree.json", "--quiet"}).status, 0);
  const Json json = Json::parse(read_text(folder_ / "tree.json"));
  const std::size_t count = json["lights"].get<std::size_t>();
  ASSERT_EQ(json["leaves"].size(), count);
  ASSERT_EQ(json["nodes"].size(), count - 1);
  const Json& root = json["nodes"][0];
  EXPECT_EQ(root[column(json["node_columns"], "level")].get<int>(), 0);
  EXPECT_EQ(root[column(json["node_columns"], "last_leaf")].get<std::size_t>(), count - 1);
  for (const char* name : {"intensity_r", "intensity_g", "intensity_b"}) {
    const std::size_t at = column(json["leaf_columns"], name);
    double sum = 0;
    for (const Json& leaf : json["leaves"]) sum += leaf[at].get<double>();
    EXPECT_NEAR(root[column(json["node_columns"], name)].get<double>() / sum, 1, 1e-4) << name;
  }
  std::set<std::uint32_t> numbers;
  for (const Json& node : json["nodes"]) {
    EXPECT_EQ(node.size(), json["node_columns"].size());
    numbers.insert(node[0].get<std::uint32_t>());
  }
  EXPECT_EQ(numbers.size(), count - 1);
}

TEST_F(TreeCommand, ExportedGlbLoadsAndRendersAgain) {
  ASSERT_EQ(tree({"--export", "tree.glb", "--export", "tree.json", "--quiet"}).status, 0);
  const std::size_t lights = Json::parse(read_text(folder_ / "tree.json"))["lights"].get<std::size_t>();
  const Scene scene = load_scene((folder_ / "tree.glb").string());
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[1].triangles.size(), 4 * lights);
  EXPECT_GT(scene.meshes[0].triangles.size(), 0u);
  EXPECT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(run({"render", "tree.glb", "--size", "16x9", "-o", "tree.png", "--quiet"}).status, 0);
}

TEST_F(TreeCommand, OverlaysArePicturesOfTheirOwn) {
  std::set<std::vector<float>> pictures;
  for (const char* overlay : {"vpls", "ellipses", "steps", "size"}) {
    const std::string file = std::string(overlay) + ".png";
    const Outcome outcome = tree({"--size", "64x36", "--overlay", overlay, "-o", file});
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_GE(std::count(outcome.out.begin(), outcome.out.end(), '\n'), 2) << outcome.out;  // the file, the legend
    const Image image = read_image(folder_ / file);
    EXPECT_EQ(image.width, 64);
    EXPECT_EQ(image.height, 36);
    pictures.insert(image.layers.front().values);
  }
  EXPECT_EQ(pictures.size(), 4u);
}

}  // namespace
}  // namespace lumigrove
