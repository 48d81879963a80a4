// Counter-based random numbers: a sample is a pure function of (seed, frame, pixel, dimension), so that an image
// has the same bits for any thread count. Hash: pcg4d of Jarzynski & Olano, "Hash Functions for GPU Rendering",
// JCGT 9(3), 2020.
#pragma once

#include "base/vec.h"

namespace lumigrove {

LUMI_HD inline uvec4 pcg4d(uvec4 v) {
  v = v * 1664525u + 1013904223u;
  v.x += v.y * v.w;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  v.w += v.y * v.z;
  v ^= v >> 16u;
  v.x += v.y * v.w;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  v.w += v.y * v.z;
  return v;
}

// Uniform in [0,1) with 24 bits; never 1.
LUMI_HD inline float to_unit_float(std::uint32_t bits) { return static_cast<float>(bits >> 8) * 0x1p-24f; }

// First dimensions of the steps of a frame, so that no two steps share a number. A path vertex at depth k adds
// k * kDimensionsPerVertex.
enum Dimension : std::uint32_t {
  kDimPixel = 0,    // 2: position in the pixel
  kDimLight = 4,    // light selection (1), point on the light (2), spare (1); +4 per further light sample
  kDimBsdf = 2048,  // lobe (1), direction (2), roulette (1)
  kDimensionsPerVertex = 4096,
  kDimVpl = 1u << 28,       // tracing of virtual point lights: emission first, then 4 for every bounce
  kDimIndirect = 2u << 28,  // sampling of virtual point lights: 12 for each sample
  kDimGather = 3u << 28,    // one more ray from a surface, and the light where it arrives
  kDimCut = 4u << 28,       // 1: pixel that a block's cut is chosen for
  kDimPool = 5u << 28,      // lights of a block: 4 each
  kDimPick = 6u << 28,      // which of them a pixel takes: 1 each
};

// Random numbers of one pixel of one frame. `dimension` counts single floats; blocks of four share one hash.
struct Rng {
  std::uint32_t seed = 0, frame = 0, pixel = 0;

  LUMI_HD vec4 uniform4(std::uint32_t dimension) const {
    const uvec4 h = pcg4d(uvec4(pixel, frame, dimension >> 2, seed));
    return vec4(to_unit_float(h.x), to_unit_float(h.y), to_unit_float(h.z), to_unit_float(h.w));
  }
};

}  // namespace lumigrove
