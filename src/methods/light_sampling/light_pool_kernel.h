// Method      Draws lights once for an area of pixels, below the nodes of one cut; every pixel takes some of them, in
//             proportion to what each would send if nothing were in the way.
// Paper       none of its own. D. Lin, C. Yuksel, "Real-Time Stochastic Lightcuts", Proc. ACM CGIT 3(1) (I3D 2020), for the
//             tree, and for cuts that pixels share; B. Walter et al., "Lightcuts", SIGGRAPH 2005, whose clusters stand by
//             one light for all pixels; J. Talbot, D. Cline, P. Egbert, "Importance Resampling for Global Illumination",
//             EGSR 2005, for the choice among the drawn; A. Keller, W. Heidrich, "Interleaved Sampling", EGWR 2001.
// Symbols     C -> AreaCut -> nodes that hold all lights once; M -> PoolLookup::size -> most of them
//             y_j, p_j -> LightPool -> point on a light below node j of C; probability of the light there, over its area
//             m -> interleave -> an area has m^2 / 2 pools, and its pixels take turns
//             q_j(x) -> pool_weights -> Y of the irradiance at x from y_j, unoccluded, over p_j
//             P_j(x) = q_j / sum q -> probability with which x takes y_j
// Equations   L(x) = mean over what x takes of f(y_j) / (p_j P_j)
// Departures  Cuts and walks are for all points of the area: WalkRegion. Errors have the area's size as least distance, so
//             that what is inside it does not take up the whole cut. The walks below a node are in strata.
// Estimator   unbiased: the sum over the nodes of f(y_j) / p_j is, as every light that can reach a point of the area is
//             drawn with positive probability, and one that reaches x has q_j > 0. Pixels that share a pool err together;
//             interleaving makes grain of that.
// In -> Out   surfaces of a tile -> LightPools; surfaces, pools -> shadow rays and contributions (pool_lighting_kernel.h)
// Oracle      tests/light_pool_test.cpp: exhaustive sum, partition, walks against those of single points, lanes against
//             scalars.
#pragma once

#include <span>

#include "base/lane_math.h"
#include "base/rng.h"
#include "methods/light_sampling/light_sampler_kernel.h"
#include "methods/light_tree/region_walk_kernel.h"
#include "methods/lightcuts/cut_kernel.h"

namespace lumigrove {

inline constexpr int kMaxPool = 64, kMaxPoolInterleave = 4;
inline constexpr int kMaxDraws = kMaxPool * ((kMaxPoolInterleave * kMaxPoolInterleave + 1) / 2);

// A point on a light: 16 numbers, so that many can be turned into rows of lanes.
struct alignas(64) PoolLight {
  vec3 position;
  vec3 axis;              // normal, or a spot light's axis; what leaves the light depends on the cosine c to it:
  vec3 strength;          // radiance times area, or intensity, over p_j
  float offset, scale;    // share = offset + scale * max(c, -c * two_sided), from 0 to 1
  float two_sided;        // 1 or -1
  float squared;          // 1: the share is squared, 0: it is not
  float inverse_range2;   // 1/m^2; 0 = unlimited
  float clear;            // shadow rays end so far along the axis, metres; above 0 for virtual point lights
  float most;             // of share / d^2, 1/m^2: the clamp of virtual point lights

  LUMI_HD bool vpl() const { return clear > 0; }
};

struct alignas(64) LightPool {
  float x[kMaxPool], y[kMaxPool], z[kMaxPool];
  float axis_x[kMaxPool], axis_y[kMaxPool], axis_z[kMaxPool];
  float strength[kMaxPool];  // Y
  float offset[kMaxPool], scale[kMaxPool], two_sided[kMaxPool], most[kMaxPool];
  PoolLight lights[kMaxPool];

  LUMI_HD void set(int j, const PoolLight& light) {
    lights[j] = light;
    x[j] = light.position.x, y[j] = light.position.y, z[j] = light.position.z;
    axis_x[j] = light.axis.x, axis_y[j] = light.axis.y, axis_z[j] = light.axis.z;
    strength[j] = luminance(light.strength);
    offset[j] = light.offset, scale[j] = light.scale, two_sided[j] = light.two_sided, most[j] = light.most;
  }
};

// Which pool a pixel takes its lights from: neighbours use different ones, so that what pixels have in common does not show
// as blocks.
struct PoolLookup {
  CutLookup areas;     // share: edge of an area
  int interleave = 1;  // m
  int size = kMaxPool; // M

  // Two pixels of every m x m share one: as many again would cost more than they gain.
  LUMI_HD int pools_per_area() const { return (interleave * interleave + 1) / 2; }
  LUMI_HD int pools() const { return areas.blocks() * pools_per_area(); }
  LUMI_HD int pool_of(Pixel pixel) const {
    const int m = interleave;
    const auto quad_x = static_cast<std::uint32_t>(pixel.x / m), quad_y = static_cast<std::uint32_t>(pixel.y / m);
    const std::uint32_t turn = pcg4d(uvec4(quad_x, quad_y, areas.frame, 0x51ab3f1u)).x >> 8;
    const std::uint32_t place = static_cast<std::uint32_t>(pixel.y % m * m + pixel.x % m) + turn;
    const auto number = static_cast<int>(place % static_cast<std::uint32_t>(m * m));
    return areas.block_of(pixel) * pools_per_area() + number / 2;
  }
};

// --- drawing -------------------------------------------------------------------------------------------------

// Where the surfaces of an area lie: in a box, their normals n with |n - normal| <= spread.
struct AreaBounds {
  Box3 box;
  vec3 normal = vec3(0);
  float spread = 0;
  bool present = false;
};

LUMI_HD inline AreaBounds bounds_of_area(const CutLookup& lookup, const PixelWindow& pixels,
                                         std::span<const Surface> surfaces) {
  AreaBounds bounds;
  vec3 normals(0);
  const auto each = [&](const auto& f) {
    for (int y = pixels.y0; y < pixels.y1; ++y)
      for (int x = pixels.x0; x < pixels.x1; ++x) {
        const Surface& s = surfaces[static_cast<std::size_t>(index_of_pixel(lookup.window, Pixel{x, y}))];
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

LUMI_HD inline PoolLight punctual_pool_light(const LightView& lights, const Emitter& e, float weight) {
  const PunctualView& light = lights.punctual[e.index()];
  PoolLight result{};
  result.position = e.p0;
  result.strength = light.intensity * weight;
  result.offset = light.spot ? -e.e2.x * e.e2.y : 1.0f;
  result.scale = light.spot ? e.e2.y : 0.0f;
  if (light.spot) result.axis = e.e1;
  result.two_sided = -1;
  result.squared = light.spot ? 1.0f : 0.0f;
  result.most = 3e38f;
  result.inverse_range2 = light.range > 0 ? 1 / (light.range * light.range) : 0.0f;
  return result;
}

LUMI_HD inline PoolLight triangle_pool_light(const SceneView& scene, const LightView& lights, std::uint32_t index,
                                             vec2 u, float weight) {
  const Emitter& e = lights.emitters[index];
  const EmissiveInstance& instance = lights.instances[e.source];
  const vec3 n = glm::cross(e.e1, e.e2);
  const float area2 = glm::length(n);
  PoolLight result{};
  if (!(area2 > 0)) return result;
  const float root = glm::sqrt(u.x), b1 = 1 - root, b2 = u.y * root;  // uniform by area
  result.position = e.p0 + e.e1 * b1 + e.e2 * b2;
  result.axis = n * (1 / area2);
  result.strength = radiance_at(scene, instance, e, index, b1, b2) * (0.5f * area2 * weight);
  result.scale = 1;
  result.most = 3e38f;
  result.two_sided = instance.double_sided ? 1.0f : -1.0f;
  return result;
}

LUMI_HD inline PoolLight vpl_pool_light(const LightView& lights, const Emitter& e, float weight) {
  PoolLight result{};
  result.position = e.p0;
  result.axis = e.e1;
  result.strength = e.e2 * weight;
  result.scale = 1;
  result.two_sided = -1;
  result.clear = glm::max(lights.vpls[e.index()].epsilon, 1e-37f);
  result.most = glm::min(lights.vpl_clamp, 3e38f);
  return result;
}

// What a walk chose, as a light of a pool; dark where it chose none.
LUMI_HD inline PoolLight make_pool_light(const LightSampler& sampler, TreeSample chosen, vec2 u) {
  PoolLight light{};
  if (chosen.pdf > 0) {
    const float weight = 1 / chosen.pdf;
    const Emitter& e = sampler.lights.emitters[chosen.emitter];
    light = e.vpl()      ? vpl_pool_light(sampler.lights, e, weight)
            : e.punctual() ? punctual_pool_light(sampler.lights, e, weight)
                         : triangle_pool_light(sampler.scene, sampler.lights, chosen.emitter, u, weight);
  }
  if (!is_finite(light.strength)) light.strength = vec3(0);
  return light;
}

// What select_cut asks of the perfect tree, for a region. A node's error is the sum over its children of the most that each
// can send to a point of the region, at least the region's size away.
template <int W>
struct CutOfRegion {
  const LightTreeView& tree;
  const WalkRegion& region;
  float floor2;

  LUMI_HD bool root(TreeStart& start) const {
    start = {enter_children<W>(tree, binary_root(tree))};
    return tree.count > 0;
  }
  LUMI_HD int split(const TreeStart& start, TreeStart (&parts)[2]) const {
    Subtree halves[2];
    const int count = halves_with_lights<W>(tree, start.subtree, halves);
    for (int k = 0; k < count; ++k) parts[k] = {enter_children<W>(tree, halves[k])};
    return count;
  }
  LUMI_HD float error(const TreeStart& start) const {
    const Subtree& s = start.subtree;
    if (is_leaf(tree, s)) return 0;
    Weighing weighing = weighing_of_level(tree, s.level, Weights::kMinMax);
    weighing.nearness = floor2;
    alignas(64) float errors[W];
    store_lanes<W>(bound_children_of_region<W>(tree.level<W>(s.level)[s.node], weighing, region), errors);
    float sum = 0;
    for (int c = s.first; c < s.first + s.children; ++c) sum += errors[c];
    return sum;
  }
};

struct AreaCut {
  TreeStart nodes[kMaxPool];
  float error[kMaxPool];
  int count = 0;
};

LUMI_HD inline WalkRegion region_of_area(const AreaBounds& bounds) {
  return {bounds.box.centre(), 0.5f * (bounds.box.hi - bounds.box.lo), bounds.normal, bounds.spread};
}

LUMI_HD inline void cut_of_region(const LightTreeView& tree, const WalkRegion& region, int size, AreaCut& cut) {
  with_width(tree.width, [&](auto w) {
    const float floor2 = glm::max(glm::max(tree.inside2, tree.floor2), length_squared(region.half));
    select_cut(CutOfRegion<w>{tree, region, floor2}, size, cut);
  });
}

// A light below each node of the area's cut for every pool.
struct PoolKernel {
  LightSampler sampler;
  PoolLookup lookup;
  Rng rng;
  std::span<const Surface> surfaces;
  std::span<LightPool> pools;

  LUMI_HD void operator()(int area) const {
    const int many = lookup.pools_per_area(), count = many * lookup.size;
    TreeSample chosen[kMaxDraws];
    float u[2][kMaxDraws];  // point on the light
    draw(area, count, chosen, u[0], u[1]);
    for (int j = 0; j < count; ++j)
      pools[static_cast<std::size_t>(area * many + j % many)].set(
          j / many, make_pool_light(sampler, chosen[j], vec2(u[0][j], u[1][j])));
  }

 private:
  LUMI_HD void draw(int area, int count, TreeSample* chosen, float* u, float* v) const {
    const PixelWindow pixels = lookup.areas.pixels_of(area);
    const AreaBounds bounds = bounds_of_area(lookup.areas, pixels, surfaces);
    const LightTreeView& tree = sampler.tree;
    for (int j = 0; j < count; ++j) chosen[j] = {};
    if (!bounds.present || tree.count == 0) return;
    const WalkRegion region = region_of_area(bounds);
    AreaCut cut;
    cut_of_region(tree, region, lookup.size, cut);
    const int many = lookup.pools_per_area();
    SortedStart starts[kMaxPool];
    for (int k = 0; k < cut.count; ++k)
      starts[k] = {cut.nodes[k].subtree, static_cast<std::uint32_t>(k * many), static_cast<std::uint32_t>((k + 1) * many)};

    const Rng numbers = rng_of_block(rng, pixels);
    float r[kMaxDraws], fresh[kMaxDraws];
    const float inverse_many = 1 / static_cast<float>(many);
    count = cut.count * many;
    for (int j = 0; j < count; ++j) {
      const vec4 w = numbers.uniform4(kDimPool + 4 * static_cast<std::uint32_t>(j));
      r[j] = glm::min((static_cast<float>(j % many) + w.x) * inverse_many, 0x1.fffffep-1f);
      u[j] = w.y;
      v[j] = w.z;
      fresh[j] = w.w;
    }
    WalkRange ranges[kMaxDraws], next[kMaxDraws];
    const auto n = static_cast<std::size_t>(count);
    sample_light_tree_sorted(tree, region, {starts, static_cast<std::size_t>(cut.count)},
                             {{r, n}, {fresh, n}, {ranges, n}, {next, n}}, {chosen, n});
    for (int j = 0; j < count; ++j)
      if (chosen[j].pdf > 0) prefetch(&sampler.lights.emitters[chosen[j].emitter]);
  }
};

}  // namespace lumigrove
