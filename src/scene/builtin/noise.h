// Value noise on the integer lattice and its fractal sum, for terrain, stains and puddles.
#pragma once

#include "base/rng.h"

namespace lumigrove::builtin {

// In [0,1), quintic between lattice points.
inline float value_noise(vec2 p, std::uint32_t seed) {
  const vec2 cell = glm::floor(p), f = p - cell, w = f * f * f * (f * (f * 6.0f - 15.0f) + 10.0f);
  const auto lattice = [&](int dx, int dy) {
    const auto x = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell.x) + dx);
    const auto y = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell.y) + dy);
    return to_unit_float(pcg4d(uvec4(x, y, seed, 0x6e6f6973u)).x);
  };
  return glm::mix(glm::mix(lattice(0, 0), lattice(1, 0), w.x), glm::mix(lattice(0, 1), lattice(1, 1), w.x),
                  w.y);
}

// Octaves of halving amplitude and wavelength, normalised to [0,1).
inline float fractal_noise(vec2 p, int octaves, std::uint32_t seed) {
  float sum = 0, amplitude = 1, total = 0;
  for (int i = 0; i < octaves; ++i) {
    sum += amplitude * value_noise(p, seed + static_cast<std::uint32_t>(i));
    total += amplitude;
    amplitude *= 0.5f;
    p = p * 2.0f + 17.0f;
  }
  return sum / total;
}

}  // namespace lumigrove::builtin
