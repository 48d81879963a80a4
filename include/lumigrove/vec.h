// Vectors, affine maps and boxes of the public API (GLM underneath), for host and device code.
#pragma once

// A function marked LUMI_HD compiles for the host and, under nvcc, for the device.
#if defined(__CUDACC__)
#include <cuda.h>  // GLM asks for it before its own headers
#define LUMI_HD __host__ __device__
#ifndef GLM_FORCE_CUDA
#define GLM_FORCE_CUDA
#endif
#else
#define LUMI_HD
#endif

#include <cstdint>
#include <glm/glm.hpp>
#include <limits>

namespace lumigrove {

using glm::mat3;
using glm::mat4;
using glm::mat4x3;  // affine map: 3x3 linear part in columns 0..2, translation in column 3
using glm::uvec2;
using glm::uvec3;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;

inline constexpr float kPi = 3.14159265358979323846f;
inline constexpr float kInvPi = 0.31830988618379067154f;
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Axis-aligned box; the default one is empty (inverted) and is the identity of `unite`.
struct Box3 {
  vec3 lo = vec3(kInfinity);
  vec3 hi = vec3(-kInfinity);

  LUMI_HD bool empty() const { return !(lo.x <= hi.x && lo.y <= hi.y && lo.z <= hi.z); }
  LUMI_HD vec3 centre() const { return 0.5f * (lo + hi); }
  LUMI_HD vec3 extent() const { return hi - lo; }
  LUMI_HD float diagonal() const { return empty() ? 0.0f : glm::length(hi - lo); }
};
LUMI_HD inline Box3 unite(Box3 a, vec3 p) { return {glm::min(a.lo, p), glm::max(a.hi, p)}; }
LUMI_HD inline Box3 unite(Box3 a, Box3 b) { return {glm::min(a.lo, b.lo), glm::max(a.hi, b.hi)}; }

}  // namespace lumigrove
