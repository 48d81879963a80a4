// What `lumigrove scene info` tells.
#pragma once

#include <string>
#include <vector>

#include "lumigrove/scene.h"

namespace lumigrove {

// Emitters of one kind at one moment. Flux is the luminance (BT.709) of the power that leaves them, watts.
struct EmitterGroup {
  std::string kind;
  std::uint64_t count = 0;
  double flux = 0;
};

struct SceneInfo {
  std::string name, hash;
  double time = 0, duration = 0;  // seconds
  std::uint64_t nodes = 0, meshes = 0, instances = 0, moving_instances = 0;
  std::uint64_t triangles = 0;            // stored
  std::uint64_t instanced_triangles = 0;  // as rays see them
  std::uint64_t materials = 0, images = 0, texels = 0, animation_channels = 0;
  std::uint64_t bytes = 0;  // of all arrays
  Box3 bounds;
  float diagonal = 0;
  std::vector<CameraInstance> cameras;
  std::vector<EmitterGroup> emitters;  // local ones; then those at infinity, whose flux is what can
                                       // cross the scene's bounding sphere
  std::vector<std::string> warnings;
};

SceneInfo describe_scene(const Scene& scene, double seconds);
std::string info_text(const SceneInfo& info);
std::string info_json(const SceneInfo& info);

}  // namespace lumigrove
