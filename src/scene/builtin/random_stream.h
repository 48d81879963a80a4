// Seeded random numbers for procedural scenes: a stream is a pure function of (seed, purpose, object), so
// that asking for more lights does not reshuffle the buildings. Same numbers on every platform (no std
// distributions).
#pragma once

#include <cstdint>

#include "base/rng.h"

namespace lumigrove::builtin {

class RandomStream {
 public:
  RandomStream(std::uint32_t seed, std::uint32_t purpose, std::uint32_t object = 0)
      : seed_(seed), purpose_(purpose), object_(object) {}

  std::uint32_t bits() {
    const int slot = static_cast<int>(count_ & 3u);
    if (slot == 0) block_ = pcg4d(uvec4(object_, purpose_, count_ >> 2, seed_));
    ++count_;
    return block_[slot];
  }
  float uniform() { return to_unit_float(bits()); }  // [0,1)
  float uniform(float lo, float hi) { return lo + (hi - lo) * uniform(); }
  int integer(int n) {
    return static_cast<int>((static_cast<std::uint64_t>(bits()) * static_cast<std::uint64_t>(n)) >> 32);
  }  // 0..n-1
  bool chance(float probability) { return uniform() < probability; }

 private:
  std::uint32_t seed_, purpose_, object_;
  std::uint32_t count_ = 0;
  uvec4 block_ = uvec4(0);
};

}  // namespace lumigrove::builtin
