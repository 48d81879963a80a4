// The one seam that rays cross: a batch in, hits or occlusion out. Embree stands behind it; a kernel never traces.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "base/vec.h"
#include "lumigrove/scene.h"

namespace lumigrove {

// Segment origin + t*direction, t in [tmin, tmax]; direction need not be unit. tmax < tmin (or a NaN anywhere)
// marks a ray that is not traced: it hits nothing and occludes nothing.
struct Ray {
  vec3 origin;
  float tmin = 0;
  vec3 direction;
  float tmax = -1;
};

inline constexpr std::uint32_t kNone = 0xffffffffu;

struct Hit {
  std::uint32_t instance = kNone;  // index into SceneState::instances
  std::uint32_t triangle = 0;      // index into Mesh::triangles
  float u = 0, v = 0;              // barycentric: p = (1-u-v) p0 + u p1 + v p2
  float t = 0;                     // in units of direction
};

enum class Coherence : std::uint8_t { kCoherent, kIncoherent };  // neighbours in the batch run alike?

// Acceleration structure over one moment of a scene. Holds pointers into `scene`, which must outlive it.
// Materials with AlphaMode::kMask cut holes at alpha < alpha_cutoff.
class Tracer {
 public:
  Tracer(const Scene& scene, const SceneState& state);
  ~Tracer();
  Tracer(Tracer&&) noexcept;
  Tracer& operator=(Tracer&&) noexcept;

  void closest(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence) const;
  // occluded[i] = 1 when anything lies on the segment, else 0.
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence coherence) const;

  std::size_t bytes() const;       // as Embree reports them

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumigrove
