// Surfaces to be lit together, one a lane, and what they reflect: the arithmetic of bsdf_eval and shadow_ray.
#pragma once

#include "base/lane_math.h"
#include "lights/emitter.h"
#include "lights/lit_lanes.h"
#include "methods/light_tree/light_tree_kernel.h"
#include "scene/surface.h"

namespace lumigrove {

// Surfaces and the emitters chosen for them, each number by itself so that a row of lanes can be read at once.
struct alignas(64) LitSurfaces {
  float position[3][kWalkBatch] = {}, normal[3][kWalkBatch] = {}, geometric_normal[3][kWalkBatch] = {};
  float wo[3][kWalkBatch] = {}, diffuse[3][kWalkBatch] = {}, specular[3][kWalkBatch] = {};
  float roughness[kWalkBatch] = {}, epsilon[kWalkBatch] = {};
  float weight[kWalkBatch] = {};  // over the probability of the choice
  const Emitter* emitter[kWalkBatch];
  std::uint32_t index[kWalkBatch];
  int count = 0;
  bool any_gloss = false;

  // Returns its place. `gloss`: is its gloss lobe lit?
  LUMI_HD int add(std::uint32_t surface_index, const Surface& s, const Emitter& e, bool gloss, float over_probability) {
    const int i = count++;
    const vec3 lit_specular = gloss ? s.specular : vec3(0);
    for (int axis = 0; axis < 3; ++axis) {
      position[axis][i] = s.position[axis];
      normal[axis][i] = s.normal[axis];
      geometric_normal[axis][i] = s.geometric_normal[axis];
      wo[axis][i] = s.wo[axis];
      diffuse[axis][i] = s.diffuse[axis];
      specular[axis][i] = lit_specular[axis];
    }
    roughness[i] = s.roughness;
    epsilon[i] = s.epsilon;
    weight[i] = over_probability;
    emitter[i] = &e;
    index[i] = surface_index;
    any_gloss = any_gloss || max_component(lit_specular) > 0;
    return i;
  }
};

template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> load_rows(const float (&rows)[3][kWalkBatch], int first) {
  return {load_lanes<L>(rows[0] + first), load_lanes<L>(rows[1] + first), load_lanes<L>(rows[2] + first)};
}

// p0, e1 and e2 of each lane's emitter.
template <int L>
struct EmitterLanes {
  LaneVec3<L> p0, e1, e2;
};
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE EmitterLanes<L> load_emitters(const LitSurfaces& rows, int first) {
  constexpr int kWords = 9;
  Lanes<L> words[16];  // words[w][lane]
  LUMI_UNROLL(2)
  for (int part = 0; part < 16; part += L) {
    LUMI_UNROLL(16)
    for (int i = 0; i < L; ++i) {
      const int lane = glm::min(first + i, rows.count - 1);
      words[part + i] = load_first_lanes<L>(&rows.emitter[lane]->p0.x + part, glm::clamp(kWords - part, 0, L));
    }
    transpose_lanes<L>(words + part);
  }
  return {{words[0], words[1], words[2]}, {words[3], words[4], words[5]}, {words[6], words[7], words[8]}};
}

// The gloss lobe's part of f; see bsdf.h. `cos_surface` > 0.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> gloss_lanes(const LitSurfaces& rows, int first, const LaneVec3<L>& n,
                                                   const LaneVec3<L>& wi, const Lanes<L>& cos_surface) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-30f);
  const LaneVec3<L> wo = load_rows<L>(rows.wo, first), specular = load_rows<L>(rows.specular, first);
  const Lanes<L> roughness = load_lanes<L>(rows.roughness + first), alpha = roughness * roughness,
                 a2 = alpha * alpha, k = a2 * 0.5f;
  const LaneVec3<L> h{wi.x + wo.x, wi.y + wo.y, wi.z + wo.z};
  const Lanes<L> n_h = dot<L>(n, h), h2 = dot<L>(h, h), cos_view = dot<L>(n, wo);
  const LaneVec3<L> aside{h.x - n.x * n_h, h.y - n.y * n_h, h.z - n.z * n_h};
  const Lanes<L> q = multiply_add<L>(a2, n_h * n_h, dot<L>(aside, aside));
  const Lanes<L> shadowing = multiply_add<L>(cos_surface, one - k, k) * multiply_add<L>(cos_view, one - k, k);
  const Lanes<L> lobe = a2 * (h2 * h2) * (0.25f * kInvPi) * reciprocal<L>(max_lanes<L>(q * q * shadowing, tiny));
  const Lanes<L> v_h = min_lanes<L>(h2 * inverse_sqrt<L>(max_lanes<L>(h2, tiny)) * 0.5f, one);
  const Lanes<L> miss = one - v_h, miss2 = miss * miss, miss5 = miss2 * miss2 * miss;
  const Lanes<L> most = max_lanes<L>(specular.x, max_lanes<L>(specular.y, specular.z));
  const Lanes<L> seen = choose_where_greater<L>(min_lanes<L>(most, cos_view), zero, lobe, zero);
  return {multiply_add<L>(one - specular.x, miss5, specular.x) * seen,
          multiply_add<L>(one - specular.y, miss5, specular.y) * seen,
          multiply_add<L>(one - specular.z, miss5, specular.z) * seen};
}

// f(wi, wo), 1/sr, for wi above the surfaces.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> bsdf_lanes(const LitSurfaces& rows, int first, const LaneVec3<L>& n,
                                                  const LaneVec3<L>& wi, const Lanes<L>& cos_surface) {
  const LaneVec3<L> diffuse = load_rows<L>(rows.diffuse, first);
  const LaneVec3<L> f{diffuse.x * kInvPi, diffuse.y * kInvPi, diffuse.z * kInvPi};
  if (!rows.any_gloss) return f;
  const LaneVec3<L> gloss = gloss_lanes<L>(rows, first, n, wi, cos_surface);
  return {f.x + gloss.x, f.y + gloss.y, f.z + gloss.z};
}

// The shadow ray from the surface to `end`, or none where `radiance` is nothing, or more than a float holds.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LitLanes<L> lit_from(const LitSurfaces& rows, int first, const LaneVec3<L>& x,
                                                const LaneVec3<L>& end, const Lanes<L>& tmax,
                                                const LaneVec3<L>& radiance) {
  const Lanes<L> zero = broadcast<L>(0), epsilon = load_lanes<L>(rows.epsilon + first);
  const LaneVec3<L> geometric = load_rows<L>(rows.geometric_normal, first);
  LitLanes<L> lit;
  lit.radiance = radiance;
  lit.origin = {multiply_add<L>(geometric.x, epsilon, x.x), multiply_add<L>(geometric.y, epsilon, x.y),
                multiply_add<L>(geometric.z, epsilon, x.z)};
  lit.direction = {end.x - lit.origin.x, end.y - lit.origin.y, end.z - lit.origin.z};
  lit.tmin = zero;
  const Lanes<L> strength = max_lanes<L>(radiance.x, max_lanes<L>(radiance.y, radiance.z));
  const Lanes<L> sends = choose_where_greater<L>(broadcast<L>(3e38f), strength, strength, zero);
  lit.tmax = choose_where_greater<L>(sends, zero, tmax, zero - broadcast<L>(1));
  return lit;
}

}  // namespace lumigrove
