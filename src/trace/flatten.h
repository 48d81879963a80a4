// Which instances are baked into one world-space triangle soup and which stay instances of a shared
// structure.
#pragma once

#include <cstdint>
#include <vector>

#include "lumigrove/scene.h"

namespace lumigrove {

// A ray that enters an instance pays for a transform and for its packet's coherence (a third more time for
// the shadow rays of a city), a baked triangle costs about 100 bytes. So copies of meshes that are used
// several times are baked too, smallest first, while all copies together stay below this many triangles.
inline constexpr std::size_t kMaxBakedCopies = std::size_t{1} << 20;

// What moves is baked as well while the whole soup has no more triangles than this: a rebuild takes under a second
// of one core for a million.
inline constexpr std::size_t kMaxRebuiltSoup = std::size_t{1} << 20;

struct TracePlan {
  std::vector<std::uint32_t> baked;      // instances whose triangles join the opaque soup
  std::vector<std::uint32_t> masked;     // baked too, but each on its own: a filter function cuts its holes
  std::vector<std::uint32_t> instanced;  // what moves in large scenes, and large meshes used several times
  bool baked_moves = false;              // something that was baked moves: another moment needs another soup
};

// Instances of empty meshes appear nowhere.
TracePlan plan_trace(const Scene& scene, const SceneState& state);

// A triangle of the soup -> the scene's names for it.
struct TriangleId {
  std::uint32_t instance, triangle;
};

}  // namespace lumigrove
