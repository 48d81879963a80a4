// Tracing of virtual point lights: paths start at the emitters and leave a light wherever they meet a surface.
// vpl_kernel.h holds the method and its header block.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/large_array.h"
#include "base/rng.h"
#include "lights/light_set.h"
#include "lights/vpl.h"
#include "trace/trace.h"

namespace lumigrove {

// Plain data: copy freely.
struct VplTracing {
  SceneView scene;
  LightView lights;
  Box3 bounds;                 // of the scene's geometry: paths from infinity start outside it
  const Tracer* tracer = nullptr;
  Rng rng;                     // seed and frame; the path's number takes the place of the pixel
  int paths = 33333;           // started, over all emitters together
  int bounces = 3;             // most lights that one path leaves
  int roulette_start = 2;      // first bounce after which Russian roulette may end the path, as IndirectSettings
  bool force_diffuse = false;
};

class VplSet {
 public:
  // Same bits for any number of threads. Buffers are reused by the next call.
  void trace(const VplTracing& tracing);

  VplView view() const;
  std::size_t bytes() const;                      // of the lights; not the buffers of the tracing
  double trace_ms() const { return trace_ms_; }   // wall time of the whole call
  std::uint64_t rays() const { return rays_; }
  double emitted_flux() const { return emitted_flux_; }  // Y, W: of all paths started
  // Y, W: what the lights of bounce k (from 0) send on, pi * intensity summed; `bounces` entries.
  const std::vector<double>& bounce_flux() const { return bounce_flux_; }

 private:
  // What the paths of one task leave. Tasks are put together in their order, whoever did them.
  struct Chunk {
    std::vector<Vpl> vpls;
    Box3 bounds;  // of their positions
    double emitted_flux = 0;
    std::vector<double> bounce_flux;
    std::uint64_t rays = 0;

    void start(int bounces);
    void keep(std::span<const Vpl> left, int bounce);
  };
  struct Launch;
  struct Buffers;
  static void trace_chunk(const Launch& job, int first, Buffers& buffers, Chunk& chunk);
  void concatenate(int chunks, int bounces);

  std::vector<double> cumulative_;  // flux of the lights
  std::vector<Chunk> chunks_;
  LargeArray<Vpl> vpls_;
  Box3 bounds_;
  float diagonal_ = 1;
  double trace_ms_ = 0, emitted_flux_ = 0;
  std::uint64_t rays_ = 0;
  std::vector<double> bounce_flux_;
};

}  // namespace lumigrove
