// Light of plain triangles (no texture, no holes) on many surfaces at once: the arithmetic of local_sample, bsdf_eval and
// shadow_ray, a surface a lane.
#pragma once

#include "base/lane_math.h"
#include "lights/emitter.h"
#include "lights/lit_lanes.h"
#include "methods/light_tree/light_tree_kernel.h"
#include "scene/surface.h"

namespace lumigrove {

// Surfaces and the triangles chosen for them, each number by itself so that a row of lanes can be read at once.
struct alignas(64) TriangleLighting {
  float position[3][kWalkBatch] = {}, normal[3][kWalkBatch] = {}, geometric_normal[3][kWalkBatch] = {};
  float wo[3][kWalkBatch] = {}, diffuse[3][kWalkBatch] = {}, specular[3][kWalkBatch] = {};
  float radiance[3][kWalkBatch] = {};  // of the emitter
  float u[2][kWalkBatch] = {};         // point on it
  float double_sided[kWalkBatch] = {}, roughness[kWalkBatch] = {}, epsilon[kWalkBatch] = {};
  float weight[kWalkBatch] = {};       // over the probability of the choice
  const Emitter* emitter[kWalkBatch];
  std::uint32_t index[kWalkBatch];
  int count = 0;
  bool any_gloss = false;

  LUMI_HD void add(std::uint32_t surface_index, const Surface& s, const Emitter& e, const EmissiveInstance& instance,
                   vec2 numbers, float over_probability) {
    const int i = count++;
    for (int axis = 0; axis < 3; ++axis) {
      position[axis][i] = s.position[axis];
      normal[axis][i] = s.normal[axis];
      geometric_normal[axis][i] = s.geometric_normal[axis];
      wo[axis][i] = s.wo[axis];
      diffuse[axis][i] = s.diffuse[axis];
      specular[axis][i] = s.specular[axis];
      radiance[axis][i] = instance.radiance[axis];
    }
    u[0][i] = numbers.x;
    u[1][i] = numbers.y;
    double_sided[i] = instance.double_sided ? 1.0f : 0.0f;
    roughness[i] = s.roughness;
    epsilon[i] = s.epsilon;
    weight[i] = over_probability;
    emitter[i] = &e;
    index[i] = surface_index;
    any_gloss = any_gloss || max_component(s.specular) > 0;
  }
};

template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> load_rows(const float (&rows)[3][kWalkBatch], int first) {
  return {load_lanes<L>(rows[0] + first), load_lanes<L>(rows[1] + first), load_lanes<L>(rows[2] + first)};
}

// words[w][lane] = word w of the lane's emitter: p0, e1, e2.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE void load_emitters(const TriangleLighting& triangles, int first, Lanes<L> (&words)[16]) {
  constexpr int kWords = 9;
  LUMI_UNROLL(2)
  for (int part = 0; part < 16; part += L) {
    LUMI_UNROLL(16)
    for (int i = 0; i < L; ++i) {
      const int lane = glm::min(first + i, triangles.count - 1);
      words[part + i] = load_first_lanes<L>(&triangles.emitter[lane]->p0.x + part, glm::clamp(kWords - part, 0, L));
    }
    transpose_lanes<L>(words + part);
  }
}

// The gloss lobe's part of f; see bsdf.h. `cos_surface` > 0.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<L> gloss_lanes(const TriangleLighting& triangles, int first,
                                                   const LaneVec3<L>& n, const LaneVec3<L>& wi,
                                                   const Lanes<L>& cos_surface) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-30f);
  const LaneVec3<L> wo = load_rows<L>(triangles.wo, first), specular = load_rows<L>(triangles.specular, first);
  const Lanes<L> roughness = load_lanes<L>(triangles.roughness + first), alpha = roughness * roughness,
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

template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LitLanes<L> light_by_triangles(const TriangleLighting& triangles, int first) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-37f);
  Lanes<L> words[16];
  load_emitters<L>(triangles, first, words);
  const LaneVec3<L> p0{words[0], words[1], words[2]}, e1{words[3], words[4], words[5]},
      e2{words[6], words[7], words[8]};
  // A point uniform by area.
  const Lanes<L> u = load_lanes<L>(triangles.u[0] + first);
  const Lanes<L> root = u * inverse_sqrt<L>(max_lanes<L>(u, tiny));
  const Lanes<L> b1 = one - root, b2 = load_lanes<L>(triangles.u[1] + first) * root;
  const LaneVec3<L> y{multiply_add<L>(e2.x, b2, multiply_add<L>(e1.x, b1, p0.x)),
                      multiply_add<L>(e2.y, b2, multiply_add<L>(e1.y, b1, p0.y)),
                      multiply_add<L>(e2.z, b2, multiply_add<L>(e1.z, b1, p0.z))};
  const LaneVec3<L> x = load_rows<L>(triangles.position, first), n = load_rows<L>(triangles.normal, first),
                    geometric = load_rows<L>(triangles.geometric_normal, first);
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

  const LaneVec3<L> diffuse = load_rows<L>(triangles.diffuse, first);
  LaneVec3<L> f{diffuse.x * kInvPi, diffuse.y * kInvPi, diffuse.z * kInvPi};
  if (triangles.any_gloss) {
    const LaneVec3<L> gloss = gloss_lanes<L>(triangles, first, n, wi, cos_surface);
    f = {f.x + gloss.x, f.y + gloss.y, f.z + gloss.z};
  }
  const LaneVec3<L> radiance = load_rows<L>(triangles.radiance, first);
  LitLanes<L> lit;
  lit.radiance = {radiance.x * f.x * factor, radiance.y * f.y * factor, radiance.z * f.z * factor};

  const Lanes<L> epsilon = load_lanes<L>(triangles.epsilon + first);
  lit.origin = {multiply_add<L>(geometric.x, epsilon, x.x), multiply_add<L>(geometric.y, epsilon, x.y),
                multiply_add<L>(geometric.z, epsilon, x.z)};
  lit.direction = {y.x - lit.origin.x, y.y - lit.origin.y, y.z - lit.origin.z};
  lit.tmin = zero;
  const Lanes<L> strength = max_lanes<L>(lit.radiance.x, max_lanes<L>(lit.radiance.y, lit.radiance.z));
  // Nothing to send, or more than a float holds.
  const Lanes<L> sends = choose_where_greater<L>(broadcast<L>(3e38f), strength, strength, zero);
  const Lanes<L> end = one - min_lanes<L>(broadcast<L>(0.5f), multiply_add<L>(epsilon, inverse, broadcast<L>(1e-4f)));
  lit.tmax = choose_where_greater<L>(sends, zero, end, zero - one);
  return lit;
}

}  // namespace lumigrove
