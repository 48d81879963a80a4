#include "setting_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "checks.h"
#include "frame/value_text.h"

namespace lumigrove {
namespace {

using Options = std::shared_ptr<SettingOptions>;
constexpr const char* kGroup = "Settings";

const SettingInfo& info_of(const std::string& key) {
  for (const SettingInfo& info : settings_table())
    if (info.key == key) return info;
  throw std::logic_error("no setting is called " + key);
}

// The table's words, so that the help cannot differ from `list settings`.
std::string description_of(const std::string& key) {
  const SettingInfo& info = info_of(key);
  if (info.default_value.empty()) return info.description;
  return fmt::format("{} ({}{}default {})", info.description, info.unit, info.unit.empty() ? "" : ", ",
                     info.default_value);
}

CLI::Option* add_value(CLI::App& command, const Options& options, const std::string& name,
                       const std::string& key) {
  auto* option = command.add_option_function<std::string>(
      name, [=](const std::string& value) { options->values.emplace_back(key, value); }, description_of(key));
  const std::string& type = info_of(key).type;
  return option->type_name(type == "int" ? "N" : type == "float" ? "X" : "NAME")->group(kGroup);
}

void add_flag(CLI::App& command, const Options& options, const std::string& name, const std::string& key,
              const std::string& value, const std::string& description) {
  command
      .add_flag_callback(
          name, [=] { options->values.emplace_back(key, value); }, description)
      ->group(kGroup);
}

void add_size_options(CLI::App& command, const Options& options) {
  const auto set_size = [options](const std::vector<std::string>& size) {
    options->values.emplace_back("width", size.at(0));
    options->values.emplace_back("height", size.at(1));
  };
  auto* size = add_list_option(command, "--size", 2, 'x', "W H", set_size,
                               "Width and height, also as WxH (pixels, default 1280x720)");
  size->group(kGroup);
  add_value(command, options, "--width", "width")->excludes(size);
  add_value(command, options, "--height", "height")->excludes(size);
}

void add_crop_options(CLI::App& command, const Options& options) {
  auto* window = add_list_option(
      command, "--cropwindow", 4, ',', "X0 X1 Y0 Y1",
      [options](const auto& list) { options->crop_window = list; },
      "Render only this part, in fractions of the image from its top left");
  const auto set_bounds = [options](const std::vector<std::string>& list) {
    options->values.emplace_back("pixel_bounds", fmt::format("{}", fmt::join(list, ",")));
  };
  auto* bounds = add_list_option(command, "--pixelbounds", 4, ',', "X0 X1 Y0 Y1", set_bounds,
                                 "Render only the pixels X0 <= x < X1, Y0 <= y < Y1");
  auto* pixel = add_list_option(
      command, "--pixel", 2, ',', "X Y", [options](const auto& list) { options->pixel = list; },
      "Render only this pixel");
  window->excludes(bounds)->excludes(pixel)->group(kGroup);
  bounds->excludes(pixel)->group(kGroup);
  pixel->group(kGroup);
}

void apply_assignments(const std::vector<std::string>& assignments, Settings& settings) {
  for (const std::string& assignment : assignments) {
    const std::size_t equals = assignment.find('=');
    if (equals == std::string::npos)
      throw Error(fmt::format("--set is '{}', but must be key=value", assignment));
    set_value(settings, assignment.substr(0, equals), assignment.substr(equals + 1));
  }
}

// Pixels whose lower corner lies in [x0, x1) x [y0, y1), as pbrt rounds.
void apply_crop_window(const std::vector<std::string>& window, Settings& settings) {
  std::array<int, 4> bounds{};
  for (std::size_t i = 0; i < 4; ++i) {
    const double size = i < 2 ? settings.width : settings.height;
    bounds[i] = static_cast<int>(std::ceil(parse_double("--cropwindow", window.at(i), {0, 1}) * size));
  }
  if (bounds[0] >= bounds[1] || bounds[2] >= bounds[3])
    throw Error(fmt::format("--cropwindow {} (x0 x1 y0 y1) holds no pixel of an image of {}x{} pixels",
                            fmt::join(window, " "), settings.width, settings.height));
  settings.pixel_bounds = bounds;
}

void apply_pixel(const std::vector<std::string>& pixel, Settings& settings) {
  const int x = static_cast<int>(parse_integer("--pixel", pixel.at(0), {0, settings.width - 1.0}));
  const int y = static_cast<int>(parse_integer("--pixel", pixel.at(1), {0, settings.height - 1.0}));
  settings.pixel_bounds = {x, x + 1, y, y + 1};
}

// A preset on the command line replaces that of a settings file.
void apply_file(const std::string& file, bool keep_preset, Settings& settings) {
  SettingValues values = read_settings_file(file);
  const auto is_preset = [](const auto& pair) { return pair.first == "preset"; };
  if (keep_preset && std::erase_if(values, is_preset) > 0)
    spdlog::info("--preset {} replaces the preset of '{}'", settings.preset, file);
  apply_settings(settings, values, file);
}

// --max-bounces means the bounces of paths or of virtual point lights, whichever the method has. An option without effect
// is a mistake of whoever gave it.
void apply_bounces(const SettingOptions& options, Settings& settings) {
  const auto is_bounces = [](const auto& pair) { return pair.first == "indirect.max_bounces"; };
  const auto asked = std::find_if(options.values.begin(), options.values.end(), is_bounces);
  if (asked == options.values.end()) return;
  if (settings.indirect.transport == Transport::kVpl) {
    set_value(settings, "indirect.bounces", asked->second);
    return;
  }
  if (asked->second != "0" && settings.indirect.transport == Transport::kNone)
    throw Error(
        fmt::format("--max-bounces needs a method with indirect light (--preset path), but '{}' has none",
                    settings.preset));
}

}  // namespace

CLI::Option* add_list_option(CLI::App& command, const std::string& name, int count, char separator,
                             const std::string& type_name, const ListFunction& function,
                             const std::string& description) {
  return command.add_option_function<std::vector<std::string>>(name, function, description)
      ->type_size(count)
      ->expected(1)
      ->delimiter(separator)
      ->allow_extra_args(false)
      ->type_name(type_name);
}

std::shared_ptr<SettingOptions> add_setting_options(CLI::App& command, const std::string& threads) {
  auto options = std::make_shared<SettingOptions>();
  command.add_option("--preset,--method", options->preset, "Method, one of `list methods` (default tree)")
      ->check(not_empty())
      ->type_name("NAME")
      ->group(kGroup);
  command.add_option("--settings", options->files, "Read settings from a TOML file; may be repeated")
      ->allow_extra_args(false)
      ->type_name("FILE")
      ->group(kGroup);
  command
      .add_option("--set", options->assignments,
                  "Any key of `list settings`: --set direct.spp=4; may be repeated")
      ->allow_extra_args(false)
      ->type_name("KEY=VALUE")
      ->group(kGroup);
  add_value(command, options, "--spp", "spp");
  add_size_options(command, options);
  add_value(command, options, "--seed", "seed");
  add_value(command, options, threads, "threads");
  add_value(command, options, "--max-bounces", "indirect.max_bounces")
      ->description("Most indirect bounces of a path or a virtual point light, 0 = direct light only (default of the method)");
  add_value(command, options, "--camera", "camera");
  add_value(command, options, "--fov", "fov");
  add_value(command, options, "--light-scale", "light_scale");
  add_flag(command, options, "--force-diffuse", "force_diffuse", "true",
           info_of("force_diffuse").description);
  add_flag(command, options, "--ignore-range", "ignore_range", "true", info_of("ignore_range").description);
  add_flag(command, options, "--disable-pixel-jitter", "jitter", "false",
           "All camera samples go through the pixel's centre");
  add_crop_options(command, options);
  return options;
}

bool gives(const SettingOptions& options, const std::string& key) {
  const auto is_key = [&](const auto& pair) { return pair.first == key; };
  const auto assigns = [&](const std::string& text) { return text.starts_with(key + '='); };
  if (std::any_of(options.values.begin(), options.values.end(), is_key)) return true;
  if (std::any_of(options.assignments.begin(), options.assignments.end(), assigns)) return true;
  for (const std::string& file : options.files) {
    const SettingValues values = read_settings_file(file);
    if (std::any_of(values.begin(), values.end(), is_key)) return true;
  }
  return false;
}

Settings make_settings(const SettingOptions& options) {
  Settings settings = options.preset.empty() ? Settings{} : make_preset(options.preset);
  for (const std::string& file : options.files) apply_file(file, !options.preset.empty(), settings);
  apply_assignments(options.assignments, settings);
  for (const auto& [key, value] : options.values) set_value(settings, key, value);
  if (!options.crop_window.empty()) apply_crop_window(options.crop_window, settings);
  if (!options.pixel.empty()) apply_pixel(options.pixel, settings);
  apply_bounces(options, settings);
  check(settings);
  return settings;
}

}  // namespace lumigrove
