#include "frame/audit_samplers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "methods/light_sampling/light_pool_kernel.h"
#include "methods/light_tree/region_walk_kernel.h"

namespace lumigrove {
namespace {

// --- names ---------------------------------------------------------------------------------------------------

// What the scene's makers call a light; numbered as light_count() does.
class LightNames {
 public:
  LightNames(const Scene& scene, const World& world, const Settings& settings)
      : scene_(&scene), world_(&world) {
    // As LightSet::gather numbers them.
    std::uint32_t id = 0;
    for (const MeshInstance& instance : world.geometry->state.instances)
      id += static_cast<std::uint32_t>(mesh_of(instance).triangles.size());
    for (const LightInstance& light : world.geometry->state.lights) {
      const std::uint32_t stable = id++;
      if (!(max_component(light.light.color * settings.light_scale) > 0)) continue;
      (light.light.type == LightType::kDirectional ? directional_ : punctual_).push_back({&light, stable});
    }
  }

  LightName of(const LightView& lights, std::uint32_t light) const {
    const auto locals = static_cast<std::uint32_t>(lights.emitters.size());
    if (light >= locals) {
      const std::uint32_t at_infinity = light - locals;
      return at_infinity < directional_.size() ? of_node("directional light", directional_[at_infinity])
                                               : LightName{"environment"};
    }
    const Emitter& e = lights.emitters[light];
    if (e.vpl()) return of_vpl(lights.vpls[e.index()], e.index());
    if (e.punctual())
      return of_node(lights.punctual[e.index()].spot ? "spot light" : "point light", punctual_[e.index()]);
    const MeshInstance& instance = world_->geometry->state.instances[e.source];
    const Mesh& mesh = mesh_of(instance);
    LightName name{"triangle", node_name(instance.node), mesh.name};
    name.material = scene_->materials[static_cast<std::size_t>(mesh.material)].name;
    name.stable_id = stable_id(lights, light);
    name.triangle = name.stable_id - lights.instances[e.source].stable_base;
    return name;
  }

  static LightName of_vpl(const Vpl& vpl, std::uint32_t index) {
    return {fmt::format("virtual point light {} at ({:.5g}, {:.5g}, {:.5g})", index, vpl.position.x, vpl.position.y,
                        vpl.position.z)};
  }

 private:
  struct NamedLight {
    const LightInstance* instance;
    std::uint32_t stable_id;
  };
  const Mesh& mesh_of(const MeshInstance& instance) const {
    return scene_->meshes[static_cast<std::size_t>(instance.mesh)];
  }
  std::string node_name(int node) const { return scene_->nodes[static_cast<std::size_t>(node)].name; }
  LightName of_node(const char* kind, const NamedLight& light) const {
    LightName name{kind, node_name(light.instance->node)};
    name.light = light.instance->light.name;
    name.stable_id = light.stable_id;
    return name;
  }

  const Scene* scene_;
  const World* world_;
  std::vector<NamedLight> punctual_, directional_;
};

// --- what lights send ----------------------------------------------------------------------------------------

constexpr int kStrataOfEnvironment = 64;

// Points on a light: of few lights more, so that their sum is well known, in a square of strata.
int strata_of(std::size_t lights) {
  const double points = std::clamp(65536.0 / static_cast<double>(std::max<std::size_t>(1, lights)), 4.0, 4096.0);
  return static_cast<int>(std::sqrt(points));
}

// Near a light what it sends changes fast from point to point of it.
int strata_near(const Emitter& e, vec3 x, int strata) {
  constexpr float kMostStrata = 64;
  const Box3 box = emitter_bounds(e);
  const float near = glm::length(glm::clamp(x, box.lo, box.hi) - x);
  const float wanted = near > 0 ? glm::min(8 * box.diagonal() / near, kMostStrata) : kMostStrata;
  return std::max(strata, static_cast<int>(std::ceil(wanted)));
}

LightMoments moments_of_light(const LightSampler& sampler, const Surface& surface, int strata, std::uint32_t seed) {
  const bool local = sampler.one < sampler.lights.emitters.size();
  const bool environment = sampler.lights.environment.present() && sampler.one + 1 == light_count(sampler.lights);
  const bool plain = local ? !sampler.lights.emitters[sampler.one].triangle() : !environment;
  int side = 1;
  if (environment) side = kStrataOfEnvironment;
  if (local && !plain) side = strata_near(sampler.lights.emitters[sampler.one], surface.position, strata);
  double sum = 0, squares = 0, most = 0;
  for (int k = 0; k < side * side; ++k) {
    const vec4 u = Rng{seed, sampler.one, static_cast<std::uint32_t>(k)}.uniform4(0);
    const vec2 at = (vec2(static_cast<float>(k % side), static_cast<float>(k / side)) + vec2(u)) / static_cast<float>(side);
    const LightSample sample = sample_light(sampler, surface, vec4(0, glm::min(at, vec2(0x1.fffffep-1f)), 0));
    const vec3 light = unoccluded_light(surface, sample);
    const double y = is_finite(light) ? static_cast<double>(luminance(light)) : 0;
    sum += y;
    squares += y * y;
    most = std::max(most, y);
  }
  const double n = side * side, mean = sum / n, square = squares / n;
  // Strata only lessen the variance.
  return {static_cast<float>(mean), static_cast<float>(square), static_cast<float>(most),
          plain ? 0.0f : static_cast<float>(std::max(0.0, square - mean * mean) / n)};
}

std::vector<LightMoments> moments_of_lights(LightSampler sampler, const Surface& surface, std::uint32_t seed) {
  sampler.choice = LightChoice::kOne;
  const std::uint32_t count = light_count(sampler.lights);
  const int strata = strata_of(count);
  std::vector<LightMoments> light(count);
  for (sampler.one = 0; sampler.one < count; ++sampler.one)
    light[sampler.one] = moments_of_light(sampler, surface, strata, seed);
  return light;
}

// --- surfaces that share cuts and pools ----------------------------------------------------------------------

// A window of pixels, half of which show the point, in squares of `interleave`; the others show places around it.
struct Tile {
  PixelWindow window;
  std::vector<Surface> surfaces;
  std::vector<std::uint32_t> pixels;
  std::vector<std::uint8_t> shows_point;
  int count = 0;  // of pixels that show the point
};

// Neighbours are so far away at most, in units of D, and turned so far.
constexpr float kNeighbourhood = 0.01f, kNeighbourTilt = 0.2f;

Surface neighbour_of(const Surface& s, float diagonal, vec4 u) {
  Surface n = s;
  const Frame frame = make_frame(s.geometric_normal);
  const vec2 d = vec2(u.x, u.y) * 2.0f - 1.0f, tilt = (vec2(u.z, u.w) * 2.0f - 1.0f) * kNeighbourTilt;
  n.position += (frame.x * d.x + frame.y * d.y) * (kNeighbourhood * diagonal);
  n.normal = glm::normalize(s.normal + frame.x * tilt.x + frame.y * tilt.y);
  return n;
}

Tile make_tile(const Surface& s, int side, int interleave, bool neighbours, float diagonal, std::uint32_t seed) {
  Tile tile;
  tile.window = {0, 0, side, side};
  for (int i = 0; i < tile.window.count(); ++i) {
    const Pixel pixel = pixel_of_index(tile.window, i);
    const bool point = !neighbours || (pixel.x / interleave + pixel.y / interleave) % 2 == 0;
    const auto number = static_cast<std::uint32_t>(i);
    tile.surfaces.push_back(point ? s : neighbour_of(s, diagonal, Rng{seed, 1, number}.uniform4(0)));
    tile.pixels.push_back(number);
    tile.shows_point.push_back(point ? 1 : 0);
    tile.count += point ? 1 : 0;
  }
  return tile;
}

// --- samplers of direct light --------------------------------------------------------------------------------

// Makes the lighting of a camera sample.
using MakeLighting = std::function<DirectLighting(int sample)>;

// What a part of an estimate draws from.
struct Part {
  enum Kind { kAll, kNode, kEntry, kPool, kInfinity } kind = kAll;
  double draws = 1;           // in an estimate
  TreeStart start = {};       // kNode, kPool
  std::uint32_t entry = 0;    // kEntry
};

class DirectAtPoint {
 public:
  DirectAtPoint(MakeLighting make, const std::vector<std::uint32_t>* leaves, const Surface& surface, std::uint32_t number)
      : make_(std::move(make)),
        surface_(surface),
        lighting_(make_(0)),
        groups_(group_probabilities(lighting_.sampler, surface)) {
    if (leaves && !leaves->empty()) lighting_.sampler.tree.emitter_leaves = leaves->data();
    tile_ = make_tile(surface, side(), interleave(), shares(), lighting_.sampler.lights.diagonal, number);
    find_parts();
  }

  const std::vector<Part>& parts() const { return parts_; }
  double work() const {
    if (lighting_.use_cuts) return tile_.window.count() * lighting_.lookup.passes(lighting_.cut.size);
    if (lighting_.use_pools) return tile_.window.count() * lighting_.spp;
    return lighting_.spp * static_cast<double>(std::max<std::size_t>(1, parts_.size()));
  }

  void draw(const Part& part, std::uint32_t seed, std::span<std::uint32_t> cells) const {
    if (part.kind == Part::kPool) {
      draw_for_pools(part, seed, cells);
      return;
    }
    for (std::size_t first = 0; first < cells.size(); first += kWalkBatch)
      draw_batch(part, seed, static_cast<std::uint32_t>(first),
                 cells.subspan(first, std::min<std::size_t>(kWalkBatch, cells.size() - first)));
  }

  void pdf(const Part& part, std::span<double> cells) const {
    const LightSampler& sampler = lighting_.sampler;
    const auto locals = static_cast<std::uint32_t>(sampler.lights.emitters.size());
    const bool only_local = part.kind == Part::kEntry || part.kind == Part::kPool;
    const GroupProbabilities p = groups_of(part);
    if (p.local > 0)
      for (std::uint32_t e = 0; e < locals; ++e)
        cells[e] = static_cast<double>(p.local) * static_cast<double>(pdf_of_emitter(part, e));
    if (only_local) return;
    const auto directional = static_cast<std::uint32_t>(sampler.lights.directional.size());
    if (p.directional > 0)
      for (std::uint32_t d = 0; d < directional; ++d)
        cells[locals + d] =
            static_cast<double>(p.directional) * static_cast<double>(pdf_directional(sampler, surface_, d));
    if (sampler.lights.environment.present()) cells[locals + directional] = static_cast<double>(p.environment);
  }

  // One estimate a call where pixels share cuts or pools, since those err together.
  std::vector<double> estimate(int count, std::uint32_t seed) const {
    std::vector<double> estimates;
    const int turns = interleave() * interleave();
    DirectBuffers buffers;
    std::vector<vec3> sum;
    for (int sample = 0; static_cast<int>(estimates.size()) < count || sample % turns != 0; ++sample) {
      DirectLighting lighting = make_(sample);
      lighting.rng.seed ^= seed;
      lighting.set_window(tile_.window);
      sum.assign(tile_.surfaces.size(), vec3(0));
      add_direct_light(lighting, tile_.surfaces, tile_.pixels, kDimLight, buffers, sum);
      double all = 0;
      for (std::size_t i = 0; i < sum.size(); ++i) {
        if (!tile_.shows_point[i]) continue;
        if (!shares()) estimates.push_back(static_cast<double>(luminance(sum[i])));
        all += static_cast<double>(luminance(sum[i]));
      }
      if (shares()) estimates.push_back(all / tile_.count);
    }
    return estimates;
  }

 private:
  bool shares() const { return lighting_.use_cuts || lighting_.use_pools; }
  int interleave() const {
    return lighting_.use_cuts ? lighting_.lookup.interleave : lighting_.use_pools ? lighting_.pools.interleave : 1;
  }
  int side() const {
    if (!shares()) return 32;
    const int block = lighting_.use_cuts ? lighting_.lookup.share : lighting_.pools.areas.share;
    const int least = std::max(16, 2 * interleave());
    return (least + block - 1) / block * block;
  }
  bool has_infinity() const {
    return !lighting_.sampler.lights.directional.empty() || lighting_.sampler.lights.environment.present();
  }

  void find_parts() {
    if (lighting_.use_cuts)
      find_cut();
    else if (lighting_.use_pools)
      find_area_cut();
    else if (lighting_.use_split)
      find_split();
    else
      parts_.push_back({Part::kAll, static_cast<double>(lighting_.spp)});
  }

  // Of a neighbour, as every cut must do for all pixels that share it.
  void find_cut() {
    const auto other = std::find(tile_.shows_point.begin(), tile_.shows_point.end(), std::uint8_t{0});
    const Surface& s = tile_.surfaces[static_cast<std::size_t>(other - tile_.shows_point.begin())];
    LightCut cut;
    select_cut(lighting_.sampler, s.position, s.normal, lighting_.cut, cut);
    const double share = static_cast<double>(tile_.count) / (interleave() * interleave());
    for (int k = 0; k < cut.count; ++k) parts_.push_back({Part::kNode, share, cut.nodes[k]});
    if (cut.count == 0) parts_.push_back({Part::kAll, share});
  }

  void find_area_cut() {
    PoolLookup lookup = lighting_.pools;
    const int edge = lookup.areas.share;
    lookup.areas.window = tile_.window;
    const AreaBounds bounds = bounds_of_area(lookup.areas, {0, 0, edge, edge}, tile_.surfaces);
    region_ = region_of_area(bounds);
    AreaCut cut;
    if (lighting_.sampler.tree.count > 0) cut_of_region(lighting_.sampler.tree, region_, lookup.size, cut);
    for (int k = 0; k < cut.count; ++k)
      parts_.push_back({Part::kPool, static_cast<double>(lookup.pools()), cut.nodes[k]});
    add_infinity(static_cast<double>(tile_.count) * lighting_.spp *
                 static_cast<double>(groups_.directional + groups_.environment));
  }

  void find_split() {
    std::vector<std::uint32_t> entries(static_cast<std::size_t>(lighting_.split.cap));
    const int count = split_light_bvh(lighting_.sampler.bvh, surface_.position, surface_.normal, lighting_.split,
                                      entries.data());
    for (int k = 0; k < count; ++k)
      parts_.push_back({Part::kEntry, static_cast<double>(lighting_.spp), {}, entries[static_cast<std::size_t>(k)]});
    add_infinity(lighting_.spp);
  }

  void add_infinity(double draws) {
    if (has_infinity() && draws > 0) parts_.push_back({Part::kInfinity, draws});
  }

  GroupProbabilities groups_of(const Part& part) const {
    if (part.kind == Part::kEntry || part.kind == Part::kPool) return {1, 0, 0};
    if (part.kind != Part::kInfinity) return groups_;
    const float both = groups_.directional + groups_.environment;
    if (!(both > 0)) return {};
    return {0, groups_.directional / both, groups_.environment / both};
  }

  float pdf_of_emitter(const Part& part, std::uint32_t e) const {
    const LightSampler& sampler = lighting_.sampler;
    switch (part.kind) {
      case Part::kAll:
        return pdf_choose_emitter(sampler, surface_, e);
      case Part::kNode:
        return pdf_emitter_below(sampler, part.start, surface_.position, surface_.normal, e);
      case Part::kEntry:
        return pdf_light_bvh(sampler.bvh, part.entry, surface_.position, surface_.normal, e);
      case Part::kPool: {
        const std::uint32_t leaf = sampler.tree.emitter_leaves[e];
        return leaf == kNoEmitter ? 0.0f : pdf_leaf_in_region(sampler.tree, region_, part.start.subtree, leaf);
      }
      case Part::kInfinity:
        break;
    }
    return 0;
  }

  ChosenGroup group_of_draw(const Part& part, float r) const {
    if (part.kind == Part::kEntry) return {LightGroup::kLocal, 1, r};
    if (part.kind == Part::kInfinity) return choose_group_at_infinity(lighting_.sampler, surface_, r);
    return choose_group(lighting_.sampler, surface_, r);
  }

  // Walks go together, as in images.
  void draw_batch(const Part& part, std::uint32_t seed, std::uint32_t first, std::span<std::uint32_t> cells) const {
    const LightSampler& sampler = lighting_.sampler;
    const auto locals = static_cast<std::uint32_t>(sampler.lights.emitters.size());
    vec2 numbers[kWalkBatch];
    std::size_t index[kWalkBatch];
    int walks = 0;
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const vec4 u = Rng{seed, 0, first + static_cast<std::uint32_t>(k)}.uniform4(0);
      const ChosenGroup group = group_of_draw(part, u.x);
      cells[k] = kNoCell;
      if (group.group == LightGroup::kEnvironment)
        cells[k] = locals + static_cast<std::uint32_t>(sampler.lights.directional.size());
      if (group.group == LightGroup::kDirectional) {
        const std::uint32_t d = choose_directional(sampler, surface_, group.r);
        if (d != kNoEmitter) cells[k] = locals + d;
      }
      if (group.group != LightGroup::kLocal) continue;
      index[walks] = k;
      numbers[walks++] = vec2(group.r, u.w);
    }
    TreeSample chosen[kWalkBatch];
    choose_emitters(part, numbers, walks, chosen);
    for (int k = 0; k < walks; ++k)
      if (chosen[k].pdf > 0) cells[index[k]] = chosen[k].emitter;
  }

  void choose_emitters(const Part& part, const vec2* numbers, int count, TreeSample* chosen) const {
    const LightSampler& sampler = lighting_.sampler;
    if (count == 0) return;
    if (sampler.choice == LightChoice::kTree) {
      WalkPoints points;
      for (int k = 0; k < count; ++k) points.set(k, surface_.position, surface_.normal, numbers[k]);
      const TreeStart start = part.kind == Part::kNode ? part.start : TreeStart{whole_tree(sampler.tree)};
      sample_emitters(sampler, start, points, count, chosen);
      return;
    }
    const bool node = part.kind == Part::kNode || part.kind == Part::kEntry;
    const std::uint32_t entry = part.kind == Part::kNode ? entry_of_subtree(part.start.subtree) : part.entry;
    for (int k = 0; k < count; ++k)
      chosen[k] = node ? sample_light_bvh(sampler.bvh, entry, surface_.position, surface_.normal, numbers[k])
                       : choose_emitter(sampler, surface_, numbers[k]);
  }

  // As many walks at once as an area's pools have.
  void draw_for_pools(const Part& part, std::uint32_t seed, std::span<std::uint32_t> cells) const {
    constexpr int kMost = (kMaxPoolInterleave * kMaxPoolInterleave + 1) / 2;
    const auto many = static_cast<std::size_t>(lighting_.pools.pools_per_area());
    for (std::size_t first = 0; first < cells.size(); first += many) {
      const std::size_t count = std::min(many, cells.size() - first);
      float r[kMost], fresh[kMost];
      for (std::size_t k = 0; k < count; ++k) {
        const vec4 u = Rng{seed, 0, static_cast<std::uint32_t>(first + k)}.uniform4(0);
        r[k] = std::min((static_cast<float>(k) + u.x) / static_cast<float>(count), 0x1.fffffep-1f);
        fresh[k] = u.y;
      }
      WalkRange ranges[kMost], next[kMost];
      TreeSample chosen[kMost] = {};
      const SortedStart start{part.start.subtree, 0, static_cast<std::uint32_t>(count)};
      sample_light_tree_sorted(lighting_.sampler.tree, region_, {&start, 1},
                               {{r, count}, {fresh, count}, {ranges, count}, {next, count}}, {chosen, count});
      for (std::size_t k = 0; k < count; ++k) cells[first + k] = chosen[k].pdf > 0 ? chosen[k].emitter : kNoCell;
    }
  }

  MakeLighting make_;
  Surface surface_;
  DirectLighting lighting_;
  GroupProbabilities groups_;
  Tile tile_;
  WalkRegion region_;
  std::vector<Part> parts_;
};

SamplerAtPoint sampler_at(const std::shared_ptr<const DirectAtPoint>& point) {
  SamplerAtPoint at;
  for (const Part& part : point->parts()) at.parts.push_back(part.draws);
  at.draw = [point](std::size_t part, std::uint32_t seed, std::span<std::uint32_t> cells) {
    point->draw(point->parts()[part], seed, cells);
  };
  at.pdf = [point](std::size_t part, std::span<double> cells) { point->pdf(point->parts()[part], cells); };
  at.estimate = [point](int count, std::uint32_t seed) { return point->estimate(count, seed); };
  at.work = point->work();
  return at;
}

// Emitter -> leaf; kNoEmitter where there is none.
std::vector<std::uint32_t> leaves_of_emitters(const LightTreeView& tree, std::size_t emitters) {
  std::vector<std::uint32_t> leaves(emitters, kNoEmitter);
  for (std::uint32_t leaf = 0; leaf < tree.count; ++leaf) leaves[tree.leaf_emitters[leaf]] = leaf;
  return leaves;
}

// Lights of `light` at a point, from the cache if they are there; points are asked for once at a time.
template <class Light>
auto cached(const std::shared_ptr<LightCache>& cache, const Light& light) {
  return [cache, light](const AuditPoint& point, std::uint32_t number) {
    std::vector<LightMoments>& known = cache->at(number);
    if (known.empty()) known = light(point.surface, number);
    return known;
  };
}

AuditedSampler audit_of_lighting(const Scene& scene, const World& world, const Settings& settings,
                                 const std::string& name, const std::shared_ptr<LightCache>& cache,
                                 const std::shared_ptr<std::vector<std::uint32_t>>& leaves, const MakeLighting& make) {
  const LightSampler sampler = make(0).sampler;
  AuditedSampler audited;
  audited.name = name;
  audited.lights = audited.cells = light_count(sampler.lights);
  audited.at = [make, leaves](const AuditPoint& point, std::uint32_t number) {
    return sampler_at(std::make_shared<DirectAtPoint>(make, leaves.get(), point.surface, number));
  };
  audited.light = cached(cache, [sampler, seed = settings.seed](const Surface& surface, std::uint32_t number) {
    return moments_of_lights(sampler, surface, seed + 0x9e3779b9u * (number + 1));
  });
  const auto names = std::make_shared<LightNames>(scene, world, settings);
  audited.describe = [names, lights = sampler.lights](std::uint32_t light) { return names->of(lights, light); };
  return audited;
}

DirectLighting unshadowed(DirectLighting lighting) {
  lighting.tracer = nullptr;
  lighting.mis = false;
  return lighting;
}

// --- samplers of virtual point lights ------------------------------------------------------------------------

LightMoments moments_of(vec3 light) {
  const float y = luminance(light);
  return {y, y * y, y, 0};
}

std::vector<double> estimates_of_vpls(IndirectLighting lighting, const Surface& surface, int count, std::uint32_t seed) {
  const auto n = static_cast<std::size_t>(count);
  const std::vector<Surface> surfaces(n, surface);
  std::vector<std::uint32_t> pixels(n);
  std::iota(pixels.begin(), pixels.end(), 0u);
  std::vector<vec3> sum(n, vec3(0));
  IndirectBuffers buffers;
  lighting.rng.seed ^= seed;
  add_indirect_light(lighting, surfaces, pixels, kDimIndirect, buffers, sum);
  std::vector<double> estimates;
  for (const vec3& light : sum) estimates.push_back(static_cast<double>(luminance(light)));
  return estimates;
}

// Uniformly or by power.
AuditedSampler audit_of_vpl_choice(const IndirectLighting& lighting) {
  const VplSampler sampler = lighting.sampler;
  AuditedSampler audited;
  audited.lights = audited.cells = static_cast<std::uint32_t>(sampler.lights.vpls.size());
  audited.at = [lighting, sampler](const AuditPoint& point, std::uint32_t) {
    SamplerAtPoint at;
    at.parts = {static_cast<double>(lighting.spp)};
    at.work = lighting.spp;
    at.draw = [sampler](std::size_t, std::uint32_t seed, std::span<std::uint32_t> cells) {
      for (std::uint32_t i = 0; i < cells.size(); ++i)
        cells[i] = choose_vpl(sampler, vec2(Rng{seed, 0, i}.uniform4(0))).index;
    };
    at.pdf = [sampler](std::size_t, std::span<double> cells) {
      for (std::size_t i = 0; i < cells.size(); ++i)
        cells[i] = sampler.choice == VplChoice::kPower
                       ? static_cast<double>(sampler.alias.pdf(luminance(sampler.lights.vpls[i].intensity)))
                       : 1 / static_cast<double>(cells.size());
    };
    at.estimate = [lighting, surface = point.surface](int count, std::uint32_t seed) {
      return estimates_of_vpls(lighting, surface, count, seed);
    };
    return at;
  };
  audited.light = [sampler](const AuditPoint& point, std::uint32_t) {
    const Lobes lobes = lights_gloss(sampler, point.surface) ? Lobes::kBoth : Lobes::kDiffuse;
    std::vector<LightMoments> light;
    for (const Vpl& vpl : sampler.lights.vpls)
      light.push_back(moments_of(vpl_light(point.surface, exact_vpl(vpl, 1), sampler.clamp, lobes)));
    return light;
  };
  audited.describe = [sampler](std::uint32_t light) { return LightNames::of_vpl(sampler.lights.vpls[light], light); };
  return audited;
}

// Walks down the substitute tree. Lights: leaf i as it lights the diffuse lobe, and count + i as it lights gloss. Cells:
// the same, and 2 count + k is the substitute of inner node k.
class SubstituteAudit {
 public:
  explicit SubstituteAudit(const IndirectLighting& lighting) : lighting_(lighting), tree_(lighting.sampler.walk.tree) {}

  std::uint32_t lights() const { return 2 * tree_.count; }
  std::uint32_t cells() const { return substitutes() ? 3 * tree_.count : lights(); }
  bool substitutes() const { return lighting_.sampler.walk.substitutes; }

  SamplerAtPoint at(const Surface& surface) const {
    const double diffuse = static_cast<double>(diffuse_walk_probability(lighting_.sampler, surface));
    SamplerAtPoint at;
    at.parts = {lighting_.spp * diffuse};
    if (diffuse < 1) at.parts.push_back(lighting_.spp * (1 - diffuse));
    at.work = lighting_.spp;
    at.draw = [this, surface](std::size_t part, std::uint32_t seed, std::span<std::uint32_t> cells) {
      part == 0 ? draw<false>(surface, seed, cells) : draw<true>(surface, seed, cells);
    };
    at.pdf = [this, surface](std::size_t part, std::span<double> cells) {
      part == 0 ? pdf<false>(surface, cells) : pdf<true>(surface, cells);
    };
    at.estimate = [this, surface](int count, std::uint32_t seed) {
      return estimates_of_vpls(lighting_, surface, count, seed);
    };
    return at;
  }

  std::vector<LightMoments> light(const Surface& surface) const {
    const float clamp = lighting_.sampler.clamp;
    const bool gloss = lights_gloss(lighting_.sampler, surface);
    std::vector<LightMoments> light(lights());
    for (std::uint32_t i = 0; i < tree_.count; ++i) {
      const VplPoint vpl = exact_vpl(tree_.leaf(i), 1);
      light[i] = moments_of(vpl_light(surface, vpl, clamp, Lobes::kDiffuse));
      if (gloss) light[tree_.count + i] = moments_of(vpl_light(surface, vpl, clamp, Lobes::kGloss));
    }
    return light;
  }

  // A substitute stands for every light below it.
  std::vector<double> of_lights(const std::vector<double>& cells) const {
    std::vector<double> lights(cells.begin(), cells.begin() + this->lights());
    struct Range {
      std::uint32_t node, first, last;
      double above;
    };
    std::vector<Range> open;
    if (tree_.count > 1) open.push_back({0, 0, tree_.count - 1, 0});
    while (!open.empty()) {
      const Range r = open.back();
      open.pop_back();
      const double here = r.above + cells[2 * std::size_t{tree_.count} + r.node];
      const std::uint32_t split = tree_.nodes[r.node].split();
      for (std::uint32_t side = 0; side < 2; ++side) {
        const Range child{split + side, side == 0 ? r.first : split + 1, side == 0 ? split : r.last, here};
        if ((tree_.nodes[r.node].child[side].mean & ChildRecord::kLeaf) != 0)
          lights[child.node] += here;
        else
          open.push_back(child);
      }
    }
    return lights;
  }

  LightName describe(std::uint32_t cell) const {
    const std::uint32_t n = tree_.count;
    if (cell >= 2 * n) return {fmt::format("the substitute of inner node {}", cell - 2 * n)};
    LightName name = LightNames::of_vpl(tree_.leaf(cell % n), tree_.leaves[cell % n]);
    if (cell >= n) name.kind += " for gloss";
    return name;
  }

 private:
  template <bool kGloss>
  void draw(const Surface& surface, std::uint32_t seed, std::span<std::uint32_t> cells) const {
    for (std::size_t first = 0; first < cells.size(); first += kSubstituteWalks) {
      const auto count = static_cast<int>(std::min<std::size_t>(kSubstituteWalks, cells.size() - first));
      SubstituteWalkPoints points;
      for (int k = 0; k < count; ++k) {
        const auto number = static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(k);
        points.set(k, surface, vec3(Rng{seed, 0, number}.uniform4(0)), kGloss);
      }
      WalkResult results[kSubstituteWalks];
      walk_substitute_tree<kGloss>(lighting_.sampler.walk, points, count, results);
      for (int k = 0; k < count; ++k) cells[first + static_cast<std::size_t>(k)] = cell_of<kGloss>(results[k]);
    }
  }

  template <bool kGloss>
  std::uint32_t cell_of(const WalkResult& result) const {
    if (result.end == WalkEnd::kDead) return kNoCell;
    if (result.end == WalkEnd::kSubstitute) return 2 * tree_.count + result.node;
    return result.node + (kGloss ? tree_.count : 0);
  }

  // Every step that a walk may take, from the root.
  template <bool kGloss>
  void pdf(const Surface& surface, std::span<double> cells) const {
    const bool stops = substitutes() && !kGloss;
    const std::size_t n = tree_.count, leaves = kGloss ? n : 0;
    if (n == 1) cells[leaves] = 1;
    if (n > 1 && stops && tree_.root_usable) cells[2 * n] = 1;
    if (n <= 1 || (stops && tree_.root_usable)) return;
    SubstituteWalkPoints points;
    points.set(0, surface, vec3(0), kGloss);
    std::vector<std::pair<std::uint32_t, double>> open{{0, 1.0}};
    while (!open.empty()) {
      const auto [node, above] = open.back();
      open.pop_back();
      const vec2 p = child_probabilities<kGloss>(lighting_.sampler.walk, points, 0, node);
      const std::uint32_t split = tree_.nodes[node].split();
      for (std::uint32_t side = 0; side < 2; ++side) {
        const double here = above * static_cast<double>(p[static_cast<int>(side)]);
        if (!(here > 0)) continue;
        const std::uint32_t flags = tree_.nodes[node].child[side].mean;
        if ((flags & ChildRecord::kLeaf) != 0)
          cells[leaves + split + side] = here;
        else if (stops && (flags & ChildRecord::kUsable) != 0)
          cells[2 * n + split + side] = here;
        else
          open.emplace_back(split + side, here);
      }
    }
  }

  IndirectLighting lighting_;
  SubstituteTreeView tree_;
};

AuditedSampler audit_of_substitute_tree(const IndirectLighting& lighting) {
  const auto audit = std::make_shared<const SubstituteAudit>(lighting);
  AuditedSampler audited;
  audited.lights = audit->lights();
  audited.cells = audit->cells();
  audited.at = [audit](const AuditPoint& point, std::uint32_t) { return audit->at(point.surface); };
  audited.light = [audit](const AuditPoint& point, std::uint32_t) { return audit->light(point.surface); };
  audited.describe = audited.describe_cell = [audit](std::uint32_t cell) { return audit->describe(cell); };
  if (!audit->substitutes()) return audited;
  audited.of_lights = [audit](const std::vector<double>& cells) { return audit->of_lights(cells); };
  audited.unbiased = lighting.sampler.correction > 0;
  if (!audited.unbiased)
    audited.word = "substitutes are not where their lights are: biased, as they say, so their mean is shown but not judged";
  return audited;
}

}  // namespace

Settings settings_of_audited_world(Settings settings) {
  settings.direct.mis = true;  // keeps what probabilities are asked by
  return settings;
}

AuditedSampler audit_of_direct(const Scene& scene, const World& world, const Settings& settings, const std::string& name,
                               const std::shared_ptr<LightCache>& cache) {
  const MakeLighting make = [&world, settings](int sample) {
    return unshadowed(make_direct_lighting(world, settings, sample));
  };
  AuditedSampler audited =
      audit_of_lighting(scene, world, settings, name, cache, std::make_shared<std::vector<std::uint32_t>>(), make);
  if (settings.direct.selection == Selection::kPool)
    audited.word = "frequencies are those of the lights that go into pools; which of them pixels take is judged by the mean";
  return audited;
}

AuditedSampler audit_of_vpls(const Scene& scene, const World& world, const Settings& settings, const std::string& name,
                             const std::shared_ptr<LightCache>& cache) {
  IndirectLighting lighting = make_indirect_lighting(world, settings, 0);
  AuditedSampler audited;
  if (lighting.use_light_tree) {
    const MakeLighting make = [&world, settings](int sample) {
      return unshadowed(make_indirect_lighting(world, settings, sample).light_tree);
    };
    const LightSampler sampler = lighting.light_tree.sampler;
    const auto leaves = std::make_shared<std::vector<std::uint32_t>>(
        leaves_of_emitters(sampler.tree, sampler.lights.emitters.size()));
    return audit_of_lighting(scene, world, settings, name, cache, leaves, make);
  }
  lighting.tracer = nullptr;
  audited = lighting.sampler.choice == VplChoice::kTree ? audit_of_substitute_tree(lighting)
                                                        : audit_of_vpl_choice(lighting);
  audited.name = name;
  return audited;
}

}  // namespace lumigrove
