// Bounds of the emitters' own cosine from cones of their normals, many at once.
#pragma once

#include "base/lanes.h"
#include "lights/packed_cone.h"

namespace lumigrove {

template <int W>
struct ConeLanes {
  LaneVec3<W> axis;  // times kConeAxis
  Lanes<W> radius;   // times kConeRadius / 2
};

// Upper bound of cos at the emitters, times the distance to the box: n' (x - y) over all y in the box and n' in the
// cone is at most axis (x - c) + |axis| h + radius (|x - c| + |h|), and the last sum at most sqrt(2) |far|.
// `to_centre` is c - x, `half` is h, `far` the distance to the box's farthest point.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<W> bound_facing(const ConeLanes<W>& cone, const LaneVec3<W>& to_centre,
                                                 const LaneVec3<W>& half, const Lanes<W>& far) {
  const Lanes<W> scaled = dot<W>(abs_lanes<W>(cone.axis), half) - dot<W>(cone.axis, to_centre);
  const Lanes<W> slack = cone.radius * (far * (1.41422f * 2 / kConeRadius));
  return multiply_add<W>(scaled, broadcast<W>(1 / kConeAxis), slack);
}

}  // namespace lumigrove
