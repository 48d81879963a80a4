// Scene + settings -> image. The whole engine behind one function.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "lumigrove/image.h"
#include "lumigrove/scene.h"
#include "lumigrove/settings.h"

namespace lumigrove {

struct PassStats {
  std::string name;
  double ms = 0;            // wall time summed over all camera samples
  std::uint64_t rays = 0;   // traced in this pass
};
// Name of the structure that serves geometry; all others serve lights and count towards the bytes per light.
inline constexpr const char* kAccelerationStructure = "acceleration structure";

struct StructureStats {
  std::string name;         // kAccelerationStructure, "light set", "perfect tree", "two-level tree", "bottom trees", "alias table", "VPLs", ...
  double build_ms = 0;
  std::uint64_t bytes = 0;
  std::uint64_t elements = 0;
  bool of_vpls = false;     // serves virtual point lights, not emitters
};
struct RenderStats {
  int spp_done = 0;         // below settings.spp when cancelled
  double total_ms = 0;
  std::uint64_t emitters = 0;
  std::vector<PassStats> passes;
  std::vector<StructureStats> structures;
};

struct Progress {
  int spp_done = 0, spp_total = 0;
  double elapsed_s = 0;
};
// Called after every camera sample; return false to stop early with a valid image.
using ProgressFunction = std::function<bool(const Progress&)>;

// What one frame leaves to the next: structures over lights that only the motion of instances would not change. One
// object for all frames of a scene saves the time to build them; pictures are the same to the bit without it. It may
// meet any scene and settings at any time: what was made from others, or from a scene since changed, is made anew.
class History {
 public:
  struct Kept;
  History();
  ~History();
  History(History&&) noexcept;
  History& operator=(History&&) noexcept;

  Kept& kept();  // for render()

 private:
  std::unique_ptr<Kept> kept_;
};

// Layers: beauty RGBA; direct, indirect, emission, albedo (RGB); N, P (XYZ); Z; variance (RGB, of the pixel mean,
// when spp >= 2); emitter and instance ids of the first hit. Throws Error. Deterministic for any thread count.
Image render(const Scene& scene, const Settings& settings, RenderStats* stats = nullptr,
             const ProgressFunction& progress = {}, History* history = nullptr);

const char* version();  // "0.1.0"
const char* commit();   // of the source tree, "-dirty" when changed; empty when built outside a repository

}  // namespace lumigrove
