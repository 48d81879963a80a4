// The one seam that rays cross: a batch in, hits or occlusion out. Embree stands behind it; a kernel never
// traces.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "lumigrove/scene.h"
#include "trace/ray.h"

namespace lumigrove {

enum class Coherence : std::uint8_t { kCoherent, kIncoherent };  // neighbours in the batch run alike?

// A copy of everything that was asked of a tracer, batch after batch: what the bench replays through bare
// Embree.
struct RayRecorder {
  std::vector<Ray> closest, occluded;
};

// Acceleration structure over one moment of a scene. Holds pointers into `scene`, which must outlive it.
// Materials with AlphaMode::kMask cut holes at alpha < alpha_cutoff. Triangles with NaN vertices or no area,
// and instances with such transforms, are never hit.
class Tracer {
 public:
  Tracer(const Scene& scene, const SceneState& state);
  ~Tracer();
  Tracer(Tracer&&) noexcept;
  Tracer& operator=(Tracer&&) noexcept;

  // Another moment of the same scene: only what moves is rebuilt. Throws Error when the instances are not
  // those of the first state.
  void update(const SceneState& state);

  // Both spans have the same length. Among several triangles at the very same t any one may be reported.
  void closest(std::span<const Ray> rays, std::span<Hit> hits, Coherence coherence) const;
  // occluded[i] = 1 when anything lies on the segment, else 0.
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> occluded, Coherence coherence) const;

  // From now on every batch is appended to `recorder`, which must outlive the tracer or the next call; null
  // stops.
  void record(RayRecorder* recorder);

  std::size_t bytes() const;  // as Embree reports them, and our own tables

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumigrove
