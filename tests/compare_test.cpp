#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "image/difference.h"
#include "tool_runner.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

class Compare : public ToolTest {
 protected:
  void SetUp() override {
    write("ref.exr", 1);
    write("same.exr", 1);
    write("near.exr", 1.1f);
    write("far.exr", 2);
  }

  // A ramp times `gain`, 24x16 pixels, with a `direct` layer of half its light.
  void write(const std::string& name, float gain, int width = 24) const {
    Image image{width, 16, {{"", {"R", "G", "B"}, {}, {}}, {"direct", {"R", "G", "B"}, {}, {}}}, {}};
    for (int i = 0; i < width * 16 * 3; ++i) {
      const float value = gain * static_cast<float>(i % 97) / 64;
      image.layers[0].values.push_back(value);
      image.layers[1].values.push_back(0.5f * value);
    }
    write_image(image, folder_ / name);
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  // compare -r ref.exr ARGUMENTS
  Outcome run(const std::vector<std::string>& arguments) const {
    std::vector<std::string> words{"compare", "-r", path("ref.exr")};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return ToolTest::run(words);
  }
};

TEST_F(Compare, PrintsEveryMetricOfEveryImageAndTheFormulas) {
  const Outcome outcome = run({path("near.exr"), path("far.exr")});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  for (const MetricInfo& info : metrics()) {
    EXPECT_NE(outcome.out.find(info.label), std::string::npos);
    EXPECT_NE(outcome.out.find(info.formula), std::string::npos);
  }
  EXPECT_NE(outcome.out.find(path("near.exr")), std::string::npos);
  EXPECT_NE(outcome.out.find(path("far.exr")), std::string::npos);
}

TEST_F(Compare, JsonHoldsTheSameNumbersAsTheLibrary) {
  const Outcome outcome =
      run({path("same.exr"), path("far.exr"), "--json", "--exposure", "-1", "--tone", "srgb"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  const Comparison far =
      compare_images(rgb_of(read_image(path("ref.exr")), "", "r"),
                     rgb_of(read_image(path("far.exr")), "", "t"), {{-1, ToneCurve::kSrgb}});
  for (const MetricInfo& info : metrics()) {
    EXPECT_EQ(json["images"][1][info.key].get<double>(), far.value(info.metric)) << info.key;
    EXPECT_EQ(json["formulas"][info.key].get<std::string>(), info.formula);
  }
  EXPECT_EQ(json["images"][0]["rmse"].get<double>(), 0);
}

TEST_F(Compare, LayersAreComparedByName) {
  const auto rmse_of = [&](const std::vector<std::string>& arguments) {
    return nlohmann::json::parse(run(arguments).out)["images"][0]["rmse"].get<double>();
  };
  const double beauty = rmse_of({path("far.exr"), "--json"});
  EXPECT_NEAR(rmse_of({path("far.exr"), "--json", "--layer", "direct"}), beauty / 2, 1e-3 * beauty);
  const Outcome missing = run({path("far.exr"), "--layer", "N"});
  EXPECT_EQ(missing.status, 1);
  EXPECT_NE(missing.err.find("N.R"), std::string::npos);
}

TEST_F(Compare, BrokenLimitsAreNamedAndChangeTheStatus) {
  const Outcome kept = run({path("near.exr"), "--fail-above", "rmse=10", "--fail-below", "ssim=0.1"});
  EXPECT_EQ(kept.status, 0) << kept.err;
  EXPECT_EQ(kept.err, "");
  const Outcome broken = run({path("same.exr"), path("far.exr"), "--fail-above", "rmse=0.01", "--fail-above",
                              "flip=1", "--fail-below", "ssim=0.9999"});
  EXPECT_EQ(broken.status, 3);
  EXPECT_NE(broken.err.find(path("far.exr") + ": RMSE"), std::string::npos) << broken.err;
  EXPECT_NE(broken.err.find(path("far.exr") + ": SSIM"), std::string::npos) << broken.err;
  EXPECT_EQ(broken.err.find("FLIP"), std::string::npos) << broken.err;
  EXPECT_EQ(broken.err.find(path("same.exr")), std::string::npos) << broken.err;
}

TEST_F(Compare, AnUndefinedMetricKeepsNoLimit) {
  write("ref.exr", 1, 8);  // narrower than the window of SSIM
  const Outcome outcome = run({path("ref.exr"), "--fail-below", "ssim=0"});
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.out.find("undefined"), std::string::npos);
}

TEST_F(Compare, WrongLimitsAreRefusedWithASentence) {
  const auto sentence = [&](const std::string& option, const std::string& limit) {
    const Outcome outcome = run({path("same.exr"), option, limit});
    EXPECT_EQ(outcome.status, 2) << limit;
    return outcome.err;
  };
  EXPECT_NE(sentence("--fail-above", "psnr=3").find("rmse, relmse, ssim, flip"), std::string::npos);
  EXPECT_NE(sentence("--fail-above", "rmse").find("METRIC=VALUE"), std::string::npos);
  EXPECT_NE(sentence("--fail-above", "rmse=").find("not a number"), std::string::npos);
  EXPECT_NE(sentence("--fail-above", "rmse=1x").find("'1x'"), std::string::npos);
  EXPECT_NE(sentence("--fail-above", "rmse=nan").find("not a number"), std::string::npos);
  EXPECT_NE(sentence("--fail-above", "ssim=0.9").find("--fail-below"), std::string::npos);
  EXPECT_NE(sentence("--fail-below", "flip=0.9").find("--fail-above"), std::string::npos);
}

TEST_F(Compare, DifferentSizesAndMissingFilesAreErrors) {
  write("wide.exr", 1, 25);
  const Outcome sizes = run({path("wide.exr")});
  EXPECT_EQ(sizes.status, 1);
  EXPECT_NE(sizes.err.find("25x16"), std::string::npos) << sizes.err;
  const Outcome missing = run({path("missing.exr")});
  EXPECT_EQ(missing.status, 1);
  EXPECT_NE(missing.err.find("missing.exr"), std::string::npos);
  EXPECT_EQ(run({}).status, 2);
}

TEST_F(Compare, WritesThreePicturesForEachImageUnderDifferentNames) {
  fs::create_directories(folder_ / "other");
  write("other/far.exr", 0.5f);
  const Outcome outcome = run({path("far.exr"), path("other/far.exr"), "-o", path("pictures")});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  for (const char* stem : {"far", "far-2"})
    for (const char* kind : {"signed", "absolute", "flip"}) {
      const Image picture = read_image(folder_ / "pictures" / (std::string(stem) + "-" + kind + ".png"));
      EXPECT_EQ(picture.width, 24);
      EXPECT_EQ(picture.height, 16);
    }
  EXPECT_EQ(run({path("far.exr"), "-o", path("ref.exr")}).status, 1);
}

TEST(Difference, SignedIsBlueWhereDarkerRedWhereBrighterWhiteWhereEqual) {
  const RgbImage reference{4, 1, {1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0}, "r"};
  const RgbImage test{4, 1, {0, 0, 0, 1, 1, 1, 3, 3, 3, 0, 0, 0}, "t"};
  const std::vector<float> picture = signed_difference(reference, test);
  EXPECT_GT(picture[2], picture[0]);
  for (std::size_t i : {3u, 4u, 5u, 9u, 10u, 11u}) EXPECT_EQ(picture[i], 1);
  EXPECT_GT(picture[6], picture[8]);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(picture[6 + c], blue_white_red(0.5f)[static_cast<int>(c)], 1e-6f);
}

TEST(Difference, AbsoluteIsToneMapped) {
  const RgbImage reference{1, 1, {1, 0.5f, 0}, "r"}, test{1, 1, {0.5f, 1, 0}, "t"};
  const ToneMap tone{1, ToneCurve::kFilmic};
  EXPECT_EQ(absolute_difference(reference, test, tone), tone_map({0.5f, 0.5f, 0}, tone));
}

// Entries 0, 64, 128, 192 and 255 of matplotlib's table.
TEST(Difference, HeatMapIsCloseToMagma) {
  const float entry[] = {0, 64, 128, 192, 255};
  const vec3 expected[] = {{0.0015f, 0.0005f, 0.0139f},
                           {0.3167f, 0.0717f, 0.4854f},
                           {0.7164f, 0.2150f, 0.4753f},
                           {0.9867f, 0.5356f, 0.3822f},
                           {0.9871f, 0.9914f, 0.7495f}};
  for (int i = 0; i < 5; ++i)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(magma(entry[i] / 255)[c], expected[i][c], 0.024f) << i << ' ' << c;
  EXPECT_EQ(heat_map({0.25f}).size(), 3u);
}

TEST(Difference, PicturesAreWrittenAsTheyAre) {
  const fs::path file =
      fs::path(testing::TempDir()) / ("lumigrove_picture_" + std::to_string(getpid()) + ".png");
  std::vector<float> picture;
  for (int i = 0; i < 255; ++i) picture.push_back(static_cast<float>(i) / 255);
  write_picture(picture, 85, 1, file);
  const RgbImage read = rgb_of(read_image(file), "", "picture");
  const std::vector<float> shown = tone_map(read.rgb, {0, ToneCurve::kSrgb});
  for (std::size_t i = 0; i < picture.size(); ++i) EXPECT_NEAR(shown[i], picture[i], 1e-5f);
  fs::remove(file);
}

}  // namespace
}  // namespace lumigrove
