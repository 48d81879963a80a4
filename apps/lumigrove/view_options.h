// --vp --vi --vd --vu: the view in Embree's words.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "lumigrove/scene.h"
#include "lumigrove/settings.h"

namespace lumigrove {

struct ViewOptions {
  std::optional<vec3> position, look_at, direction, up;
};

std::shared_ptr<ViewOptions> add_view_options(CLI::App& command);

// Sets settings.view when any option was given; what was not given comes from the camera at settings.time.
void apply_view_options(const ViewOptions& options, const Scene& scene, Settings& settings);

// The options that give the camera of `settings` at settings.time.
std::string camera_as_options(const Scene& scene, const Settings& settings);

}  // namespace lumigrove
