// What a frame leaves to the next one: structures made from what no instance's motion changes. Keys tell by a scene's
// contents whether it is still the one that they were made from.
#pragma once

#include <cstdint>
#include <optional>

#include "lights/light_set.h"
#include "lumigrove/renderer.h"
#include "methods/light_tree/two_level_tree.h"

namespace lumigrove {

struct History::Kept {
  std::uint64_t texture_key = 0, shape_key = 0;
  std::optional<LightSet> lights;  // which triangles emit, by emissive textures
  TwoLevelTree two_level;          // trees of meshes
};

// Of all that LightSet's constructor reads, but for shapes: materials' emission, emissive textures, environment.
std::uint64_t texture_key(const Scene& scene);
// The same and all that trees of meshes are made from.
std::uint64_t shape_key(const Scene& scene, const Settings& settings, std::uint64_t texture_key);

// What of `kept` this scene can still use, with its keys. Nothing stays in `kept`.
History::Kept take_kept(History::Kept& kept, const Scene& scene, const Settings& settings);

}  // namespace lumigrove
