// Which camera a render uses.
#pragma once

#include "lumigrove/scene.h"
#include "lumigrove/settings.h"

namespace lumigrove {

// The camera called `name`, or the first one when the name is empty, or a view of the whole scene when it has
// no camera. Throws Error listing the cameras when none has that name.
CameraInstance find_camera(const Scene& scene, const SceneState& state, const std::string& name);

// The camera of `settings`: find_camera, then `view` and `fov` on top of it.
CameraInstance resolve_camera(const Scene& scene, const SceneState& state, const Settings& settings);

}  // namespace lumigrove
