#include "lumigrove/settings.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/nearest.h"
#include "frame/settings_file.h"

namespace lumigrove {
namespace {

// The sentence that `action` fails with; empty when it does not fail.
template <class Action>
std::string message_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "'" << text << "' lacks '" << part << "'";
}

void expect_same(const Settings& a, const Settings& b) {
  for (const SettingInfo& info : settings_table())
    EXPECT_EQ(get_value(a, info.key), get_value(b, info.key)) << info.key;
}

// Every field away from its default, with floats that need all their digits.
Settings unusual_settings() {
  Settings s = make_preset("path");
  s.width = 321, s.height = 17, s.spp = 3, s.seed = 4294967295u, s.frame = 42, s.threads = 3;
  s.time = 1.0 / 3.0;
  s.pixel_bounds = std::array<int, 4>{1, 20, 3, 17};
  s.camera = "a \"quoted\" \\ name\twith\nlines, ümlaut";
  s.view = ViewSettings{vec3(0.1f, -1e-20f, 3e20f), vec3(1.0f / 3.0f, 16777216.0f, 7), vec3(0, 0.7f, 0.3f)};
  s.fov = 33.333332f;
  s.light_scale = 0.1f;
  s.force_diffuse = true, s.ignore_range = true, s.jitter = false;
  s.direct.selection = Selection::kPower, s.direct.hierarchy = Hierarchy::kNone;
  s.direct.width = 2, s.direct.spp = 7, s.direct.mis = false;
  s.indirect.transport = Transport::kNone, s.indirect.max_bounces = 11, s.indirect.roulette_start = 5;
  return s;
}

TEST(Settings, EveryRowSurvivesItsOwnText) {
  for (const PresetInfo& preset : presets()) {
    const Settings before = make_preset(preset.name);
    Settings after = before;
    for (const SettingInfo& info : settings_table())
      if (info.key != "preset") set_value(after, info.key, get_value(before, info.key));
    expect_same(before, after);
  }
}

TEST(Settings, DefaultsOfTheTableAreThoseOfTheStruct) {
  for (const SettingInfo& info : settings_table()) {
    EXPECT_EQ(info.default_value, get_value(Settings{}, info.key)) << info.key;
    EXPECT_FALSE(info.description.empty()) << info.key;
  }
}

TEST(Settings, EveryChoiceOfTheTableCanBeSetAndReadBack) {
  for (const SettingInfo& info : settings_table())
    for (const std::string& value : info.choices) {
      Settings s;
      set_value(s, info.key, value);
      EXPECT_EQ(get_value(s, info.key), value) << info.key;
    }
}

TEST(Settings, TheFirstPresetIsTheDefault) { expect_same(make_preset(Settings{}.preset), Settings{}); }

TEST(Settings, EveryPresetIsSensibleAndCited) {
  for (const PresetInfo& preset : presets()) {
    EXPECT_NO_THROW(check(make_preset(preset.name))) << preset.name;
    EXPECT_FALSE(preset.citation.empty());
    EXPECT_EQ(make_preset(preset.name).preset, preset.name);
  }
}

TEST(Settings, UnknownKeyNamesTheNearestOne) {
  Settings s;
  expect_contains(message_of([&] { set_value(s, "direct.sp", "4"); }), "'direct.spp'");
  expect_contains(message_of([&] { set_value(s, "heigth", "4"); }), "'height'");
  expect_contains(message_of([&] { set_value(s, "max-bounces", "4"); }), "'indirect.max_bounces'");
  expect_contains(message_of([&] { get_value(s, ""); }), "unknown setting ''");
}

TEST(Settings, UnknownPresetNamesTheNearestOne) {
  expect_contains(message_of([] { make_preset("powr"); }), "'power'");
  expect_contains(message_of([] { make_preset("sst2000"); }), "exhaustive");
}

TEST(Settings, BadValuesAreRefusedWithTheValidOnes) {
  Settings s;
  const auto refusal = [&](const char* key, const char* value) {
    return message_of([&] { set_value(s, key, value); });
  };
  expect_contains(refusal("direct.selection", "roots"), "uniform, power, root, all");
  expect_contains(refusal("width", "0"), "from 1 to 65536");
  expect_contains(refusal("width", "12px"), "from 1 to 65536");
  expect_contains(refusal("width", "99999999999999999999"), "from 1 to 65536");
  expect_contains(refusal("spp", "-1"), "from 1 to");
  expect_contains(refusal("spp", "1.5"), "whole number");
  expect_contains(refusal("spp", ""), "whole number");
  expect_contains(refusal("seed", "4294967296"), "4294967295");
  expect_contains(refusal("light_scale", "nan"), "at least 0");
  expect_contains(refusal("light_scale", "inf"), "at least 0");
  expect_contains(refusal("light_scale", "-1"), "at least 0");
  expect_contains(refusal("fov", "180"), "below 180");
  expect_contains(refusal("direct.width", "3"), "2, 4, 8, 16");
  expect_contains(refusal("jitter", "maybe"), "true or false");
  expect_contains(refusal("view.up", "1,2"), "three");
  expect_contains(refusal("view.up", "1,2,nan"), "three");
  expect_contains(refusal("pixel_bounds", "1,2,3,x"), "four");
  expect_same(s, Settings{});
}

TEST(Settings, PresetKeyReplacesTheMethodAndNothingElse) {
  Settings s;
  set_value(s, "width", "77");
  set_value(s, "direct.spp", "9");
  set_value(s, "preset", "power");
  EXPECT_EQ(s.width, 77);
  EXPECT_EQ(s.direct.spp, 1);
  EXPECT_EQ(s.direct.selection, Selection::kPower);
}

TEST(Settings, CheckRefusesWhatMakesNoSense) {
  const auto refusal = [](auto change) {
    Settings s;
    change(s);
    return message_of([&] { check(s); });
  };
  EXPECT_EQ(refusal([](Settings&) {}), "");
  expect_contains(refusal([](Settings& s) { s.width = 0; }), "width");
  expect_contains(refusal([](Settings& s) { s.spp = -4; }), "spp");
  expect_contains(refusal([](Settings& s) { s.light_scale = NAN; }), "light_scale");
  expect_contains(refusal([](Settings& s) { s.time = INFINITY; }), "time");
  expect_contains(refusal([](Settings& s) { s.direct.width = 5; }), "direct.width");
  expect_contains(refusal([](Settings& s) { s.direct.hierarchy = Hierarchy::kNone; }), "direct.hierarchy");
  expect_contains(refusal([](Settings& s) { s.direct.weights = Weights::kSaoh; }), "direct.weights 'saoh' needs");
  expect_contains(refusal([](Settings& s) { s.direct.split = 0.5f; }), "direct.split needs");
  expect_contains(refusal([](Settings& s) {
                    s.direct.hierarchy = Hierarchy::kSaoh;
                    s.direct.selection = Selection::kCut;
                    s.direct.split = 0.5f;
                  }),
                  "does not combine with cuts");
  expect_contains(refusal([](Settings& s) { s.width = s.height = 65536; }), "too large");
  expect_contains(refusal([](Settings& s) { s.pixel_bounds = {{0, 9, 0, 721}}; }), "pixel_bounds");
  expect_contains(refusal([](Settings& s) { s.pixel_bounds = {{4, 4, 0, 7}}; }), "pixel_bounds");
  expect_contains(refusal([](Settings& s) {
                    s.view = ViewSettings{vec3(1), vec3(1), vec3(0, 1, 0)};
                  }),
                  "same point");
  expect_contains(refusal([](Settings& s) {
                    s.view = ViewSettings{vec3(0), vec3(0, 5, 0), vec3(0, 1, 0)};
                  }),
                  "parallel");
}

TEST(SettingsFile, TextReproducesTheSettingsExactly) {
  const Settings before = unusual_settings();
  Settings after;
  apply_settings(after, parse_settings(to_toml(before), "receipt"), "receipt");
  expect_same(before, after);
  EXPECT_EQ(before.view->position.y, after.view->position.y);
  EXPECT_EQ(before.time, after.time);
}

TEST(SettingsFile, TablesNestIntoDottedKeys) {
  Settings s;
  apply_settings(s,
                 parse_settings("spp = 8\nlight_scale = 2\npreset = 'power'\nview.up = [0, 0.5, 1]\n"
                                "[direct]\nspp = 4\nselection = 'uniform'\n",
                                "file"),
                 "file");
  EXPECT_EQ(s.spp, 8);
  EXPECT_EQ(s.light_scale, 2);
  EXPECT_EQ(s.direct.spp, 4);
  EXPECT_EQ(s.direct.selection, Selection::kUniform);
  EXPECT_EQ(s.preset, "power");
  EXPECT_EQ(s.view->up, vec3(0, 0.5f, 1));
}

TEST(SettingsFile, MistakesNameTheFileAndThePlace) {
  Settings s;
  const auto refusal = [&](const char* text) {
    return message_of([&] { apply_settings(s, parse_settings(text, "my.toml"), "my.toml"); });
  };
  expect_contains(refusal("spp = 1\nspp = = 4"), "my.toml:2");
  expect_contains(refusal("[direct]\nspps = 4"), "my.toml: unknown setting 'direct.spps'");
  expect_contains(refusal("spp = 2020-01-01"), "my.toml:1");
  expect_contains(refusal("view.up = [[1], 2]"), "my.toml:1");
  expect_contains(refusal("direct = 4"), "unknown setting 'direct'");
  expect_contains(message_of([] { read_settings_file("/nonexistent/a.toml"); }), "/nonexistent/a.toml");
  expect_contains(message_of([] { read_settings_file("/"); }), "'/'");
}

TEST(Nearest, CountsInsertionsDeletionsSubstitutionsAndSwaps) {
  EXPECT_EQ(edit_distance("", "abc"), 3);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("spp", "psp"), 1);
  EXPECT_EQ(edit_distance("same", "same"), 0);
  EXPECT_EQ(nearest("x", {}), "");
  EXPECT_EQ(nearest("Night_City", {"towers", "night-city"}), "night-city");
}

}  // namespace
}  // namespace lumigrove
