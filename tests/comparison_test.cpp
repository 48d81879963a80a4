// `lumigrove compare SCENE --methods ...`: what its folder holds, and what happens when something goes wrong.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "method_spec.h"
#include "results.h"
#include "tool_runner.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

class MethodComparison : public ToolTest {
 protected:
  // compare single ARGUMENTS into the folder "c"
  Outcome compare(std::vector<std::string> more) const {
    std::vector<std::string> words{"compare", "single", "--size", "48x32", "-o", "c", "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  Results results() const { return read_results(folder_ / "c"); }
  bool has_report() const { return fs::exists(folder_ / "c" / "report.html"); }
};

std::vector<std::string> words_of(const std::string& command) {
  std::istringstream stream(command);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

TEST_F(MethodComparison, EveryMethodHasEverySeedAtBothBudgets) {
  const Outcome outcome = compare({"--methods", "tree,uniform,four=tree:direct.spp=4", "--budget", "4spp", "--seeds", "2",
                                   "--reference-budget", "16spp"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Results r = results();
  EXPECT_TRUE(r.complete);
  EXPECT_EQ(r.budget_spp, 4);
  EXPECT_GT(r.budget_s, 0);
  ASSERT_EQ(r.methods.size(), 3u);
  EXPECT_EQ(r.methods[2].name, "four");
  ASSERT_EQ(r.runs.size(), 6u);
  for (const lumigrove::Run& run : r.runs) {
    EXPECT_TRUE(run.complete);
    EXPECT_EQ(run.stage(Budget::kSamples).spp, 4);
    for (const Budget budget : kBudgets) {
      EXPECT_GE(run.stage(budget).spp, 1);
      EXPECT_GT(run.stage(budget).rays, 0);
      EXPECT_TRUE(fs::exists(folder_ / "c" / run.stage(budget).file));
      for (const double error : run.stage(budget).errors) EXPECT_TRUE(std::isfinite(error));
    }
    ASSERT_GE(run.curve.size(), 3u);  // 1, 2, 4, and the time budget if it lies elsewhere
    EXPECT_EQ(run.curve.front().spp, 1);
    EXPECT_GT(run.sample_ms, 0);
    EXPECT_FALSE(run.passes.empty());
  }
  EXPECT_TRUE(has_report());
}

// But for emission seen directly, which is that of the reference.
TEST_F(MethodComparison, ItsCommandsRenderTheSameLight) {
  ASSERT_EQ(compare({"--methods", "tree:direct.width=4", "--budget", "3spp", "--seeds", "1", "--seed", "7", "--set",
                     "light_scale=2", "--reference-budget", "2spp"})
                .status,
            0);
  const Results r = results();
  std::vector<std::string> words = words_of(r.methods[0].commands[static_cast<std::size_t>(Budget::kSamples)]);
  ASSERT_GT(words.size(), 3u);
  words.erase(words.begin());  // "lumigrove"
  words.push_back("--quiet");
  const Outcome outcome = run(words);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Image again = read_image(folder_ / words[words.size() - 2]);
  const Image stored = read_image(folder_ / "c" / r.runs[0].stage(Budget::kSamples).file);
  EXPECT_EQ(rgb_of(again, "direct", "again").rgb, rgb_of(stored, "direct", "stored").rgb);
}

TEST_F(MethodComparison, ItsNumbersAreThoseOfTheImageFiles) {
  ASSERT_EQ(compare({"--methods", "tree", "--budget", "2spp", "--seeds", "1", "--reference-budget", "4spp"}).status, 0);
  const Results r = results();
  const auto load = [&](const std::string& file) { return rgb_of(read_image(folder_ / "c" / file), "", file); };
  const Comparison files =
      compare_images(load(r.references.at(0).file), load(r.runs[0].stage(Budget::kSamples).file), {});
  const Errors& errors = r.runs[0].stage(Budget::kSamples).errors;
  for (const MetricInfo& info : metrics())  // up to the rounding of half floats
    EXPECT_NEAR(errors[static_cast<std::size_t>(info.metric)], files.value(info.metric), 2e-3 * files.value(info.metric));
}

// The reference's own error, from the difference of its halves, against the true one: a reference of 4096 samples.
TEST_F(MethodComparison, TheReferenceKnowsHowWrongItIs) {
  const auto reference = [&](const char* budget) {
    EXPECT_EQ(compare({"--methods", "tree", "--budget", "1spp", "--seeds", "1", "--reference-budget", budget, "--force"}).status,
              0);
    return results().references.at(0);
  };
  const auto image = [&](const Reference& r) { return rgb_of(read_image(folder_ / "c" / r.file), "", r.file); };
  const Reference coarse = reference("8spp");
  const RgbImage noisy = image(coarse);
  const double true_error = rmse(image(reference("2048spp")), noisy);
  EXPECT_NEAR(coarse.errors[0] / true_error, 1, 0.2);  // 1536 pixels: about 3 % of standard error, and fat tails
}

TEST_F(MethodComparison, AMethodThatFailsIsARowThatSaysWhy) {
  const Outcome outcome = compare({"--methods", "tree,pool:direct.mis=true", "--budget", "1spp", "--seeds", "1",
                                   "--reference-budget", "2spp"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Results r = results();
  EXPECT_NE(r.methods[1].failure.find("direct.mis does not combine with pools"), std::string::npos);
  EXPECT_EQ(r.runs.size(), 1u);
  std::ifstream page(folder_ / "c" / "report.html");
  const std::string text((std::istreambuf_iterator<char>(page)), {});
  EXPECT_NE(text.find("direct.mis does not combine with pools"), std::string::npos);
}

TEST_F(MethodComparison, AnInterruptLeavesAReportAndCanBeResumed) {
  const std::vector<std::string> words{"--methods", "tree,uniform", "--budget", "0.3s,2spp", "--seeds", "3",
                                       "--reference-budget", "2spp"};
  std::thread ctrl_c([] {
    std::this_thread::sleep_for(std::chrono::milliseconds(900));
    kill(getpid(), SIGINT);
  });
  const Outcome outcome = compare(words);
  ctrl_c.join();
  ASSERT_EQ(outcome.status, 128 + SIGINT) << outcome.err;
  EXPECT_TRUE(has_report());
  const Results partial = results();
  EXPECT_FALSE(partial.complete);
  EXPECT_LT(partial.runs.size(), 6u);
  EXPECT_EQ(compare(words).status, 1);  // the folder holds a comparison already

  std::vector<std::string> again = words;
  again.push_back("--resume");
  const Outcome resumed = compare(again);
  ASSERT_EQ(resumed.status, 0) << resumed.err;
  const Results whole = results();
  EXPECT_TRUE(whole.complete);
  EXPECT_EQ(whole.runs.size(), 6u);
  const auto first_complete = [](const Results& r) {
    for (const lumigrove::Run& run : r.runs)
      if (run.complete) return run.sample_ms;
    return 0.0;
  };
  if (first_complete(partial) > 0) {  // not measured again
    EXPECT_EQ(first_complete(whole), first_complete(partial));
  }
}

TEST_F(MethodComparison, ResumeAddsSeedsAndRefusesAnotherComparison) {
  const std::vector<std::string> words{"--methods", "tree", "--budget", "0.01s,1spp", "--reference-budget", "2spp", "--resume"};
  EXPECT_EQ(compare({"--methods", "tree", "--budget", "0.01s,1spp", "--reference-budget", "2spp", "--seeds", "1"}).status, 0);
  std::vector<std::string> more = words;
  more.insert(more.end(), {"--seeds", "3"});
  EXPECT_EQ(compare(more).status, 0);
  EXPECT_EQ(results().runs.size(), 3u);
  more.insert(more.end(), {"--light-scale", "2"});
  const Outcome refused = compare(more);
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("cannot be resumed: the settings of a method"), std::string::npos) << refused.err;
}

TEST_F(MethodComparison, SequencesHaveAReferenceAndChangesOfEveryFrame) {
  const Outcome outcome = run({"compare", "cornell-lights?solids=1", "--size", "32x18", "-o", "c", "--quiet", "--methods",
                               "tree", "--budget", "0.01s,2spp", "--seeds", "2", "--frames", "0-2", "--reference-budget", "2spp"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Results r = results();
  EXPECT_EQ(r.frames, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(r.references.size(), 3u);
  EXPECT_EQ(r.runs.size(), 6u);
  EXPECT_EQ(r.changes.size(), 8u);  // 2 seeds, 2 budgets, 2 steps
  for (const FrameChange& change : r.changes) EXPECT_GT(change.error, 0);
}

// A method with indirect light and one without are measured on what they find.
TEST_F(MethodComparison, DirectLightIsMeasuredAgainstDirectLight) {
  ASSERT_EQ(compare({"--methods", "tree,path", "--budget", "16spp", "--seeds", "1", "--reference-budget", "256spp",
                     "--reference-method", "path,tree"})
                .status,
            0);
  const Results r = results();
  EXPECT_EQ(r.methods[0].light, "direct light");
  EXPECT_EQ(r.methods[1].light, "all light");
  ASSERT_EQ(r.references.size(), 2u);
  for (const Reference& reference : r.references)
    EXPECT_TRUE(reference.origin.starts_with(reference.light == "direct light" ? "tree" : "path")) << reference.origin;
  const auto mean = [&](const std::string& file) {
    const RgbImage image = rgb_of(read_image(folder_ / "c" / file), "", file);
    double sum = 0;
    for (const float value : image.rgb) sum += static_cast<double>(value);
    return sum / static_cast<double>(image.rgb.size());
  };
  EXPECT_NEAR(mean(r.references[r.references[0].light == "direct light" ? 0 : 1].file) / mean(r.runs[0].stage(Budget::kSamples).file), 1, 0.02);
}

// Emission seen directly is the same in all images, so that only what methods do is measured.
TEST_F(MethodComparison, EmissionSeenDirectlyIsTheReferences) {
  const Outcome outcome = run({"compare", "cornell-lights?solids=2", "--size", "32x18", "-o", "c", "--quiet", "--methods",
                               "tree", "--budget", "1spp", "--seeds", "1", "--reference-budget", "4spp"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Results r = results();
  const Image picture = read_image(folder_ / "c" / r.runs[0].stage(Budget::kSamples).file);
  const Image reference = read_image(folder_ / "c" / r.references[0].file);
  const RgbImage shown = rgb_of(picture, "", "picture"), direct = rgb_of(picture, "direct", "picture"),
                 emission = rgb_of(reference, "emission", "reference");
  double brightest = 0;
  for (std::size_t i = 0; i < shown.rgb.size(); ++i) {
    EXPECT_NEAR(shown.rgb[i], direct.rgb[i] + emission.rgb[i], 2e-3f * (1 + shown.rgb[i]));
    brightest = std::max(brightest, static_cast<double>(emission.rgb[i]));
  }
  EXPECT_GT(brightest, 0);
}

struct Slip {
  std::vector<std::string> words;
  std::string part;
};

TEST_F(MethodComparison, SlipsGetOneSentence) {
  const std::vector<Slip> slips = {
      {{"compare", "single", "--methods", "tree"}, "needs a --budget"},
      {{"compare", "single", "--methods", "tre", "--budget", "1spp"}, "unknown method 'tre'"},
      {{"compare", "single", "--methods", "tree,tree", "--budget", "1spp"}, "named twice"},
      {{"compare", "single", "--methods", "tree,,path", "--budget", "1spp"}, "names no method"},
      {{"compare", "single", "--methods", "tree", "--budget", "10"}, "must be a time or a number of samples"},
      {{"compare", "single", "--methods", "tree", "--budget", "1s,2s"}, "twice"},
      {{"compare", "single", "--methods", "tree", "--budget", "1spp", "--spp", "4"}, "--budget 4spp"},
      {{"compare", "single", "--methods", "tree", "--budget", "1spp", "--preset", "tree"}, "--preset has no place"},
      {{"compare", "single", "--methods", "path", "--budget", "1spp", "--reference-method", "tree"}, "direct light only"},
      {{"compare", "single", "--methods", "tree:direct.spp=0", "--budget", "1spp"}, "direct.spp is '0'"},
      {{"compare", "single", "--methods", "tree", "--budget", "1spp", "--resume", "-o", "nothing"}, "holds no comparison"},
      {{"compare", "single", "--methods", "tree", "--budget", "1spp", "-r", "absent.exr"}, "absent.exr"},
      {{"compare", "absent.glb", "--methods", "tree", "--budget", "1spp"}, "absent.glb"},
      {{"compare", "single", "--budget", "1spp"}, "--methods"},
      {{"compare", "single"}, "not an image"},
  };
  for (const Slip& slip : slips) {
    const Outcome outcome = run(slip.words);
    EXPECT_NE(outcome.status, 0);
    EXPECT_NE(outcome.err.find(slip.part), std::string::npos) << slip.part << "\n" << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
  EXPECT_FALSE(fs::exists(folder_ / "compare-single" / "report.html"));
}

TEST(MethodSpec, TakesNamesAndSettingsApart) {
  const std::vector<MethodSpec> specs = parse_methods({"tree,b=tree:direct.width=2:direct.spp=4", "path"});
  ASSERT_EQ(specs.size(), 3u);
  EXPECT_EQ(specs[1].name, "b");
  EXPECT_EQ(specs[1].preset, "tree");
  EXPECT_EQ(specs[1].values, (SettingValues{{"direct.width", "2"}, {"direct.spp", "4"}}));
  EXPECT_EQ(parse_budget("--budget", {"1.5min", "64spp"}).seconds, 90);
  EXPECT_EQ(parse_budget("--budget", {"250s,64spp"}).spp, 64);
}

}  // namespace
}  // namespace lumigrove
