// The floor under a frame: the very same rays through Embree alone. Everything lies in one world-space
// geometry (no instances, no robust flag), rays are packed beforehand, and nothing is read from the answers.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "lumigrove/scene.h"

namespace lumigrove {
struct Ray;
}

namespace lumigrove::bench {

class BareEmbree {
 public:
  // Throws Error when a material cuts holes: then the rays would not be the same.
  BareEmbree(const Scene& scene, const SceneState& state);
  ~BareEmbree();

  // Packs the rays that are to be traced; untraced slots of a batch are no rays.
  void set_rays(std::span<const Ray> closest, std::span<const Ray> occluded);

  // Ways to ask: one ray at a time, packets of 8 and 16, each with and without the coherent flag.
  static constexpr int kModes = 6;
  static std::string mode_name(int mode);
  void trace_closest(int mode) const;
  void trace_occluded(int mode) const;

  // The faster of all modes, each tried `tries` times.
  int best_closest_mode(int tries) const;
  int best_occluded_mode(int tries) const;

  std::size_t closest_count() const;
  std::size_t occluded_count() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumigrove::bench
