// Light of virtual point lights on many surfaces at once: the arithmetic of local_sample, a surface a lane.
#pragma once

#include "methods/light_sampling/surface_rows.h"

namespace lumigrove {

// Surfaces and the lights chosen for them.
struct alignas(64) VplLighting {
  SurfaceRows surfaces;
  float offset[kWalkBatch] = {};  // of the light from its surface, metres
  float weight[kWalkBatch] = {};  // over the probability of the choice
  const Emitter* emitter[kWalkBatch];
  std::uint32_t index[kWalkBatch];
  int count = 0;

  LUMI_HD void add(std::uint32_t surface_index, const Surface& s, const Emitter& e, const Vpl& vpl, bool gloss,
                   float over_probability) {
    const int i = count++;
    surfaces.set(i, s, gloss);
    offset[i] = vpl.epsilon;
    weight[i] = over_probability;
    emitter[i] = &e;
    index[i] = surface_index;
  }
};

// `clamp`: most of cos / d^2 at the light, 1/m^2.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LitLanes<L> light_by_vpls(const VplLighting& vpls, float clamp, int first) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-37f);
  Lanes<L> words[16];
  load_emitters<L>(vpls.emitter, first, vpls.count, words);
  const LaneVec3<L> y{words[0], words[1], words[2]}, normal{words[3], words[4], words[5]},
      intensity{words[6], words[7], words[8]};
  const LaneVec3<L> x = load_rows<L>(vpls.surfaces.position, first), n = load_rows<L>(vpls.surfaces.normal, first),
                    geometric = load_rows<L>(vpls.surfaces.geometric_normal, first);
  const LaneVec3<L> to_light{y.x - x.x, y.y - x.y, y.z - x.z};
  const Lanes<L> d2 = dot<L>(to_light, to_light), inverse = inverse_sqrt<L>(max_lanes<L>(d2, tiny));
  const LaneVec3<L> wi{to_light.x * inverse, to_light.y * inverse, to_light.z * inverse};
  const Lanes<L> cos_light = zero - dot<L>(wi, normal), cos_surface = dot<L>(n, wi);
  const Lanes<L> least = min_lanes<L>(min_lanes<L>(cos_light, d2 - tiny),
                                      min_lanes<L>(cos_surface, dot<L>(geometric, wi)));
  const Lanes<L> bounded = min_lanes<L>(cos_light * (inverse * inverse), broadcast<L>(glm::min(clamp, 3e38f)));
  const Lanes<L> factor = choose_where_greater<L>(
      least, zero, load_lanes<L>(vpls.weight + first) * cos_surface * bounded, zero);
  const LaneVec3<L> f = bsdf_lanes<L>(vpls.surfaces, first, n, wi, cos_surface);
  // The ray ends off the light's own surface.
  const Lanes<L> offset = load_lanes<L>(vpls.offset + first);
  const LaneVec3<L> clear{multiply_add<L>(normal.x, offset, y.x), multiply_add<L>(normal.y, offset, y.y),
                          multiply_add<L>(normal.z, offset, y.z)};
  return lit_lanes_until<L>(vpls.surfaces, first,
                            {intensity.x * f.x * factor, intensity.y * f.y * factor, intensity.z * f.z * factor}, clear,
                            one);
}

}  // namespace lumigrove
