// The tool as its users meet it: arguments in, exit status, text and files out.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "frame/receipt.h"
#include "lumigrove/image.h"
#include "tool_runner.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

class Cli : public ToolTest {
 protected:
  // Renders something tiny; `more` are further arguments.
  Outcome render(std::vector<std::string> more) {
    std::vector<std::string> arguments{"render", "single", "--size", "16x8", "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments);
  }

  Receipt receipt_of(const std::string& file) {
    return read_receipt(read_image(folder_ / file).metadata, file);
  }
};

bool is_one_line(const std::string& text) { return std::count(text.begin(), text.end(), '\n') == 1; }

void expect_same_pixels(const Image& a, const Image& b) {
  ASSERT_EQ(a.layers.size(), b.layers.size());
  for (std::size_t i = 0; i < a.layers.size(); ++i) {
    EXPECT_EQ(a.layers[i].ids, b.layers[i].ids);
    ASSERT_EQ(a.layers[i].values.size(), b.layers[i].values.size());
    const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
    for (std::size_t k = 0; k < a.layers[i].values.size(); ++k)
      ASSERT_EQ(bits(a.layers[i].values[k]), bits(b.layers[i].values[k])) << a.layers[i].name;
  }
}

// --- mistakes
// --------------------------------------------------------------------------------------------------

struct Mistake {
  int status;
  std::vector<std::string> arguments;
  std::string part_of_message;
};

TEST_F(Cli, MistakesAreOneSentenceAndLeaveNothingBehind) {
  const std::vector<Mistake> mistakes = {
      {2, {}, "required"},
      {2, {"rendr"}, "'render'"},
      {2, {"render"}, "SCENE is required"},
      {2, {"render", "single"}, "--output is required"},
      {2, {"render", "single", "-o", "a.exr", "--sppp", "4"}, "'--spp'"},
      {2, {"render", "single", "-o", "a.exr", "--spp"}, "--spp"},
      {2, {"render", "single", "-o", "a.exr", "--size", "3x4", "--width", "3"}, "excludes"},
      {2, {"render", "single", "-o", "a.exr", "--frames", "1", "--time", "3"}, "excludes"},
      {2, {"render", "single", "-o", "a.exr", "--progress", "loud"}, "loud"},
      {2, {"render", "single", "-o", "a.exr", "--size", "32"}, "--size must be followed by W H"},
      {2, {"render", "single", "-o", "a.exr", "--exposure", "nan"}, "--exposure"},
      {2, {"render", "single", "-o", "a.exr", "--exposure", "101"}, "from -100 to 100"},
      {2, {"render", "single", "-o", "a.exr", "--frames", ""}, "--frames"},
      {2, {"render", "single", "-o", "a.exr", "--time", ""}, "--time"},
      {2, {"render", "single", "-o", "a.exr", "--preset", ""}, "--preset"},
      {2, {"render", "single", "-o", "a.exr", "--environment", ""}, "--environment"},
      {2, {"render", "single", "-o", "a.exr", "--log-file", ""}, "--log-file"},
      {2, {"compare", "-r", "a.exr", "b.exr", "--pixels-per-degree", "nan"}, "--pixels-per-degree"},
      {2, {"list", "method"}, "'methods'"},
      {1, {"render", "single", "-o", "a.exr", "--preset", "powr"}, "'power'"},
      {1, {"render", "single", "-o", "a.exr", "--method", "nothing"}, "unknown method 'nothing'"},
      {1, {"render", "single", "-o", "a.exr", "--set", "direct.sp=4"}, "'direct.spp'"},
      {1, {"render", "single", "-o", "a.exr", "--set", "direct.spp"}, "key=value"},
      {1, {"render", "single", "-o", "a.exr", "--settings", "missing.toml"}, "missing.toml"},
      {1, {"render", "single", "-o", "a.exr", "--size", "0x0"}, "width"},
      {1, {"render", "single", "-o", "a.exr", "--size", "16", "-9"}, "height"},
      {1, {"render", "single", "-o", "a.exr", "--size", "65536x65536"}, "too large"},
      {1, {"render", "single", "-o", "a.exr", "--spp", "0"}, "spp"},
      {1, {"render", "single", "-o", "a.exr", "--threads", "-1"}, "threads"},
      {1, {"render", "single", "-o", "a.exr", "--fov", "180"}, "fov"},
      {1, {"render", "single", "-o", "a.exr", "--light-scale", "nan"}, "light_scale"},
      {1, {"render", "single", "-o", "a.exr", "--max-bounces", "3"}, "--max-bounces"},
      {1, {"render", "single", "-o", "a.exr", "--camera", "no such camera"}, "no such camera"},
      {1, {"render", "single", "-o", "a.exr", "--vp", "0", "0", "x"}, "--vp"},
      {1, {"render", "single", "-o", "a.exr", "--vp", "1,2,3", "--vi", "1,2,3"}, "same point"},
      {1, {"render", "single", "-o", "a.exr", "--pixel", "1280,0"}, "--pixel"},
      {1, {"render", "single", "-o", "a.exr", "--pixelbounds", "4", "4", "0", "9"}, "pixel_bounds"},
      {1, {"render", "single", "-o", "a.exr", "--cropwindow", "0", "2", "0", "1"}, "--cropwindow"},
      {1, {"render", "single", "-o", "a.exr", "--frames", "9-3"}, "--frames"},
      {1, {"render", "single", "-o", "a.exr", "--frames", "1-9x0"}, "--frames"},
      {1, {"render", "single", "-o", "a.exr", "--frames", "0-99999999999"}, "--frames"},
      {1, {"render", "single", "-o", "a.exr", "--frames", "1-2", "--fps", "0"}, "--fps"},
      {1, {"render", "single", "-o", "%s.exr", "--frames", "1-2"}, "%0Nd"},
      {1, {"render", "single", "-o", "a##_##.exr", "--frames", "1-2"}, "more than one place"},
      {1, {"render", "single", "-o", "a.exr", "--device", "abacus"}, "abacus"},
      {1, {"render", "single", "-o", "a.exr", "--environment", "1,2,-3"}, "environment"},
      {1, {"render", "single", "-o", "a.exr", "--environment", "missing.hdr"}, "missing.hdr"},
      {1, {"render", "single", "-o", "a.exr", "--environment", "1,2"}, "neither three numbers"},
      {1, {"render", "single", "-o", "a.tga"}, ".exr"},
      {1, {"render", "single", "-o", "a.exr", "-o", "./a.exr"}, "given twice"},
      {1, {"render", "single", "-o", "missing/a.exr"}, "no folder 'missing'"},
      {1, {"render", "single", "-o", "/proc/a.exr"}, "/proc/a.exr"},
      {1, {"render", "no-such-scene", "-o", "a.exr"}, "no-such-scene"},
      {1, {"render", "missing.glb", "-o", "a.exr"}, "missing.glb"},
      {1, {"render", "single?nothing=3", "-o", "a.exr"}, "nothing"},
      {1, {"render", "missing.glb", "-D", "a=b", "-o", "a.exr"}, "-D"},
      {1, {"render", "single", "-o", "a.exr", "--log-file", "missing/log"}, "missing/log"},
      {1, {"rerun", "missing.exr", "--check"}, "missing.exr"},
      {1, {"scene", "info", "missing.obj"}, "missing.obj"},
      {1, {"scene", "export", "single", "-o", "a.fbx"}, ".pbrt"},
      {1, {"scene", "export", "single", "-o", "missing/a.glb"}, "missing"},
  };
  for (const Mistake& mistake : mistakes) {
    const Outcome outcome = run(mistake.arguments);
    EXPECT_EQ(outcome.status, mistake.status) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_TRUE(is_one_line(outcome.err)) << outcome.err;
    EXPECT_EQ(outcome.err.find("lumigrove: error: "), 0u) << outcome.err;
    EXPECT_NE(outcome.err.find(mistake.part_of_message), std::string::npos)
        << "'" << mistake.part_of_message << "' is not in " << outcome.err;
    EXPECT_EQ(folder_.entries(), std::vector<std::string>{}) << outcome.err;
  }
}

TEST_F(Cli, ScenesThatCannotShowAnythingSayWhy) {
  const auto warnings = [&](const char* name, const char* text) {
    std::ofstream(folder_ / name) << text;
    return run({"render", name, "--size", "16x8", "-o", "a.png"}).err;
  };
  const char* dark = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_NE(warnings("dark.obj", dark).find("nothing in 'dark.obj' shines"), std::string::npos);
  const std::string empty = warnings("empty.gltf", R"({"asset": {"version": "2.0"}})");
  EXPECT_NE(empty.find("'empty.gltf' holds no triangles"), std::string::npos) << empty;
}

TEST_F(Cli, ImagesWithoutAReceiptCannotBeRerun) {
  Image image;
  image.width = image.height = 1;
  image.layers.push_back({"", {"R", "G", "B", "A"}, {0, 0, 0, 1}, {}});
  write_image(image, folder_ / "foreign.exr");
  const Outcome outcome = run({"rerun", "foreign.exr", "-o", "again.exr"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("'foreign.exr' carries no Lumigrove receipt"), std::string::npos) << outcome.err;
}

// --- telling
// -----------------------------------------------------------------------------------------------------

TEST_F(Cli, EveryCommandHasHelp) {
  for (const char* command : {"", "render", "rerun", "compare", "scene", "list"}) {
    std::vector<std::string> arguments{command, "--help"};
    if (!*command) arguments.erase(arguments.begin());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.status, 0) << command;
    EXPECT_NE(outcome.out.find("Usage: lumigrove"), std::string::npos) << outcome.out;
    EXPECT_EQ(outcome.err, "");
  }
}

TEST_F(Cli, ListsNameEveryMethodAndSetting) {
  const std::string methods = run({"list", "methods"}).out, settings = run({"list", "settings"}).out;
  for (const PresetInfo& preset : presets()) {
    EXPECT_NE(methods.find(preset.name), std::string::npos);
    EXPECT_NE(methods.find(preset.citation), std::string::npos);
  }
  EXPECT_NE(methods.find("    unbiased: direct light only\n"), std::string::npos) << methods;
  for (const nlohmann::json& method : nlohmann::json::parse(run({"list", "methods", "--json"}).out))
    EXPECT_NE(method["estimator"].get<std::string>().find("biased: "), std::string::npos) << method;
  for (const SettingInfo& info : settings_table()) EXPECT_NE(settings.find(info.key), std::string::npos);
  const nlohmann::json json = nlohmann::json::parse(run({"list", "settings", "--json"}).out);
  EXPECT_EQ(json.size(), settings_table().size());
  EXPECT_EQ(nlohmann::json::parse(run({"list", "scenes", "--json"}).out).size(), builtin_scenes().size());
  EXPECT_EQ(run({"list", "devices"}).out.find("cpu"), 0u);
}

TEST_F(Cli, SceneInfoCountsEmitters) {
  const Outcome outcome = run({"scene", "info", "cornell-lights", "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const nlohmann::json info = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(info["emitters"][0]["kind"], "triangle");
  EXPECT_GE(info["emitters"][0]["count"], 12000);
  EXPECT_GT(info["emitters"][0]["flux_w"], 0);
  EXPECT_GT(info["duration_s"], 0);
  EXPECT_FALSE(info["cameras"].empty());
}

TEST_F(Cli, QuietSaysNothing) {
  const Outcome outcome = render({"-o", "a.exr", "-o", "a.png"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.out + outcome.err, "");
  EXPECT_EQ(folder_.entries(), (std::vector<std::string>{"a.exr", "a.png"}));
}

TEST_F(Cli, ProgressOffATerminalIsPlainLines) {
  const Outcome outcome = run({"render", "single", "--size", "16x8", "--spp", "3", "-o", "a.exr"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_NE(outcome.err.find("100%  3/3 spp"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find_first_of("\r\x1b"), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.out.find("wrote a.exr (16x8, 3 spp"), 0u) << outcome.out;
}

TEST_F(Cli, JsonProgressIsAnObjectALine) {
  const Outcome outcome =
      run({"render", "single", "--size", "16x8", "--frames", "3-4", "-o", "a.exr", "--progress", "json"});
  std::istringstream lines(outcome.err);
  nlohmann::json last;
  for (std::string line; std::getline(lines, line);) last = nlohmann::json::parse(line);
  EXPECT_EQ(last["done"], 1.0);
  EXPECT_EQ(last["frame"], 4);
  EXPECT_EQ(last["frames_total"], 2);
}

TEST_F(Cli, StatsTellTimesAndBytesPerLight) {
  const Outcome outcome = render({"-o", "a.exr", "--stats"});
  for (const char* part : {"Mrays/s", "build ms", "bytes/light", "light set", "emitters", "peak memory"})
    EXPECT_NE(outcome.out.find(part), std::string::npos) << part << " is not in\n" << outcome.out;
}

TEST_F(Cli, LogFileHoldsWhatQuietHides) {
  EXPECT_EQ(render({"-o", "a.exr", "--log-file", "log"}).err, "");
  EXPECT_NE(read_text(folder_ / "log").find("loaded 'single'"), std::string::npos);
}

// --- settings
// ----------------------------------------------------------------------------------------------------

TEST_F(Cli, OptionsWinOverSetOverFileOverPreset) {
  std::ofstream(folder_ / "s.toml")
      << "preset = 'uniform'\nspp = 2\nseed = 2\n[direct]\nspp = 2\nwidth = 2\n";
  const Outcome outcome = render({"-o", "a.exr", "--settings", "s.toml", "--set", "direct.spp=3", "--set",
                                  "seed=3", "--seed", "4", "--preset", "power"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Settings settings = receipt_of("a.exr").settings;
  EXPECT_EQ(settings.preset, "power");
  EXPECT_EQ(settings.direct.selection, Selection::kPower);
  EXPECT_EQ(settings.direct.width, 2);
  EXPECT_EQ(settings.spp, 2);
  EXPECT_EQ(settings.direct.spp, 3);
  EXPECT_EQ(settings.seed, 4u);
  EXPECT_EQ(settings.width, 16);
}

TEST_F(Cli, ListsOfNumbersMayHaveCommasOrSpaces) {
  ASSERT_EQ(
      render({"-o", "a.exr", "--vp", "-1", "-.5", "2e0", "--vi=0,1,0", "--pixelbounds", "2", "9", "1", "5"})
          .status,
      0);
  const Settings settings = receipt_of("a.exr").settings;
  EXPECT_EQ(settings.view->position, vec3(-1, -0.5f, 2));
  EXPECT_EQ(settings.view->look_at, vec3(0, 1, 0));
  EXPECT_EQ(*settings.pixel_bounds, (std::array<int, 4>{2, 9, 1, 5}));
  ASSERT_EQ(render({"-o", "a.exr", "--cropwindow", "0.1,0.5,0,0.26"}).status, 0);
  EXPECT_EQ(*receipt_of("a.exr").settings.pixel_bounds, (std::array<int, 4>{2, 8, 0, 3}));
  ASSERT_EQ(render({"-o", "a.exr", "--pixel", "15", "7"}).status, 0);
  EXPECT_EQ(*receipt_of("a.exr").settings.pixel_bounds, (std::array<int, 4>{15, 16, 7, 8}));
}

TEST_F(Cli, PrintedCameraGivesTheSameImage) {
  const Outcome printed = run({"render", "single", "--print-camera"});
  ASSERT_EQ(printed.status, 0) << printed.err;
  std::istringstream words(printed.out);
  std::vector<std::string> more{"-o", "b.exr"};
  for (std::string word; words >> word;) more.push_back(word);
  ASSERT_EQ(render({"-o", "a.exr"}).status, 0);
  ASSERT_EQ(render(more).status, 0);
  const Image a = read_image(folder_ / "a.exr"), b = read_image(folder_ / "b.exr");
  const Layer *pa = a.find("P"), *pb = b.find("P");
  ASSERT_TRUE(pa && pb);
  for (std::size_t i = 0; i < pa->values.size(); ++i)
    EXPECT_NEAR(pa->values[i], pb->values[i], 1e-3f * (1 + std::abs(pa->values[i])));
}

// --- sequences
// -----------------------------------------------------------------------------------------------------

TEST_F(Cli, FramesWriteOneFileEach) {
  ASSERT_EQ(render({"-o", "a.exr", "-o", "b.##.png", "-o", "c_%03d.exr", "--frames", "8-12x2", "--fps", "10"})
                .status,
            0);
  EXPECT_EQ(folder_.entries(),
            (std::vector<std::string>{"a.0008.exr", "a.0010.exr", "a.0012.exr", "b.08.png", "b.10.png",
                                      "b.12.png", "c_008.exr", "c_010.exr", "c_012.exr"}));
  const Settings settings = receipt_of("a.0012.exr").settings;
  EXPECT_EQ(settings.frame, 12);
  EXPECT_DOUBLE_EQ(settings.time, 1.2);
}

TEST_F(Cli, ExistingFramesAreLeftOutOnRequest) {
  std::ofstream(folder_ / "a.0001.exr") << "mine";
  ASSERT_EQ(render({"-o", "a.exr", "--frames", "0-2", "--skip-existing"}).status, 0);
  EXPECT_EQ(folder_.entries().size(), 3u);
  EXPECT_EQ(read_text(folder_ / "a.0001.exr"), "mine");
}

TEST_F(Cli, AnimatedScenesChangeFromFrameToFrame) {
  const Outcome outcome = run({"render", "cornell-lights?solids=2", "--size", "32x32", "--spp", "1",
                               "--quiet", "--disable-pixel-jitter", "--frames", "0-12x12", "-o", "a.exr"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Image first = read_image(folder_ / "a.0000.exr"), second = read_image(folder_ / "a.0012.exr");
  EXPECT_NE(first.find("Z")->values, second.find("Z")->values);
}

// --- receipts
// ------------------------------------------------------------------------------------------------------

TEST_F(Cli, RerunReproducesEveryLayerBitForBit) {
  ASSERT_EQ(render({"-o", "a.exr", "--spp", "3", "--seed", "7", "--preset", "path", "--light-scale", "0.3",
                    "--environment", "0.1,0.2,0.3", "-t", "2"})
                .status,
            0);
  const Outcome outcome = run({"rerun", "a.exr", "--check", "-o", "b.exr", "-t", "3"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  expect_same_pixels(read_image(folder_ / "a.exr"), read_image(folder_ / "b.exr"));
  EXPECT_EQ(folder_.entries(), (std::vector<std::string>{"a.exr", "b.exr"}));
}

TEST_F(Cli, RerunNoticesOtherPixels) {
  ASSERT_EQ(render({"-o", "a.exr"}).status, 0);
  Image image = read_image(folder_ / "a.exr");
  image.layers[0].values[5] += 1;
  write_image(image, folder_ / "a.exr");
  const Outcome outcome = run({"rerun", "a.exr", "--check", "-q"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("1 values of 'a.exr' were not reproduced"), std::string::npos) << outcome.err;
}

void write_quad(const fs::path& file, const char* corner) {
  std::ofstream(file) << "v 0 0 0\nv 1 0 0\nv " << corner << "\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
}

TEST_F(Cli, RerunRefusesAChangedScene) {
  write_quad(folder_ / "quad.obj", "1 1 0");
  ASSERT_EQ(run({"render", "quad.obj", "--size", "8x8", "-o", "a.exr", "-q"}).status, 0);
  EXPECT_EQ(run({"rerun", "a.exr", "--check", "-q"}).status, 0);
  write_quad(folder_ / "quad.obj", "1 2 0");
  const Outcome refused = run({"rerun", "a.exr", "--check", "-q"});
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("has changed"), std::string::npos) << refused.err;
  EXPECT_EQ(run({"rerun", "a.exr", "-o", "b.exr", "-q", "--force"}).status, 0);
}

// --- Ctrl-C
// --------------------------------------------------------------------------------------------------------

// The tool as a process of its own, with its output in files.
pid_t start_tool(const std::string& arguments, const fs::path& out, const fs::path& err) {
  const std::string command =
      fmt::format("exec '{}' {} >'{}' 2>'{}'", LUMIGROVE_TOOL, arguments, out.string(), err.string());
  const pid_t child = fork();
  if (child == 0) {
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  return child;
}

TEST_F(Cli, LostOutputIsAFailure) {
  const fs::path err = folder_ / "err";
  int status = 0;
  ASSERT_NE(waitpid(start_tool("list settings", "/dev/full", err), &status, 0), -1);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_TRUE(is_one_line(read_text(err))) << read_text(err);
}

TEST_F(Cli, InterruptKeepsTheFinishedSamples) {
  constexpr int kAsked = 16000000;
  const fs::path out = folder_ / "out", err = folder_ / "err", image = folder_ / "a.exr";
  const pid_t child = start_tool(
      fmt::format("render single --size 16x8 --spp {} -o '{}' --progress json", kAsked, image.string()), out,
      err);
  int status = 0;
  pid_t ended = 0;
  while (ended == 0 && read_text(err).find("spp_done") == std::string::npos) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ended = waitpid(child, &status, WNOHANG);
  }
  ASSERT_EQ(ended, 0) << read_text(err);
  kill(child, SIGINT);
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 128 + SIGINT);
  EXPECT_NE(read_text(err).find("interrupted"), std::string::npos) << read_text(err);
  const Receipt receipt = receipt_of("a.exr");
  EXPECT_GE(receipt.spp_done, 1);
  EXPECT_LT(receipt.spp_done, kAsked);
  EXPECT_EQ(receipt.settings.spp, kAsked);
  EXPECT_EQ(run({"rerun", "a.exr", "--check", "-q"}).status, 0);
}

}  // namespace
}  // namespace lumigrove
