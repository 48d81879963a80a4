// Lights surfaces by the pools of their areas; light_pool_kernel.h holds the method and its header block.
#pragma once

#include <span>

#include "methods/light_sampling/light_pool_kernel.h"
#include "methods/light_sampling/surface_rows.h"

namespace lumigrove {

#if defined(__CUDACC__)
inline constexpr int kPoolLanes = 1;
#else
inline constexpr int kPoolLanes = 16;
#endif

// q_j at a point, L of them. At the light's own place, and where a float does not hold it, 0.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<L> pool_weights(const LightPool& pool, int first, const LaneVec3<L>& x,
                                                 const LaneVec3<L>& n) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-37f);
  const LaneVec3<L> d{load_lanes<L>(pool.x + first) - x.x, load_lanes<L>(pool.y + first) - x.y,
                      load_lanes<L>(pool.z + first) - x.z};
  const LaneVec3<L> axis{load_lanes<L>(pool.axis_x + first), load_lanes<L>(pool.axis_y + first),
                         load_lanes<L>(pool.axis_z + first)};
  const Lanes<L> d2 = dot<L>(d, d), inverse = reciprocal_sqrt<L>(max_lanes<L>(d2, tiny));
  const Lanes<L> back = dot<L>(axis, d) * inverse;  // - c
  const Lanes<L> cosine = max_lanes<L>(zero - back, back * load_lanes<L>(pool.two_sided + first));
  const Lanes<L> share = multiply_add<L>(cosine, load_lanes<L>(pool.scale + first), load_lanes<L>(pool.offset + first));
  const Lanes<L> facing = min_lanes<L>(max_lanes<L>(share, zero), one);
  const Lanes<L> cos_surface = max_lanes<L>(dot<L>(n, d) * inverse, zero);
  const Lanes<L> received = min_lanes<L>(facing * (inverse * inverse), load_lanes<L>(pool.most + first));
  const Lanes<L> weight = load_lanes<L>(pool.strength + first) * cos_surface * received;
  return choose_where_greater<L>(broadcast<L>(1e36f), weight, weight, zero);
}

// What one surface makes of its pool.
struct PoolWeights {
  alignas(64) float weights[kMaxPool];
  alignas(64) float sums[kMaxPool];
  float total = 0;

  LUMI_HD LUMI_ALWAYS_INLINE void set(const LightPool& pool, int size, vec3 x, vec3 n) {
    constexpr int L = kPoolLanes;
    total = 0;
    for (int first = 0; first < size; first += L) {
      const Lanes<L> w = pool_weights<L>(pool, first, broadcast<L>(x), broadcast<L>(n));
      store_lanes<L>(w, weights + first);
      store_lanes<L>(prefix_sum<L>(w) + broadcast<L>(total), sums + first);
      total = sums[first + L - 1];
    }
  }

  // The first whose sum is beyond the target, and of any weight.
  LUMI_HD LUMI_ALWAYS_INLINE int pick(int size, float target) const {
    constexpr int L = kPoolLanes;
    int last = 0;
    for (int first = 0; first < size; first += L) {
      const std::uint32_t positive = greater_bits<L>(load_lanes<L>(weights + first), broadcast<L>(0));
      const std::uint32_t beyond = greater_bits<L>(load_lanes<L>(sums + first), broadcast<L>(target)) & positive;
      if (beyond != 0) return first + lowest_bit(beyond);
      if (positive != 0) last = first + highest_bit(positive);
    }
    return last;
  }
};

// Samples that are made at once.
inline constexpr int kPoolSamples = 8;

// The lights that a batch of surfaces takes; weight 0 for none.
struct PoolChoices {
  const PoolLight* light[kPoolSamples][kWalkBatch];
  alignas(64) float weight[kPoolSamples][kWalkBatch];  // 1 / (P_j samples)
  float at_infinity[kPoolSamples][kWalkBatch];         // likewise, for a light at infinity instead
};

// words[w][lane] = word w of the lane's light.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE void load_pool_lights(const PoolLight* const* lights, Lanes<L> (&words)[16]) {
  LUMI_UNROLL(2)
  for (int part = 0; part < 16; part += L) {
    LUMI_UNROLL(16)
    for (int i = 0; i < L; ++i) words[part + i] = load_lanes<L>(&lights[i]->position.x + part);
    transpose_lanes<L>(words + part);
  }
}

// `vpl_gloss`: 1 for surfaces whose gloss virtual point lights light too, else 0.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE LitLanes<L> light_by_pool(const SurfaceRows& surfaces, int first,
                                                     const PoolLight* const* lights, const float* weights,
                                                     const float* vpl_gloss) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-37f);
  Lanes<L> words[16];
  load_pool_lights<L>(lights, words);
  const LaneVec3<L> y{words[0], words[1], words[2]}, axis{words[3], words[4], words[5]},
      strength{words[6], words[7], words[8]};
  const LaneVec3<L> x = load_rows<L>(surfaces.position, first), n = load_rows<L>(surfaces.normal, first),
                    geometric = load_rows<L>(surfaces.geometric_normal, first);
  const LaneVec3<L> to_light{y.x - x.x, y.y - x.y, y.z - x.z};
  const Lanes<L> d2 = dot<L>(to_light, to_light), inverse = inverse_sqrt<L>(max_lanes<L>(d2, tiny));
  const LaneVec3<L> wi{to_light.x * inverse, to_light.y * inverse, to_light.z * inverse};
  const Lanes<L> back = dot<L>(axis, wi);
  const Lanes<L> cosine = max_lanes<L>(zero - back, back * words[11]);
  const Lanes<L> share = min_lanes<L>(max_lanes<L>(multiply_add<L>(cosine, words[10], words[9]), zero), one);
  const Lanes<L> facing = choose_where_greater<L>(words[12], zero, share * share, share);
  const Lanes<L> of_range = d2 * words[13];
  const Lanes<L> window = max_lanes<L>(one - of_range * of_range, zero);
  const Lanes<L> cos_surface = dot<L>(n, wi);
  const Lanes<L> least = min_lanes<L>(min_lanes<L>(facing, d2 - tiny),
                                      min_lanes<L>(cos_surface, dot<L>(geometric, wi)));
  const Lanes<L> factor = choose_where_greater<L>(
      least, zero, load_lanes<L>(weights) * cos_surface * window * min_lanes<L>(facing * (inverse * inverse), words[15]),
      zero);
  const Lanes<L> clear = words[14], gloss = choose_where_greater<L>(clear, zero, load_lanes<L>(vpl_gloss), one);
  const LaneVec3<L> f = bsdf_lanes<L>(surfaces, first, n, wi, cos_surface, gloss);
  // Rays to virtual point lights end off the light's surface, to others short of it.
  const Lanes<L> margin = min_lanes<L>(
      broadcast<L>(0.5f), multiply_add<L>(load_lanes<L>(surfaces.epsilon + first), inverse, broadcast<L>(1e-4f)));
  const Lanes<L> end = choose_where_greater<L>(clear, zero, one, one - margin);
  const LaneVec3<L> target{multiply_add<L>(axis.x, clear, y.x), multiply_add<L>(axis.y, clear, y.y),
                           multiply_add<L>(axis.z, clear, y.z)};
  return lit_lanes_until<L>(surfaces, first,
                            {strength.x * f.x * factor, strength.y * f.y * factor, strength.z * f.z * factor}, target,
                            end);
}

// surfaces[i] -> shadow[s * surfaces + i] and contribution likewise, s < samples: rays that carry nothing are marked
// untraced. One call does kWalkBatch surfaces.
struct PoolLightKernel {
  LightSampler sampler;
  PoolLookup lookup;
  Rng rng;
  std::uint32_t dimension;
  int samples;
  int first_surface;  // number of surfaces[0] in the tile
  std::span<const Surface> surfaces;
  std::span<const std::uint32_t> pixels;
  std::span<const LightPool> pools;
  std::span<Ray> shadow;
  std::span<vec3> contribution;
  std::span<std::uint8_t> from_vpl = {};  // likewise: is it the light of a virtual point light? Empty: not wanted

  LUMI_HD void operator()(int batch) const {
    const std::size_t first = static_cast<std::size_t>(batch) * kWalkBatch;
    const int count = static_cast<int>(glm::min<std::size_t>(kWalkBatch, surfaces.size() - first));
    SurfaceRows rows;
    alignas(64) float vpl_gloss[kWalkBatch] = {};
    for (int k = 0; k < count; ++k) {
      const Surface& surface = surfaces[first + static_cast<std::size_t>(k)];
      rows.set(k, surface);
      vpl_gloss[k] = vpls_light_gloss(sampler.vpl_gloss, sampler.vpl_mirror_roughness, surface) ? 1.0f : 0.0f;
    }
    for (int s = 0; s < samples; s += kPoolSamples) light_samples(first, count, s, rows, vpl_gloss);
  }

 private:
  // Samples s, ..., s + kPoolSamples - 1.
  LUMI_HD void light_samples(std::size_t first, int count, int s, const SurfaceRows& rows,
                             const float* vpl_gloss) const {
    const int many = glm::min(kPoolSamples, samples - s);
    PoolChoices choices;
    for (int t = 0; t < many; ++t)
      for (int k = 0; k < kWalkBatch; ++k) {
        choices.light[t][k] = &pools[0].lights[0];
        choices.weight[t][k] = choices.at_infinity[t][k] = 0;
      }
    for (int k = 0; k < count; ++k) choose(first + static_cast<std::size_t>(k), k, s, many, choices);
    constexpr int L = kPoolLanes;
    for (int t = 0; t < many; ++t) {
      const std::size_t at = static_cast<std::size_t>(s + t) * surfaces.size() + first;
      for (int k = 0; k < count; k += L)
        write_lanes(light_by_pool<L>(rows, k, choices.light[t] + k, choices.weight[t] + k, vpl_gloss + k),
                    glm::min(L, count - k), at + static_cast<std::size_t>(k));
      if (!from_vpl.empty())
        for (int k = 0; k < count; ++k)
          from_vpl[at + static_cast<std::size_t>(k)] = choices.light[t][k]->vpl() ? 1 : 0;
    }
    const LightView& lights = sampler.lights;
    if (!lights.directional.empty() || lights.environment.present()) light_from_infinity(first, count, s, many, choices);
  }

  template <int L>
  LUMI_HD LUMI_ALWAYS_INLINE void write_lanes(const LitLanes<L>& lit, int count, std::size_t at) const {
    std::uint32_t index[L];
    for (int k = 0; k < count; ++k) {
      index[k] = static_cast<std::uint32_t>(at) + static_cast<std::uint32_t>(k);
      shadow[index[k]].tmax = -1;
      contribution[index[k]] = vec3(0);
    }
    write_lit<L>(lit, count, index, shadow, contribution);
  }

  LUMI_HD LUMI_ALWAYS_INLINE void choose(std::size_t i, int k, int s, int many, PoolChoices& choices) const {
    const Surface& surface = surfaces[i];
    if (surface.instance == kNoId) return;
    const Pixel pixel = pixel_of_index(lookup.areas.window, first_surface + static_cast<int>(i));
    const LightPool& pool = pools[static_cast<std::size_t>(lookup.pool_of(pixel))];
    PoolWeights weights;
    weights.set(pool, lookup.size, surface.position, surface.normal);
    const GroupProbabilities groups = group_probabilities(sampler, surface);
    const float local = local_share(groups, weights.total), inverse_samples = 1 / static_cast<float>(samples);
    vec4 u(0);
    for (int t = 0; t < many; ++t) {
      if (t % 4 == 0) u = Rng{rng.seed, rng.frame, pixels[i]}.uniform4(kDimPick + static_cast<std::uint32_t>(s + t));
      const float r = (static_cast<float>(s + t) + u[t % 4]) * inverse_samples;
      if (r < local) {
        const int j = weights.pick(lookup.size, r / local * weights.total);
        choices.light[t][k] = pool.lights + j;
        if (weights.weights[j] > 0) choices.weight[t][k] = inverse_samples * weights.total / (local * weights.weights[j]);
      } else if (local < 1) {
        choices.at_infinity[t][k] = inverse_samples / (1 - local);
      }
    }
  }

  // Share of the samples that go to local lights; 1 where there are no others. `total`: of the pool's weights.
  LUMI_HD float local_share(const GroupProbabilities& groups, float total) const {
    const float others = groups.directional + groups.environment;
    if (!(others > 0)) return 1;
    return total > 0 ? groups.local / (groups.local + others) : 0.0f;
  }

  LUMI_HD void light_from_infinity(std::size_t first, int count, int s, int many, const PoolChoices& choices) const {
    for (int k = 0; k < count; ++k)
      for (int t = 0; t < many; ++t) {
        if (!(choices.at_infinity[t][k] > 0)) continue;
        const std::size_t i = first + static_cast<std::size_t>(k);
        const std::size_t at = static_cast<std::size_t>(s + t) * surfaces.size() + i;
        const vec4 u = Rng{rng.seed, rng.frame, pixels[i]}.uniform4(dimension + 4 * static_cast<std::uint32_t>(s + t));
        const ChosenGroup group = choose_group_at_infinity(sampler, surfaces[i], u.x);
        const LightSample sample = light_in_group(sampler, surfaces[i], group, {}, vec2(u.y, u.z));
        const vec3 light = unoccluded_light(surfaces[i], sample) * choices.at_infinity[t][k];
        if (!(max_component(light) > 0) || !is_finite(light)) continue;
        contribution[at] = light;
        if (!from_vpl.empty()) from_vpl[at] = 0;
        shadow[at] = shadow_ray(surfaces[i], sample, sampler.lights.diagonal);
      }
  }
};

}  // namespace lumigrove
