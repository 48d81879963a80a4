#include "view_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "frame/camera.h"
#include "frame/value_text.h"
#include "setting_options.h"

namespace lumigrove {
namespace {

void add_vector(CLI::App& command, const std::string& name, const std::shared_ptr<ViewOptions>& options,
                std::optional<vec3> ViewOptions::*member, const std::string& description) {
  const auto store = [=](const std::vector<std::string>& list) {
    (*options).*member = parse_vec3(name, fmt::format("{}", fmt::join(list, ",")));
  };
  add_list_option(command, name, 3, ',', "X Y Z", store, description)->group("View");
}

std::string spaced(vec3 v) { return fmt::format("{} {} {}", v.x, v.y, v.z); }

// +Y, or -Z for views straight up or down.
vec3 upright(vec3 direction) {
  const float across = glm::length(vec2(direction.x, direction.z));
  return across > 1e-3f * glm::abs(direction.y) ? vec3(0, 1, 0) : vec3(0, 0, -1);
}

}  // namespace

std::shared_ptr<ViewOptions> add_view_options(CLI::App& command) {
  auto options = std::make_shared<ViewOptions>();
  add_vector(command, "--vp", options, &ViewOptions::position, "Eye, metres (default the camera's)");
  add_vector(command, "--vi", options, &ViewOptions::look_at, "Point to look at, metres");
  add_vector(command, "--vd", options, &ViewOptions::direction,
             "Direction to look in (default the camera's)");
  add_vector(command, "--vu", options, &ViewOptions::up,
             "Direction that is up in the image (default 0 1 0 with --vi or --vd, else the camera's)");
  command.get_option("--vi")->excludes(command.get_option("--vd"));
  return options;
}

void apply_view_options(const ViewOptions& options, const Scene& scene, Settings& settings) {
  if (!options.position && !options.look_at && !options.direction && !options.up) return;
  const SceneState state = evaluate(scene, settings.time);
  const CameraInstance camera = resolve_camera(scene, state, settings);
  ViewSettings view;
  view.position = options.position.value_or(camera.position);
  const vec3 direction = options.direction.value_or(camera.forward * state.diagonal);
  view.look_at = options.look_at.value_or(view.position + direction);
  const bool turned = options.look_at || options.direction;
  view.up = options.up.value_or(turned ? upright(view.look_at - view.position) : camera.up);
  settings.view = view;
  check(settings);
}

std::string camera_as_options(const Scene& scene, const Settings& settings) {
  const SceneState state = evaluate(scene, settings.time);
  const CameraInstance camera = resolve_camera(scene, state, settings);
  return fmt::format("--vp {} --vd {} --vu {} --fov {}", spaced(camera.position), spaced(camera.forward),
                     spaced(camera.up), glm::degrees(camera.camera.vertical_fov));
}

}  // namespace lumigrove
