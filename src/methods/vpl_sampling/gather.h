// Light that one more ray from a surface finds: mirrors, and what the clamp of virtual point lights takes away.
// gather_kernel.h holds the method and its header block.
#pragma once

#include <span>
#include <vector>

#include "methods/light_sampling/direct_lighting.h"
#include "methods/vpl_sampling/gather_kernel.h"
#include "methods/vpl_sampling/indirect_lighting.h"

namespace lumigrove {

// How arrivals are lit. Plain data: copy freely.
struct Gather {
  DirectLighting direct;      // of the arrivals; direct.spp is 1
  IndirectLighting indirect;  // of the arrivals; its sampler's mirror_roughness and clamp say which rays are sent
  bool compensate = false;    // send rays for the clamp
  bool force_diffuse = false;
};

struct GatherBuffers {
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  std::vector<GatherState> states, next_states;
  std::vector<std::uint32_t> kept, next_pixels;
  std::vector<Surface> next_surfaces;
  std::vector<vec3> light;
  DirectBuffers direct;
  IndirectBuffers indirect;
  std::uint64_t rays_traced = 0;
  double trace_ms = 0, surface_ms = 0;

  void add_counters(const GatherBuffers& other);
};

// sum[i] += radiance that leaves surfaces[i] towards wo by way of the ray. `pixels[i]` keys the random numbers. All spans
// have equal length.
void add_gathered_light(const Gather& gather, std::span<const Surface> surfaces,
                        std::span<const std::uint32_t> pixels, GatherBuffers& buffers, std::span<vec3> sum);

}  // namespace lumigrove
