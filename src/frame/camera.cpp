#include "frame/camera.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/nearest.h"

namespace lumigrove {
namespace {

// A camera answers to its own name and to its node's.
bool is_called(const Scene& scene, const CameraInstance& camera, const std::string& name) {
  const bool has_node = camera.node >= 0 && camera.node < static_cast<int>(scene.nodes.size());
  return camera.camera.name == name || (has_node && scene.nodes[camera.node].name == name);
}

void apply_view(const ViewSettings& view, CameraInstance& camera) {
  camera.position = view.position;
  camera.forward = glm::normalize(view.look_at - view.position);
  camera.right = glm::normalize(glm::cross(camera.forward, view.up));
  camera.up = glm::cross(camera.right, camera.forward);
}

}  // namespace

CameraInstance find_camera(const Scene& scene, const SceneState& state, const std::string& name) {
  if (name.empty()) return state.cameras.empty() ? default_camera(state) : state.cameras.front();
  std::vector<std::string> names;
  for (const CameraInstance& camera : state.cameras) {
    if (is_called(scene, camera, name)) return camera;
    names.push_back(camera.camera.name);
  }
  if (names.empty()) throw Error(fmt::format("'{}' has no camera '{}', nor any other", scene.name, name));
  throw Error(fmt::format("'{}' has no camera '{}'; the nearest one is '{}', all are {}", scene.name, name,
                          nearest(name, names), fmt::join(names, ", ")));
}

CameraInstance resolve_camera(const Scene& scene, const SceneState& state, const Settings& settings) {
  CameraInstance camera = find_camera(scene, state, settings.camera);
  if (settings.view) apply_view(*settings.view, camera);
  if (settings.fov) camera.camera.vertical_fov = glm::radians(*settings.fov);
  return camera;
}

}  // namespace lumigrove
