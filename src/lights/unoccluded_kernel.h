// Adds light samples once their shadow rays are answered.
#pragma once

#include <cstdint>
#include <span>

#include "base/vec.h"

namespace lumigrove {

struct AddUnoccludedKernel {
  std::span<const vec3> contribution;
  std::span<const std::uint8_t> occluded;
  std::span<vec3> sum;

  LUMI_HD void operator()(int i) const {
    const std::size_t k = static_cast<std::size_t>(i);
    if (!occluded[k]) sum[k] += contribution[k];
  }
};

// The same, apart for light of virtual point lights.
struct AddUnoccludedByKindKernel {
  std::span<const vec3> contribution;
  std::span<const std::uint8_t> occluded, from_vpl;
  std::span<vec3> sum, vpl_sum;

  LUMI_HD void operator()(int i) const {
    const std::size_t k = static_cast<std::size_t>(i);
    if (!occluded[k]) (from_vpl[k] ? vpl_sum : sum)[k] += contribution[k];
  }
};

}  // namespace lumigrove
