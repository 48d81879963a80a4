#include "frame/receipt.h"

#include <gtest/gtest.h>

namespace lumigrove {
namespace {

using Metadata = std::map<std::string, std::string>;

Receipt sample_receipt() {
  Receipt receipt;
  receipt.version = "0.1.0 (abc)";
  receipt.scene = "folder/a scene.glb";
  receipt.scene_file = "/somewhere/folder/a scene.glb";
  receipt.scene_hash = "0123456789abcdef";
  receipt.environment = "1,2,3";
  receipt.settings = make_preset("path");
  receipt.settings.spp = 100;
  receipt.settings.light_scale = 0.1f;
  receipt.spp_done = 37;
  receipt.threads = 4;
  return receipt;
}

std::string refusal(const Metadata& metadata) {
  try {
    read_receipt(metadata, "image.exr");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Receipt, SurvivesMetadata) {
  const Receipt before = sample_receipt();
  Metadata metadata;
  write_receipt(before, metadata);
  const Receipt after = read_receipt(metadata, "image.exr");
  EXPECT_EQ(after.version, before.version);
  EXPECT_EQ(after.scene, before.scene);
  EXPECT_EQ(after.scene_file, before.scene_file);
  EXPECT_EQ(after.scene_hash, before.scene_hash);
  EXPECT_EQ(after.environment, before.environment);
  EXPECT_EQ(after.spp_done, before.spp_done);
  EXPECT_EQ(after.threads, before.threads);
  for (const SettingInfo& info : settings_table())
    EXPECT_EQ(get_value(after.settings, info.key), get_value(before.settings, info.key));
}

TEST(Receipt, RerunTakesTheSamplesThatWereRendered) {
  const Settings settings = rerun_settings(sample_receipt());
  EXPECT_EQ(settings.spp, 37);
  EXPECT_EQ(settings.light_scale, 0.1f);
}

TEST(Receipt, MissingOrDamagedReceiptsNameTheImage) {
  EXPECT_NE(refusal({}).find("'image.exr' carries no Lumigrove receipt"), std::string::npos);
  Metadata good;
  write_receipt(sample_receipt(), good);
  EXPECT_EQ(refusal(good), "");
  using Pairs = std::vector<std::pair<std::string, std::string>>;
  for (const auto& [key, value] : Pairs{{"spp", "0"},
                                        {"spp", "many"},
                                        {"spp", "99999999999999"},
                                        {"threads", ""},
                                        {"settings", "spp = = 3"},
                                        {"settings", "no_such_key = 3"}}) {
    Metadata damaged = good;
    damaged[key] = value;
    EXPECT_NE(refusal(damaged).find("image.exr"), std::string::npos) << key << " = " << value;
  }
}

TEST(Receipt, VersionNamesTheProgram) { EXPECT_EQ(version_text().find(version()), 0u); }

}  // namespace
}  // namespace lumigrove
