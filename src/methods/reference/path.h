// Path tracing from a batch of visible surfaces: storage and launch order. path_kernel.h holds the method and
// its header block.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "lumigrove/vec.h"
#include "methods/light_sampling/direct_lighting.h"
#include "methods/reference/path_kernel.h"
#include "scene/surface.h"
#include "trace/trace.h"

namespace lumigrove {

// What all paths of a frame share. Plain data: copy freely.
struct PathTracing {
  DirectLighting lighting;  // at every vertex after the first; its `mis` also weighs what BSDF samples find
  int first_spp = 1;        // light samples that the caller takes at the first surface; with cuts their passes
  CutSamples first_cuts;    // below whose nodes they are; none: of the whole tree
  SplitSamples first_split;
  int max_bounces = 4;      // indirect bounces; 0: only the emitters that BSDF samples find (needs mis)
  int roulette_start = 3;   // first bounce that Russian roulette may end
  float light_scale = 1;    // settings.light_scale, which the light set was gathered with
  bool force_diffuse = false;
  bool bsdf_only = false;  // no light sampling: emitters are found by BSDF samples alone. Misses point, spot
                           // and directional lights. The oracle of light sampling.
};

// Working memory, reused from batch to batch, and counters that grow with every call.
struct PathBuffers {
  std::vector<std::uint32_t> kept, pixels;
  std::vector<Surface> surfaces, next_surfaces;
  std::vector<PathState> paths, next_paths;
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  std::vector<vec3> light;
  DirectBuffers direct;  // shadow rays at the vertices
  std::uint64_t path_rays = 0;
  double scatter_ms = 0, trace_ms = 0, arrive_ms = 0;

  void add_counters(const PathBuffers& other);
};

// direct[i] += light that surfaces[i] receives straight from emitters, as far as BSDF samples find it
// (nothing without mis): complete once the caller adds light sampling with the same `lighting`. indirect[i]
// += light that took 1 to max_bounces detours. Both are radiance towards the viewer. `pixels[i]` keys the
// random numbers; all spans have equal length; surfaces with instance == kNoId get nothing. Storage grows
// with the batch: give it an image in tiles.
void add_path_light(const PathTracing& tracing, std::span<const Surface> surfaces,
                    std::span<const std::uint32_t> pixels, PathBuffers& buffers, std::span<vec3> direct,
                    std::span<vec3> indirect);

}  // namespace lumigrove
