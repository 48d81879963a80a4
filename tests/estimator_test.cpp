#include "frame/estimator.h"

#include <gtest/gtest.h>

#include <map>
#include <sstream>

namespace lumigrove {
namespace {

using Changes = std::vector<std::pair<std::string, std::string>>;

std::string label_of(Settings settings, const Changes& changes = {}) {
  for (const auto& [key, value] : changes) set_value(settings, key, value);
  check(settings);
  return estimator_text(estimator_label(settings));
}

// Virtual point lights whose every bias is turned off.
Settings exact_vpls() {
  Settings settings = make_preset("slc");
  set_value(settings, "force_diffuse", "true");
  set_value(settings, "indirect.clamp", "0");
  return settings;
}
const std::string kExact =
    "unbiased: except for grazing light on smoothly shaded meshes; without light of more than 3 bounces";

// The words of the Estimator lines of the headers that a preset is made of: light_tree_kernel.h, cut_kernel.h,
// light_pool_kernel.h, light_bvh_kernel.h, light_sampler_kernel.h, path_kernel.h say unbiased; vpl_kernel.h, of diffuse
// light; vpl_sampler_kernel.h, under a clamp, and to substitutes biased.
TEST(Estimator, PresetsAreWhatTheirHeadersSay) {
  const std::string direct = "unbiased: direct light only";
  const std::map<std::string, std::string> expected = {
      {"tree", direct},
      {"rtslc", direct},
      {"pool", direct},
      {"ats", direct},
      {"power", direct},
      {"uniform", direct},
      {"exhaustive", direct},
      {"path", "unbiased: without light of more than 8 bounces"},
      {"sst",
       "biased: VPLs send on no gloss; the clamp leaves out light near VPLs; substitutes are not where their VPLs are; "
       "without light of more than 3 bounces"},
      {"slc",
       "biased: VPLs send on no gloss; the clamp leaves out light near VPLs; without light of more than 3 bounces"}};
  for (const PresetInfo& preset : presets()) {
    ASSERT_TRUE(expected.contains(preset.name)) << preset.name << " needs a line here";
    EXPECT_EQ(label_of(make_preset(preset.name)), expected.at(preset.name)) << preset.name;
  }
}

TEST(Estimator, BouncesLeftOutAreSaidButAreNoBias) {
  const Settings path = make_preset("path");
  EXPECT_EQ(label_of(path, {{"indirect.max_bounces", "1"}}), "unbiased: without light of more than 1 bounce");
  EXPECT_EQ(label_of(path, {{"indirect.max_bounces", "0"}}), "unbiased: direct light only");
  EXPECT_EQ(label_of(path, {{"indirect.transport", "none"}}), "unbiased: direct light only");
}

TEST(Estimator, DirectLightStaysUnbiasedHoweverLightsAreChosen) {
  for (const char* selection : {"uniform", "power", "root", "all", "cut", "pool"})
    EXPECT_EQ(label_of(make_preset("tree"), {{"direct.selection", selection}}),
              "unbiased: direct light only");
  EXPECT_EQ(label_of(make_preset("tree"), {{"direct.mis", "true"}}), "unbiased: direct light only");
}

TEST(Estimator, InterleavedCutsNeedTheirTurns) {
  EXPECT_EQ(
      label_of(make_preset("rtslc"), {{"direct.cut_interleave", "2"}}),
      "consistent: unbiased after every 4 samples a pixel, which take turns at the cuts; direct light only");
  EXPECT_EQ(label_of(make_preset("pool"), {{"direct.cut_interleave", "2"}}), "unbiased: direct light only");
  const Changes vpl_cuts = {{"indirect.selection", "cut"},   {"indirect.hierarchy", "perfect"},
                            {"indirect.weights", "min-max"}, {"indirect.cut_interleave", "3"},
                            {"direct.selection", "cut"},     {"direct.cut_interleave", "2"}};
  const std::string both = label_of(exact_vpls(), vpl_cuts);
  EXPECT_EQ(both.find("consistent: unbiased after every 36 samples a pixel"), 0u) << both;
}

TEST(Estimator, EachBiasOfVirtualPointLightsIsTurnedOffByItsSetting) {
  EXPECT_EQ(label_of(exact_vpls()), kExact);
  const auto reason = [](const Changes& changes) { return label_of(exact_vpls(), changes); };
  const std::string rest = "; without light of more than 3 bounces";
  EXPECT_EQ(reason({{"indirect.clamp", "100"}}), "biased: the clamp leaves out light near VPLs" + rest);
  EXPECT_EQ(
      reason({{"indirect.clamp", "100"}, {"indirect.compensate", "true"}}),
      "biased: light that the clamp leaves out near VPLs is found by one short ray, but not exactly" + rest);
  EXPECT_EQ(reason({{"indirect.compensate", "true"}}), kExact);  // nothing is clamped
  EXPECT_EQ(reason({{"force_diffuse", "false"}}), "biased: VPLs send on no gloss" + rest);
  EXPECT_EQ(reason({{"force_diffuse", "false"}, {"indirect.gloss", "false"}}),
            "biased: VPLs send on no gloss; surfaces show no gloss of indirect light" + rest);
  EXPECT_EQ(reason({{"indirect.gloss", "false"}}), kExact);  // no surface has any
}

TEST(Estimator, SubstitutesAreBiasedUnlessTheyAreCorrectedOrUnused) {
  const std::string biased =
      "biased: substitutes are not where their VPLs are; without light of more than 3 bounces";
  EXPECT_EQ(label_of(exact_vpls(), {{"indirect.stop", "substitute"}}), biased);
  EXPECT_EQ(label_of(exact_vpls(), {{"indirect.stop", "substitute"}, {"indirect.correction", "0.1"}}),
            kExact);
  EXPECT_EQ(label_of(exact_vpls(), {{"indirect.stop", "substitute"}, {"indirect.selection", "power"}}),
            kExact);
  EXPECT_EQ(label_of(exact_vpls(), {{"indirect.stop", "substitute"}, {"indirect.joint", "true"}}), kExact);
}

TEST(Estimator, KeptVirtualPointLightsAreNamed) {
  const std::string label = label_of(exact_vpls(), {{"indirect.keep_vpls", "true"}});
  EXPECT_EQ(label.find("unbiased: "), 0u) << label;
  EXPECT_NE(label.find("more samples converge to the image of one set of VPLs"), std::string::npos) << label;
  EXPECT_EQ(label_of(make_preset("path"), {{"indirect.keep_vpls", "true"}}), label_of(make_preset("path")));
}

TEST(Estimator, SentencesFitATooltip) {
  const EstimatorLabel label = estimator_label(make_preset("sst"));
  std::istringstream sentences(label.reason);
  for (std::string sentence; std::getline(sentences, sentence, ';');)
    EXPECT_LE(sentence.size(), 100u) << sentence;
}

TEST(Estimator, ALabelWithoutReasonIsOneWord) { EXPECT_EQ(estimator_text({Bias::kBiased, ""}), "biased"); }

}  // namespace
}  // namespace lumigrove
