// Surfaces, each number by itself so that a row of lanes can be read at once; and their gloss, many at once.
#pragma once

#include "base/lane_math.h"
#include "lights/light_set.h"
#include "lights/lit_lanes.h"
#include "methods/light_tree/light_tree_kernel.h"
#include "scene/surface.h"

namespace lumigrove {

struct alignas(64) SurfaceRows {
  float position[3][kWalkBatch] = {}, normal[3][kWalkBatch] = {}, geometric_normal[3][kWalkBatch] = {};
  float wo[3][kWalkBatch] = {}, diffuse[3][kWalkBatch] = {}, specular[3][kWalkBatch] = {};
  float roughness[kWalkBatch] = {}, epsilon[kWalkBatch] = {};
  bool any_gloss = false;

  // `gloss`: is the gloss lobe lit?
  LUMI_HD void set(int i, const Surface& s, bool gloss = true) {
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
    any_gloss = any_gloss || max_component(lit_specular) > 0;
  }
};

template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> load_rows(const float (&rows)[3][kWalkBatch], int first) {
  return {load_lanes<L>(rows[0] + first), load_lanes<L>(rows[1] + first), load_lanes<L>(rows[2] + first)};
}

// The gloss lobe's part of f; see bsdf.h. `cos_surface` > 0.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> gloss_lanes(const SurfaceRows& surfaces, int first,
                                                   const LaneVec3<L>& n, const LaneVec3<L>& wi,
                                                   const Lanes<L>& cos_surface) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-30f);
  const LaneVec3<L> wo = load_rows<L>(surfaces.wo, first), specular = load_rows<L>(surfaces.specular, first);
  const Lanes<L> roughness = load_lanes<L>(surfaces.roughness + first), alpha = roughness * roughness,
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

// f of both lobes. `lit_gloss`: 1 where the gloss lobe is lit, else 0.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> bsdf_lanes(const SurfaceRows& surfaces, int first, const LaneVec3<L>& n,
                                                  const LaneVec3<L>& wi, const Lanes<L>& cos_surface,
                                                  const Lanes<L>& lit_gloss = broadcast<L>(1)) {
  const LaneVec3<L> diffuse = load_rows<L>(surfaces.diffuse, first);
  const LaneVec3<L> f{diffuse.x * kInvPi, diffuse.y * kInvPi, diffuse.z * kInvPi};
  if (!surfaces.any_gloss) return f;
  const LaneVec3<L> gloss = gloss_lanes<L>(surfaces, first, n, wi, cos_surface);
  return {multiply_add<L>(gloss.x, lit_gloss, f.x), multiply_add<L>(gloss.y, lit_gloss, f.y),
          multiply_add<L>(gloss.z, lit_gloss, f.z)};
}

// Shadow rays from the surfaces towards points `y`, as far as `end` of the way, that send `radiance` towards wo. None where
// there is nothing to send, or more than a float holds.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LitLanes<L> lit_lanes_until(const SurfaceRows& surfaces, int first,
                                                       const LaneVec3<L>& radiance, const LaneVec3<L>& y,
                                                       const Lanes<L>& end) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1);
  const LaneVec3<L> x = load_rows<L>(surfaces.position, first),
                    geometric = load_rows<L>(surfaces.geometric_normal, first);
  const Lanes<L> epsilon = load_lanes<L>(surfaces.epsilon + first);
  LitLanes<L> lit;
  lit.radiance = radiance;
  lit.origin = {multiply_add<L>(geometric.x, epsilon, x.x), multiply_add<L>(geometric.y, epsilon, x.y),
                multiply_add<L>(geometric.z, epsilon, x.z)};
  lit.direction = {y.x - lit.origin.x, y.y - lit.origin.y, y.z - lit.origin.z};
  lit.tmin = zero;
  const Lanes<L> strength = max_lanes<L>(radiance.x, max_lanes<L>(radiance.y, radiance.z));
  const Lanes<L> sends = choose_where_greater<L>(broadcast<L>(3e38f), strength, strength, zero);
  lit.tmax = choose_where_greater<L>(sends, zero, end, zero - one);
  return lit;
}

// The same to points 1 / `inverse` away: they stop short of the light by the margin of shadow_ray.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LitLanes<L> lit_lanes(const SurfaceRows& surfaces, int first, const LaneVec3<L>& radiance,
                                                 const LaneVec3<L>& y, const Lanes<L>& inverse) {
  const Lanes<L> epsilon = load_lanes<L>(surfaces.epsilon + first);
  const Lanes<L> end =
      broadcast<L>(1) - min_lanes<L>(broadcast<L>(0.5f), multiply_add<L>(epsilon, inverse, broadcast<L>(1e-4f)));
  return lit_lanes_until<L>(surfaces, first, radiance, y, end);
}

// words[w][lane] = word w of the lane's emitter: p0, e1, e2.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE void load_emitters(const Emitter* const* emitters, int first, int count,
                                              Lanes<L> (&words)[16]) {
  constexpr int kWords = 9;
  LUMI_UNROLL(2)
  for (int part = 0; part < 16; part += L) {
    LUMI_UNROLL(16)
    for (int i = 0; i < L; ++i) {
      const int lane = glm::min(first + i, count - 1);
      words[part + i] = load_first_lanes<L>(&emitters[lane]->p0.x + part, glm::clamp(kWords - part, 0, L));
    }
    transpose_lanes<L>(words + part);
  }
}

}  // namespace lumigrove
