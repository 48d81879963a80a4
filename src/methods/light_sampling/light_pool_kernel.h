// Method      Draws lights once for a block of pixels; every pixel takes some of them, in proportion to what each would
//             send if nothing were in the way.
// Paper       none of its own. J. Talbot, D. Cline, P. Egbert, "Importance Resampling for Global Illumination", EGSR 2005,
//             for the choice among the drawn; B. Walter et al., "Lightcuts", SIGGRAPH 2005, whose clusters stand by one
//             light for all pixels; D. Lin, C. Yuksel, "Real-Time Stochastic Lightcuts", Proc. ACM CGIT 3(1) (I3D 2020),
//             for blocks that share their look at the tree.
// Symbols     y_j, p_j -> LightPool -> point on a light, drawn for the block; probability of the light, uniform on it
//             q_j(x) -> pool_weights -> Y of the irradiance at x from y_j, unoccluded, over p_j and the pool's size
//             P_j(x) = q_j / sum q -> PoolPick::pdf / p_j -> probability with which x takes y_j
// Equations   L(x) = mean over the picks of f(y_j) / (p_j M P_j), M the size of the pool
// Departures  The walks are those of the light tree, weighed for the whole block instead of one point: WalkRegion.
// Estimator   unbiased: every light that can reach a point of the block is drawn with positive probability, and one that
//             reaches x has q_j > 0. Pixels of a block share their lights, so their errors go together.
// In -> Out   surfaces of a tile -> a LightPool for every block; surfaces, pools -> picks
// Oracle      tests/light_pool_test.cpp: exhaustive sum, positive probability, picks against their weights.
#pragma once

#include <span>

#include "base/lane_math.h"
#include "base/rng.h"
#include "methods/light_sampling/light_sampler_kernel.h"
#include "methods/lightcuts/cut_kernel.h"

namespace lumigrove {

inline constexpr int kMaxPool = 64, kMaxDraws = 1024;  // lights of a pool, and of an area

#if defined(__CUDACC__)
inline constexpr int kPoolLanes = 1;
#else
inline constexpr int kPoolLanes = 16;
#endif

struct alignas(64) LightPool {
  float x[kMaxPool], y[kMaxPool], z[kMaxPool];
  float nx[kMaxPool], ny[kMaxPool], nz[kMaxPool];  // direction of most light
  float strength[kMaxPool];                        // Y over p_j M
  // Share of it that leaves at a cosine c to that direction: offset + scale * max(c, -c * two_sided), from 0 to 1.
  float offset[kMaxPool], scale[kMaxPool], two_sided[kMaxPool];
  std::uint32_t emitter[kMaxPool];
  float pdf[kMaxPool];  // p_j M
  vec2 u[kMaxPool];     // the point on it
};

// Which pool a pixel takes its lights from. An area of share x interleave pixels squared has interleave^2 pools; neighbours
// use different ones, so that what they have in common does not show as blocks.
struct PoolLookup {
  CutLookup areas;      // share: edge of an area
  int interleave = 1;   // m

  LUMI_HD int pools_per_area() const { return interleave * interleave; }
  LUMI_HD int pools() const { return areas.blocks() * pools_per_area(); }
  LUMI_HD int pool_of(Pixel pixel) const {
    const int m = interleave;
    const auto quad_x = static_cast<std::uint32_t>(pixel.x / m), quad_y = static_cast<std::uint32_t>(pixel.y / m);
    const std::uint32_t turn = pcg4d(uvec4(quad_x, quad_y, areas.frame, 0x51ab3f1u)).x >> 8;
    const std::uint32_t place = static_cast<std::uint32_t>(pixel.y % m * m + pixel.x % m) + turn;
    const auto number = static_cast<int>(place % static_cast<std::uint32_t>(m * m));
    return areas.block_of(pixel) * pools_per_area() + number;
  }
};

// Where the surfaces of a block lie: in a box, their normals n with |n - normal| <= spread.
struct BlockBounds {
  Box3 box;
  vec3 normal = vec3(0);
  float spread = 0;
  bool present = false;
};

LUMI_HD inline BlockBounds bounds_of_block(const CutLookup& lookup, const PixelWindow& pixels,
                                           std::span<const Surface> surfaces) {
  BlockBounds bounds;
  vec3 normals(0);
  const auto each = [&](const auto& f) {
    for (int k = 0; k < pixels.count(); ++k) {
      const Pixel pixel{pixels.x0 + k % pixels.width(), pixels.y0 + k / pixels.width()};
      const Surface& s = surfaces[static_cast<std::size_t>(index_of_pixel(lookup.window, pixel))];
      if (s.instance != kNoId) f(s);
    }
  };
  each([&](const Surface& s) {
    bounds.present = true;
    bounds.box = unite(bounds.box, s.position);
    normals += s.normal;
  });
  const float length = glm::length(normals);
  if (length > 1e-3f) bounds.normal = normals * (1 / length);
  float spread2 = 0;
  each([&](const Surface& s) { spread2 = glm::max(spread2, length_squared(s.normal - bounds.normal)); });
  bounds.spread = glm::sqrt(spread2);
  return bounds;
}

// Makes light j of a pool from what a walk chose; strength 0 where it chose none.
LUMI_HD inline void set_pool_light(const LightSampler& sampler, TreeSample chosen, vec2 u, int size, LightPool& pool,
                                   int j) {
  pool.strength[j] = 0;
  pool.x[j] = pool.y[j] = pool.z[j] = pool.nx[j] = pool.ny[j] = pool.nz[j] = 0;
  pool.offset[j] = pool.scale[j] = 0;
  pool.two_sided[j] = -1;
  pool.emitter[j] = chosen.emitter;
  pool.pdf[j] = chosen.pdf * static_cast<float>(size);
  pool.u[j] = u;
  if (!(chosen.pdf > 0)) return;
  const Emitter& e = sampler.lights.emitters[chosen.emitter];
  vec3 position = e.p0, normal(0);
  pool.strength[j] = emitter_intensity(sampler.lights, chosen.emitter) / pool.pdf[j];
  if (e.punctual()) {
    const bool spot = sampler.lights.punctual[e.source & ~Emitter::kPunctual].spot;
    pool.offset[j] = spot ? -e.e2.x * e.e2.y : 1.0f;
    pool.scale[j] = spot ? e.e2.y : 0.0f;
    normal = spot ? e.e1 : vec3(0);
  } else {
    const float root = glm::sqrt(u.x), b1 = 1 - root, b2 = u.y * root;
    position += e.e1 * b1 + e.e2 * b2;
    const vec3 n = glm::cross(e.e1, e.e2);
    normal = n * (1 / glm::sqrt(glm::max(length_squared(n), 1e-37f)));
    pool.scale[j] = 1;
    if (sampler.lights.instances[e.source].double_sided) pool.two_sided[j] = 1;
  }
  pool.x[j] = position.x, pool.y[j] = position.y, pool.z[j] = position.z;
  pool.nx[j] = normal.x, pool.ny[j] = normal.y, pool.nz[j] = normal.z;
}

// The pools of an area share out lights that are drawn together, each from a stratum of its own.
struct PoolKernel {
  LightSampler sampler;
  PoolLookup lookup;
  Rng rng;
  int size;
  std::span<const Surface> surfaces;
  std::span<LightPool> pools;

  LUMI_HD void operator()(int area) const {
    const int many = lookup.pools_per_area(), count = many * size;
    TreeSample chosen[kMaxDraws];
    vec2 u[kMaxDraws];
    draw(area, count, chosen, u);
    for (int j = 0; j < count; ++j)
      set_pool_light(sampler, chosen[j], u[j], size, pools[static_cast<std::size_t>(area * many + j % many)], j / many);
  }

 private:
  LUMI_HD void draw(int area, int count, TreeSample* chosen, vec2* u) const {
    const PixelWindow pixels = lookup.areas.pixels_of(area);
    const BlockBounds bounds = bounds_of_block(lookup.areas, pixels, surfaces);
    const LightTreeView& tree = sampler.tree;
    if (!bounds.present || tree.count == 0) {
      for (int j = 0; j < count; ++j) chosen[j] = {};
      return;
    }
    const auto corner = static_cast<std::uint32_t>(pixels.y0) * 65536u + static_cast<std::uint32_t>(pixels.x0);
    const Rng numbers{rng.seed, rng.frame, corner};
    float r[kMaxDraws], fresh[kMaxDraws];
    for (int j = 0; j < count; ++j) {
      const vec4 v = numbers.uniform4(kDimPool + 4 * static_cast<std::uint32_t>(j));
      r[j] = glm::min((static_cast<float>(j) + v.x) / static_cast<float>(count), 0x1.fffffep-1f);
      fresh[j] = v.w;
      u[j] = vec2(v.y, v.z);
    }
    const WalkRegion region{0.5f * (bounds.box.hi - bounds.box.lo), bounds.spread};
    WalkRange ranges[kMaxDraws], next[kMaxDraws];
    with_width(tree.width, [&](auto w) {
      sample_light_tree_sorted<w>(tree, bounds.box.centre(), bounds.normal, region, count, r, fresh, ranges, next,
                                  chosen);
    });
    for (int j = 0; j < count; ++j)
      if (chosen[j].pdf > 0) prefetch(&sampler.lights.emitters[chosen[j].emitter]);
  }
};

// q_j at a point, L of them.
template <int L>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<L> pool_weights(const LightPool& pool, int first, const LaneVec3<L>& x,
                                                 const LaneVec3<L>& n) {
  const Lanes<L> zero = broadcast<L>(0), one = broadcast<L>(1), tiny = broadcast<L>(1e-37f);
  const LaneVec3<L> d{load_lanes<L>(pool.x + first) - x.x, load_lanes<L>(pool.y + first) - x.y,
                      load_lanes<L>(pool.z + first) - x.z};
  const LaneVec3<L> axis{load_lanes<L>(pool.nx + first), load_lanes<L>(pool.ny + first),
                         load_lanes<L>(pool.nz + first)};
  const Lanes<L> inverse = reciprocal_sqrt<L>(max_lanes<L>(dot<L>(d, d), tiny));
  const Lanes<L> back = dot<L>(axis, d) * inverse;  // - cosine
  const Lanes<L> cosine = max_lanes<L>(zero - back, back * load_lanes<L>(pool.two_sided + first));
  const Lanes<L> leaves = multiply_add<L>(cosine, load_lanes<L>(pool.scale + first), load_lanes<L>(pool.offset + first));
  const Lanes<L> facing = min_lanes<L>(max_lanes<L>(leaves, zero), one);
  const Lanes<L> cos_surface = max_lanes<L>(dot<L>(n, d) * inverse, zero);
  return load_lanes<L>(pool.strength + first) * facing * cos_surface * (inverse * inverse);
}

struct PoolPick {
  float pdf = 0;           // p_j M P_j, of its group too; 0: nothing to take
  std::int32_t light = 0;  // of the pool; kAtInfinity: a light at infinity instead
  static constexpr std::int32_t kAtInfinity = -1;
};

// picks[s * surfaces + i], s < samples.
struct PickKernel {
  LightSampler sampler;
  PoolLookup lookup;
  Rng rng;
  int size, samples;
  std::span<const Surface> surfaces;
  std::span<const std::uint32_t> pixels;
  std::span<const LightPool> pools;
  std::span<PoolPick> picks;

  LUMI_HD void operator()(int index) const {
    const auto i = static_cast<std::size_t>(index);
    const Surface& surface = surfaces[i];
    if (surface.instance == kNoId) return;
    constexpr int L = kPoolLanes;
    const LightPool& pool =
        pools[static_cast<std::size_t>(lookup.pool_of(pixel_of_index(lookup.areas.window, index)))];
    alignas(64) float weights[kMaxPool], sums[kMaxPool];
    float total = 0;
    for (int first = 0; first < size; first += L) {
      const Lanes<L> w = pool_weights<L>(pool, first, broadcast<L>(surface.position), broadcast<L>(surface.normal));
      const Lanes<L> sum = prefix_sum<L>(w) + broadcast<L>(total);
      store_lanes<L>(w, weights + first);
      store_lanes<L>(sum, sums + first);
      total = sums[first + L - 1];
    }
    const GroupProbabilities groups = group_probabilities(sampler, surface);
    const float local = total > 0 ? groups.local : 0;
    const float all = local + groups.directional + groups.environment;
    const Rng numbers{rng.seed, rng.frame, pixels[i]};
    vec4 u(0);
    for (int s = 0; s < samples; ++s) {
      if (s % 4 == 0) u = numbers.uniform4(kDimPick + static_cast<std::uint32_t>(s));
      PoolPick& pick = picks[static_cast<std::size_t>(s) * surfaces.size() + i];
      pick = {};
      if (!(all > 0)) continue;
      const float r = (static_cast<float>(s) + u[s % 4]) / static_cast<float>(samples) * all;
      if (r < local) {
        const int j = pick_light(weights, sums, r / local * total);
        pick = {pool.pdf[j] * (weights[j] / total) * (local / all), j};
      } else if (all > local) {
        pick = {(all - local) / all, PoolPick::kAtInfinity};
      }
    }
  }

 private:
  // The first whose sum is beyond the target; the last of any weight where rounding leaves none.
  LUMI_HD LUMI_ALWAYS_INLINE int pick_light(const float* weights, const float* sums, float target) const {
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

}  // namespace lumigrove
