// lumigrove list methods|scenes|settings|devices: the registry, as text or JSON.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "commands.h"
#include "devices.h"
#include "frame/estimator.h"
#include "json_text.h"
#include "lumigrove/scene.h"
#include "lumigrove/settings.h"

namespace lumigrove {
namespace {

std::string estimator_of(const PresetInfo& preset) {
  return estimator_text(estimator_label(make_preset(preset.name)));
}

void print_methods() {
  for (const PresetInfo& preset : presets()) {
    fmt::print("{}\n    {}\n    {}\n    {}\n   ", preset.name, preset.description, preset.citation,
               estimator_of(preset));
    for (const auto& [key, value] : preset.values) fmt::print(" {}={}", key, value);
    fmt::print("\n");
  }
}

Json methods_json() {
  Json list = Json::array();
  for (const PresetInfo& preset : presets()) {
    Json values = Json::object();
    for (const auto& [key, value] : preset.values) values[key] = value;
    list.push_back({{"name", preset.name},
                    {"description", preset.description},
                    {"citation", preset.citation},
                    {"estimator", estimator_of(preset)},
                    {"settings", values}});
  }
  return list;
}

void print_settings() {
  for (const SettingInfo& info : settings_table()) {
    const std::string value = info.default_value.empty() ? "(empty)" : info.default_value;
    fmt::print("{:<26}{} {}\n    {}", info.key, value, info.unit, info.description);
    if (!info.choices.empty()) fmt::print(" [{}]", fmt::join(info.choices, ", "));
    if (!info.range.empty()) fmt::print(" [{}]", info.range);
    fmt::print("\n");
  }
}

Json settings_json() {
  Json list = Json::array();
  for (const SettingInfo& info : settings_table())
    list.push_back({{"key", info.key},
                    {"type", info.type},
                    {"default", info.default_value},
                    {"unit", info.unit},
                    {"description", info.description},
                    {"choices", info.choices},
                    {"range", info.range}});
  return list;
}

void print_scenes() {
  for (const BuiltinScene& scene : builtin_scenes()) {
    fmt::print("{}{}\n    {}\n", scene.name, scene.animated ? " (animated)" : "", scene.description);
    for (const SceneParameter& parameter : scene.parameters)
      fmt::print("    {}={}  {}\n", parameter.name, parameter.default_value, parameter.description);
  }
}

Json scenes_json() {
  Json list = Json::array();
  for (const BuiltinScene& scene : builtin_scenes()) {
    Json parameters = Json::array();
    for (const SceneParameter& p : scene.parameters)
      parameters.push_back({{"name", p.name}, {"default", p.default_value}, {"description", p.description}});
    list.push_back({{"name", scene.name},
                    {"description", scene.description},
                    {"animated", scene.animated},
                    {"parameters", parameters}});
  }
  return list;
}

void add_list(CLI::App& list, const std::string& name, const std::string& description, void (*print)(),
              Json (*to_json)()) {
  CLI::App* command = list.add_subcommand(name, description);
  auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "Print JSON");
  command->callback([=] {
    if (*json)
      fmt::print("{}\n", to_json().dump(2));
    else
      print();
  });
}

void print_devices() { fmt::print("{}", device_list()); }

}  // namespace

void add_list_command(CLI::App& app) {
  CLI::App* list = app.add_subcommand("list", "List what there is");
  list->require_subcommand(1);
  add_list(*list, "methods", "Methods, their settings and where they come from", print_methods, methods_json);
  list->get_subcommand("methods")->alias("presets");
  add_list(*list, "scenes", "Built-in scenes and their parameters", print_scenes, scenes_json);
  add_list(*list, "settings", "Settings: default, unit, meaning, valid values", print_settings,
           settings_json);
  list->add_subcommand("devices", "Devices that can render")->callback(print_devices);
}

}  // namespace lumigrove
