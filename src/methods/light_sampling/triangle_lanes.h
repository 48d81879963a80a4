// Light of plain triangles (no texture, no holes) on many surfaces at once: the arithmetic of local_sample, a surface a lane.
#pragma once

#include "lights/emitter.h"
#include "methods/light_sampling/surface_rows.h"

namespace lumigrove {

// Surfaces and the triangles chosen for them.
struct alignas(64) TriangleLighting {
  SurfaceRows surfaces;
  float radiance[3][kWalkBatch] = {};  // of the emitter
  float u[2][kWalkBatch] = {};         // point on it
  float double_sided[kWalkBatch] = {};
  float weight[kWalkBatch] = {};       // over the probability of the choice
  const Emitter* emitter[kWalkBatch];
  std::uint32_t index[kWalkBatch];
  int count = 0;

  LUMI_HD void add(std::uint32_t surface_index, const Surface& s, const Emitter& e, const EmissiveInstance& instance,
                   vec2 numbers, float over_probability) {
    const int i = count++;
    surfaces.set(i, s);
    for (int axis = 0; axis < 3; ++axis) radiance[axis][i] = instance.radiance[axis];
    u[0][i] = numbers.x;
    u[1][i] = numbers.y;
    double_sided[i] = instance.double_sided ? 1.0f : 0.0f;
    weight[i] = over_probability;
    emitter[i] = &e;
    index[i] = surface_index;
  }
};

template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LitLanes<L> light_by_triangles(const TriangleLighting& triangles, int first) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-37f);
  Lanes<L> words[16];
  load_emitters<L>(triangles.emitter, first, triangles.count, words);
  const LaneVec3<L> p0{words[0], words[1], words[2]}, e1{words[3], words[4], words[5]},
      e2{words[6], words[7], words[8]};
  // A point uniform by area.
  const Lanes<L> u = load_lanes<L>(triangles.u[0] + first);
  const Lanes<L> root = u * inverse_sqrt<L>(max_lanes<L>(u, tiny));
  const Lanes<L> b1 = one - root, b2 = load_lanes<L>(triangles.u[1] + first) * root;
  const LaneVec3<L> y{multiply_add<L>(e2.x, b2, multiply_add<L>(e1.x, b1, p0.x)),
                      multiply_add<L>(e2.y, b2, multiply_add<L>(e1.y, b1, p0.y)),
                      multiply_add<L>(e2.z, b2, multiply_add<L>(e1.z, b1, p0.z))};
  const LaneVec3<L> x = load_rows<L>(triangles.surfaces.position, first), n = load_rows<L>(triangles.surfaces.normal, first),
                    geometric = load_rows<L>(triangles.surfaces.geometric_normal, first);
  const LaneVec3<L> to_light{y.x - x.x, y.y - x.y, y.z - x.z};
  const Lanes<L> d2 = dot<L>(to_light, to_light), inverse = inverse_sqrt<L>(max_lanes<L>(d2, tiny));
  const LaneVec3<L> wi{to_light.x * inverse, to_light.y * inverse, to_light.z * inverse};
  const LaneVec3<L> area2{e1.y * e2.z - e1.z * e2.y, e1.z * e2.x - e1.x * e2.z, e1.x * e2.y - e1.y * e2.x};
  // cos at the light times twice the area, without a root.
  const Lanes<L> facing = zero - dot<L>(wi, area2);
  const Lanes<L> cos_area2 = choose_where_greater<L>(load_lanes<L>(triangles.double_sided + first), zero,
                                                     abs_lanes<L>(facing), facing);
  const Lanes<L> cos_surface = dot<L>(n, wi);
  const Lanes<L> least = min_lanes<L>(min_lanes<L>(cos_area2, d2 - tiny),
                                      min_lanes<L>(cos_surface, dot<L>(geometric, wi)));
  const Lanes<L> factor = choose_where_greater<L>(
      least, zero, load_lanes<L>(triangles.weight + first) * cos_surface * cos_area2 * 0.5f * (inverse * inverse), zero);

  const LaneVec3<L> f = bsdf_lanes<L>(triangles.surfaces, first, n, wi, cos_surface);
  const LaneVec3<L> radiance = load_rows<L>(triangles.radiance, first);
  return lit_lanes<L>(triangles.surfaces, first,
                      {radiance.x * f.x * factor, radiance.y * f.y * factor, radiance.z * f.z * factor}, y, inverse);
}

}  // namespace lumigrove
