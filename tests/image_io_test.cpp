#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "lumigrove/image.h"
#include "temp_folder.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 7, kHeight = 5;  // odd sizes: no alignment helps
constexpr std::size_t kPixels = kWidth * kHeight;

class ImageIo : public testing::Test {
 protected:
  bool folder_is_empty() const { return folder_.entries().empty(); }

  const TempFolder folder_;
};

// Values that a half float cannot hold exactly, different in every channel.
Layer value_layer(const std::string& name, std::vector<std::string> channels) {
  Layer layer{name, std::move(channels), {}, {}};
  for (std::size_t i = 0; i < kPixels * layer.channels.size(); ++i)
    layer.values.push_back(0.1f + 0.37f * static_cast<float>(i) + static_cast<float>(name.size()));
  return layer;
}

Layer id_layer(const std::string& name) {
  Layer layer{name, {"id"}, {}, {}};
  for (std::size_t i = 0; i < kPixels; ++i)
    layer.ids.push_back(i == 3 ? 0xffffffffu : 0xfffff000u + static_cast<std::uint32_t>(i));
  return layer;
}

Image full_image() {
  Image image{kWidth, kHeight, {}, {}};
  image.layers.push_back(value_layer("", {"R", "G", "B", "A"}));
  for (const char* name : {"albedo", "direct", "indirect", "emission", "variance"})
    image.layers.push_back(value_layer(name, {"R", "G", "B"}));
  for (const char* name : {"N", "P"}) image.layers.push_back(value_layer(name, {"X", "Y", "Z"}));
  image.layers.push_back(value_layer("Z", {"Z"}));
  image.layers.push_back(id_layer("emitter"));
  image.layers.push_back(id_layer("instance"));
  image.metadata["settings"] = "spp = 4\n[direct]\nselection = \"root\"\n";
  image.metadata["seed"] = "7";
  return image;
}

Image color_image(const std::vector<float>& rgb, int width, int height) {
  return {width, height, {{"", {"R", "G", "B"}, rgb, {}}}, {}};
}

TEST_F(ImageIo, ExrGivesBackEveryLayer) {
  const Image image = full_image();
  write_image(image, folder_ / "a.exr");
  const Image read = read_image(folder_ / "a.exr");
  EXPECT_EQ(read.width, kWidth);
  EXPECT_EQ(read.height, kHeight);
  ASSERT_EQ(read.layers.size(), image.layers.size());
  EXPECT_EQ(read.layers.front().name, "");
  for (const Layer& layer : image.layers) {
    SCOPED_TRACE("layer '" + layer.name + "'");
    const Layer* found = read.find(layer.name);
    ASSERT_NE(found, nullptr);
    EXPECT_EQ(found->channels, layer.channels);
    EXPECT_EQ(found->ids, layer.ids);
    ASSERT_EQ(found->values.size(), layer.values.size());
    const bool exact = layer.name == "P" || layer.name == "Z" || layer.name == "variance";
    for (std::size_t i = 0; i < layer.values.size(); ++i)
      // Half floats have 11 significant bits: rounding errs by at most 2^-11 of the value.
      EXPECT_NEAR(found->values[i], layer.values[i], exact ? 0.0f : layer.values[i] * 0x1p-11f) << i;
  }
}

TEST_F(ImageIo, ExrAndPngKeepTheMetadata) {
  const Image image = full_image();
  for (const char* name : {"a.exr", "a.png"}) {
    write_image(image, folder_ / name);
    EXPECT_EQ(read_image(folder_ / name).metadata, image.metadata) << name;
  }
}

TEST_F(ImageIo, ValuesBeyondHalfRangeAreKeptAsFloats) {
  write_image(color_image({1e6f, 0.1f, 3, 70000, -1e9f, 0}, 2, 1), folder_ / "a.exr");
  EXPECT_EQ(read_image(folder_ / "a.exr").find("")->values,
            (std::vector<float>{1e6f, 0.1f, 3, 70000, -1e9f, 0}));
}

TEST_F(ImageIo, ExrKeepsNanAndInfinity) {
  const float inf = std::numeric_limits<float>::infinity();
  write_image(color_image({std::nanf(""), inf, -inf}, 1, 1), folder_ / "a.exr");
  const std::vector<float> values = read_image(folder_ / "a.exr").find("")->values;
  EXPECT_TRUE(std::isnan(values[0]));
  EXPECT_EQ(values[1], inf);
  EXPECT_EQ(values[2], -inf);
}

TEST_F(ImageIo, SamePixelsMakeTheSameFile) {
  const auto bytes_of = [&](const char* name) {
    write_image(full_image(), folder_ / name);
    std::ifstream in(folder_ / name, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_EQ(bytes_of("a.exr"), bytes_of("b.exr"));
  EXPECT_EQ(bytes_of("a.png"), bytes_of("b.png"));
}

TEST_F(ImageIo, PngHoldsTheToneMappedBeautyAndReadsBackLinear) {
  const std::vector<float> rgb = {0, 0.18f, 1, 0.5f, 0.25f, 4, std::nanf(""), -1, 1e30f};
  const ToneMap tone{0, ToneCurve::kSrgb};
  write_image(color_image(rgb, 3, 1), folder_ / "a.png", tone);
  const std::vector<float> values = read_image(folder_ / "a.png").find("")->values;
  const std::vector<float> shown = {0, 0.18f, 1, 0.5f, 0.25f, 1, 0, 0, 1};
  ASSERT_EQ(values.size(), shown.size());
  // Half an 8-bit step times the steepest slope of the decoding curve (2.4/1.055 at 1).
  for (std::size_t i = 0; i < shown.size(); ++i) EXPECT_NEAR(values[i], shown[i], 0.5 / 255 * 2.28) << i;
}

TEST_F(ImageIo, JpegIsWrittenAndReadBack) {
  write_image(color_image(std::vector<float>(16 * 16 * 3, 0.5f), 16, 16), folder_ / "a.jpg",
              {0, ToneCurve::kSrgb});
  const Image read = read_image(folder_ / "a.jpg");
  for (float value : read.find("")->values) EXPECT_NEAR(value, 0.5f, 0.02f);
}

TEST_F(ImageIo, UnknownExtensionListsTheValidOnes) {
  for (const char* name : {"a.tif", "a", "a.exr.bak"}) {
    const std::string message = error_of([&] { write_image(full_image(), folder_ / name); });
    EXPECT_NE(message.find(name), std::string::npos) << message;
    EXPECT_NE(message.find(".exr, .png, .jpg and .jpeg"), std::string::npos) << message;
  }
  EXPECT_TRUE(folder_is_empty());
}

TEST_F(ImageIo, UnwritablePlacesAreNamedAndNothingIsLeft) {
  fs::create_directories(folder_ / "taken.exr");
  for (const fs::path& file :
       {folder_ / "missing" / "a.exr", folder_ / "taken.exr", fs::path("/proc/a.exr")}) {
    EXPECT_NE(error_of([&] { write_image(full_image(), file); }).find(file.string()), std::string::npos)
        << file;
  }
  fs::remove(folder_ / "taken.exr");
  EXPECT_TRUE(folder_is_empty());
}

TEST_F(ImageIo, ImagesThatMakeNoSenseAreRefused) {
  const fs::path file = folder_ / "a.exr";
  EXPECT_NE(error_of([&] { write_image({}, file); }), "");
  EXPECT_NE(error_of([&] { write_image({2, 2, {}, {}}, file); }), "");
  EXPECT_NE(error_of([&] { write_image(color_image({1, 2, 3}, 2, 2), file); }), "");
  EXPECT_NE(error_of([&] { write_image({1, 1, {value_layer("Z", {"Z"})}, {}}, folder_ / "a.png"); }), "");
  EXPECT_TRUE(folder_is_empty());
}

TEST_F(ImageIo, MissingTruncatedAndForeignFilesAreRefusedWithOneSentence) {
  write_image(full_image(), folder_ / "whole.exr");
  write_image(full_image(), folder_ / "whole.png");
  for (const char* name : {"whole.exr", "whole.png"}) {
    std::ifstream in(folder_ / name, std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(in), {});
    for (std::size_t size : {std::size_t{0}, std::size_t{9}, bytes.size() / 2}) {
      const fs::path cut = folder_ / (std::string("cut") + fs::path(name).extension().string());
      std::ofstream(cut, std::ios::binary) << bytes.substr(0, size);
      const std::string message = error_of([&] { read_image(cut); });
      EXPECT_NE(message.find(cut.string()), std::string::npos)
          << name << " cut to " << size << ": " << message;
      EXPECT_EQ(message.find('\n'), std::string::npos);
    }
  }
  std::ofstream(folder_ / "text.exr") << "not an image";
  for (const char* name : {"text.exr", "missing.exr", ""})
    EXPECT_NE(error_of([&] { read_image(folder_ / name); }).find((folder_ / name).string()),
              std::string::npos);
}

// Narkowicz' fit by hand at x = 0.6: 0.6*(2.51*0.6+0.03) / (0.6*(2.43*0.6+0.59)+0.14) = 0.9216/1.3688 =
// 0.67329.
TEST(ToneMap, FilmicMatchesThePublishedFit) {
  const double display = 0.9216 / 1.3688, encoded = 1.055 * std::pow(display, 1 / 2.4) - 0.055;
  EXPECT_NEAR(tone_map({1, 1, 1}, {}).front(), encoded, 1e-6);
}

TEST(ToneMap, RisesWithTheInputAndStaysInRange) {
  for (ToneCurve curve : {ToneCurve::kFilmic, ToneCurve::kSrgb}) {
    float last = -1;
    for (float ev = -20; ev < 40; ev += 0.5f) {
      const float encoded = tone_map({1, 1, 1}, {ev, curve}).front();
      EXPECT_GE(encoded, last);
      EXPECT_LE(encoded, 1);
      last = encoded;
    }
    EXPECT_EQ(last, 1);
  }
}

TEST(ToneMap, ExposureIsAPowerOfTwoGain) {
  EXPECT_EQ(tone_map({0.1f, 0.2f, 0.3f}, {1, ToneCurve::kFilmic}), tone_map({0.2f, 0.4f, 0.6f}, {}));
}

TEST(ToneMap, NonFiniteValuesAreShownBlackOrWhite) {
  const float inf = std::numeric_limits<float>::infinity();
  for (ToneCurve curve : {ToneCurve::kFilmic, ToneCurve::kSrgb})
    EXPECT_EQ(tone_map({std::nanf(""), -inf, inf}, {0, curve}), (std::vector<float>{0, 0, 1}));
}

TEST(ToneMap, UnknownCurveListsTheValidOnes) {
  EXPECT_EQ(tone_curve_from_name("srgb"), ToneCurve::kSrgb);
  EXPECT_EQ(tone_curve_from_name("filmic"), ToneCurve::kFilmic);
  EXPECT_NE(error_of([] { tone_curve_from_name("aces"); }).find("filmic and srgb"), std::string::npos);
}

}  // namespace
}  // namespace lumigrove
