// What light samples send to many surfaces at once, and its way into arrays of rays and contributions.
#pragma once

#include <span>

#include "base/lanes.h"
#include "trace/ray.h"

namespace lumigrove {

template <int L>
struct LitLanes {
  LaneVec3<L> radiance;           // towards wo, if nothing is in between
  LaneVec3<L> origin, direction;  // shadow ray, from tmin to tmax
  Lanes<L> tmin, tmax;            // tmax <= 0 where there is no light
};

// Writes the first `count` lanes to shadow[index[k]] and contribution[index[k]]; nothing where there is no light.
template <int L, class Index>
LUMI_HD LUMI_ALWAYS_INLINE void write_lit(const LitLanes<L>& lit, int count, const Index* index,
                                          std::span<Ray> shadow, std::span<vec3> contribution) {
  const Lanes<L> columns[8] = {lit.origin.x,    lit.origin.y,    lit.origin.z,    lit.tmin,
                               lit.direction.x, lit.direction.y, lit.direction.z, lit.tmax};
  alignas(64) float ray[8][L], radiance[3][L];
  for (int w = 0; w < 8; ++w) store_lanes<L>(columns[w], ray[w]);
  store_lanes<L>(lit.radiance.x, radiance[0]);
  store_lanes<L>(lit.radiance.y, radiance[1]);
  store_lanes<L>(lit.radiance.z, radiance[2]);
  forget_registers();
  for (int k = 0; k < count; ++k) {
    if (!(ray[7][k] > 0)) continue;
    const auto i = static_cast<std::size_t>(index[k]);
    Ray& to = shadow[i];
    to.origin.x = ray[0][k], to.origin.y = ray[1][k], to.origin.z = ray[2][k], to.tmin = ray[3][k];
    to.direction.x = ray[4][k], to.direction.y = ray[5][k], to.direction.z = ray[6][k], to.tmax = ray[7][k];
    vec3& sent = contribution[i];
    sent.x = radiance[0][k], sent.y = radiance[1][k], sent.z = radiance[2][k];
  }
}

}  // namespace lumigrove
