// Which instances are baked into one world-space triangle soup and which stay instances of a shared
// structure.
#pragma once

#include <cstdint>
#include <vector>

#include "lumigrove/scene.h"

namespace lumigrove {

// Copies of meshes that are used several times are baked too, smallest first, while all copies together stay
// below this many triangles: a ray that enters an instance costs a transform and its packet's coherence, a
// baked triangle costs about 100 bytes.
inline constexpr std::size_t kMaxBakedCopies = std::size_t{1} << 20;

struct TracePlan {
  std::vector<std::uint32_t> baked;      // instances whose triangles join the opaque soup
  std::vector<std::uint32_t> masked;     // baked too, but each on its own: a filter function cuts its holes
  std::vector<std::uint32_t> instanced;  // moving ones, and large meshes used several times
};

// Instances of empty meshes appear nowhere.
TracePlan plan_trace(const Scene& scene, const SceneState& state);

// A triangle of the soup -> the scene's names for it.
struct TriangleId {
  std::uint32_t instance, triangle;
};

}  // namespace lumigrove
