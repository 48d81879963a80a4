// Direct light at a batch of surfaces: choose lights, trace one batch of shadow rays, add what gets through.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/rng.h"
#include "methods/light_bvh/light_bvh_kernel.h"
#include "methods/light_sampling/light_pool_kernel.h"
#include "methods/light_sampling/light_sampler_kernel.h"
#include "methods/lightcuts/cut_kernel.h"
#include "scene/surface.h"
#include "trace/trace.h"

namespace lumigrove {

// How lights are chosen at every surface of a frame. Plain data: copy freely.
struct DirectLighting {
  LightSampler sampler;
  const Tracer* tracer = nullptr;  // null: nothing is in the way of any light
  Rng rng;           // seed and frame; the pixel is set for each surface
  int spp = 1;       // light samples a surface, averaged
  bool all = false;  // instead: spp samples of every light, summed (the oracle)
  bool mis = false;  // weigh samples for use beside BSDF sampling (balance heuristic)
  // Cuts, where `use_cuts`: a sample below each node of a cut instead of `spp` samples of the whole tree. Only for all
  // surfaces of a tile, in the order of pixel_of_index.
  bool use_cuts = false;
  CutOptions cut;
  CutLookup lookup;
  // Pools, where `use_pools`: each surface takes `spp` of the lights that were drawn for its area. As cuts, only for all
  // surfaces of a tile.
  bool use_pools = false;
  PoolLookup pools;
  // Splitting, where `use_split`: `spp` samples below each part that the light BVH is split into.
  bool use_split = false;
  SplitOptions split;

  // For cuts and pools: the pixels whose surfaces are lit.
  void set_window(const PixelWindow& window) { lookup.window = pools.areas.window = window; }
};

// Working memory, reused from batch to batch. `rays` counts the shadow rays traced.
struct DirectBuffers {
  std::vector<Ray> shadow;
  std::vector<vec3> contribution;
  std::vector<std::uint8_t> occluded;
  std::vector<LightCut> cuts;
  std::vector<LightPool> pools;
  std::vector<std::uint32_t> split_entries;
  std::vector<std::uint8_t> split_counts;
  std::vector<std::uint8_t> from_vpl;
  std::span<vec3> vpl_sum;  // where not empty, light of virtual point lights is added here instead of to the sum
  std::uint64_t rays = 0;
  double cut_ms = 0, pool_ms = 0, split_ms = 0, select_ms = 0, trace_ms = 0;

  void add_counters(const DirectBuffers& other);
};

// sum[i] += light reaching surfaces[i] from the chosen lights and leaving it towards wo (radiance).
// `pixels[i]` keys the random numbers, `dimension` is the first one used (kDimLight of the path vertex). All
// spans have equal length; surfaces with instance == kNoId get nothing.
void add_direct_light(const DirectLighting& lighting, std::span<const Surface> surfaces,
                      std::span<const std::uint32_t> pixels, std::uint32_t dimension, DirectBuffers& buffers,
                      std::span<vec3> sum);

}  // namespace lumigrove
