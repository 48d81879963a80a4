// Light from virtual point lights at a batch of surfaces: choose lights, trace one batch of shadow rays, add what gets
// through.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/rng.h"
#include "methods/light_sampling/direct_lighting.h"
#include "methods/vpl_sampling/indirect_lighting_kernel.h"
#include "scene/surface.h"
#include "trace/trace.h"

namespace lumigrove {

// How lights are chosen at every surface of a frame. Plain data: copy freely.
struct IndirectLighting {
  VplSampler sampler;
  const Tracer* tracer = nullptr;  // null: nothing is in the way of any light
  Rng rng;           // seed and frame; the pixel is set for each surface
  int spp = 1;       // samples a surface, averaged
  bool all = false;  // instead: every light, summed (the oracle)
  // Instead, where `use_light_tree`: the lights are emitters of a light set, chosen as those of direct light.
  bool use_light_tree = false;
  DirectLighting light_tree;
};

// Working memory, reused from batch to batch. `rays` counts the shadow rays traced. `traces` is filled, by the first
// sample, where `wants_traces`.
struct IndirectBuffers {
  std::vector<Ray> shadow;
  std::vector<vec3> contribution;
  std::vector<std::uint8_t> occluded, corrected;
  std::vector<VplTrace> traces;
  bool wants_traces = false;
  DirectBuffers light_tree;
  std::uint64_t rays = 0;
  double select_ms = 0, trace_ms = 0;

  // Those of `light_tree` are among the others afterwards.
  void add_counters(const IndirectBuffers& other);
};

// sum[i] += light of the virtual point lights that reaches surfaces[i] and leaves it towards wo (radiance).
// `pixels[i]` keys the random numbers, `dimension` is the first one used. All spans have equal length; surfaces with
// instance == kNoId get nothing.
void add_indirect_light(const IndirectLighting& lighting, std::span<const Surface> surfaces,
                        std::span<const std::uint32_t> pixels, std::uint32_t dimension, IndirectBuffers& buffers,
                        std::span<vec3> sum);

}  // namespace lumigrove
