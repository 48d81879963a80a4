// A whole frame, top to bottom.

#include "frame/frame.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "base/rng.h"
#include "base/stopwatch.h"
#include "device/device.h"
#include "frame/camera.h"
#include "frame/emission_kernel.h"
#include "methods/reference/path.h"
#include "methods/vpl_sampling/gather.h"
#include "scene/surface_kernel.h"

namespace lumigrove {
namespace {

// --- one tile ----------------------------------------------------------------------------------------------

// A tile's working set stays in a core's cache between the steps.
constexpr int kTileSize = 64;

struct TileBuffers {
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  std::vector<Surface> surfaces;
  std::vector<std::uint32_t> pixels;
  std::vector<vec3> direct, indirect, emission;
  DirectBuffers direct_buffers;
  PathBuffers path_buffers;
  IndirectBuffers indirect_buffers;
  GatherBuffers gather_buffers;
  double camera_ms = 0, primary_ms = 0, surface_ms = 0, film_ms = 0;
  std::uint64_t primary_rays = 0;
};

PixelWindow crop_window(const Settings& settings) {
  if (!settings.pixel_bounds) return {0, 0, settings.width, settings.height};
  const auto& b = *settings.pixel_bounds;
  return {std::clamp(b[0], 0, settings.width), std::clamp(b[2], 0, settings.height),
          std::clamp(b[1], 0, settings.width), std::clamp(b[3], 0, settings.height)};
}

std::vector<PixelWindow> make_tiles(const PixelWindow& window) {
  std::vector<PixelWindow> tiles;
  for (int y = window.y0; y < window.y1; y += kTileSize)
    for (int x = window.x0; x < window.x1; x += kTileSize)
      tiles.push_back({x, y, std::min(x + kTileSize, window.x1), std::min(y + kTileSize, window.y1)});
  return tiles;
}

// Runs `step` and adds its wall time to `ms`.
template <class Step>
void timed(double& ms, const Step& step) {
  const ScopedTimer timer(ms);
  step();
}

// As the camera's surfaces are lit, but by one sample: direct.spp, cuts and splitting are for what the camera sees.
DirectLighting away_from_camera(DirectLighting direct) {
  direct.spp = 1;
  direct.use_cuts = false;
  direct.use_pools = false;
  direct.use_split = false;
  return direct;
}

// Paths go on from the first hits as settings.indirect asks; with MIS their first ray also finds direct light, beside
// the samples that were taken with `buffers`.
PathTracing make_path_tracing(const Settings& settings, const DirectLighting& direct,
                              const DirectBuffers& buffers) {
  PathTracing tracing;
  tracing.lighting = away_from_camera(direct);
  tracing.first_spp = direct.use_cuts ? direct.lookup.passes(direct.cut.size) : direct.spp;
  if (direct.use_cuts) tracing.first_cuts = samples_below(buffers.cuts, direct.lookup);
  if (direct.use_split) tracing.first_split = {buffers.split_entries, buffers.split_counts, direct.split.cap};
  tracing.max_bounces = settings.indirect.transport == Transport::kPath ? settings.indirect.max_bounces : 0;
  tracing.roulette_start = settings.indirect.roulette_start;
  tracing.light_scale = settings.light_scale;
  tracing.force_diffuse = settings.force_diffuse;
  return tracing;
}

// One more ray from mirrors and near corners, lit where it arrives as the surfaces themselves are.
Gather make_gather(const Settings& settings, const DirectLighting& direct, const IndirectLighting& indirect) {
  Gather gather{away_from_camera(direct), indirect, settings.indirect.compensate, settings.force_diffuse};
  gather.direct.mis = false;
  gather.indirect.light_tree = away_from_camera(indirect.light_tree);
  return gather;
}

// G-buffer · direct light · indirect light · film, for the pixels of one tile.
void light_tile(const World& world, const Settings& settings, DirectLighting direct, IndirectLighting indirect,
                const CameraView& camera, const PixelWindow& tile, int sample, TileBuffers& b, Film& film) {
  const int count = tile.count();
  const std::size_t n = static_cast<std::size_t>(count);
  const SceneView scene = world.geometry->arrays.view();
  const LightView lights = world.lights.view();

  timed(b.camera_ms, [&] {
    b.rays.resize(n);
    b.pixels.resize(n);
    b.direct.assign(n, vec3(0));
    b.indirect.assign(n, vec3(0));
    b.emission.resize(n);
    launch(count, CameraKernel{camera, tile, b.rays, b.pixels, direct.rng.seed, direct.rng.frame, settings.jitter});
  });
  timed(b.primary_ms, [&] {
    b.hits.resize(n);
    world.geometry->tracer.closest(b.rays, b.hits, Coherence::kCoherent);
    b.primary_rays += n;
  });
  timed(b.surface_ms, [&] {
    b.surfaces.resize(n);
    launch(count, SurfaceKernel{scene, b.rays, b.hits, b.surfaces, settings.force_diffuse});
    launch(count, EmissionKernel{scene, lights, settings.light_scale, b.rays, b.surfaces, b.emission});
  });

  direct.set_window(tile);
  indirect.light_tree.set_window(tile);
  b.direct_buffers.vpl_sum = settings.indirect.joint ? std::span<vec3>(b.indirect) : std::span<vec3>();
  add_direct_light(direct, b.surfaces, b.pixels, kDimLight, b.direct_buffers, b.direct);
  add_path_light(make_path_tracing(settings, direct, b.direct_buffers), b.surfaces, b.pixels, b.path_buffers,
                 b.direct, b.indirect);
  if (settings.indirect.transport == Transport::kVpl) {
    b.indirect_buffers.wants_traces = !film.walks.empty();
    add_indirect_light(indirect, b.surfaces, b.pixels, kDimIndirect, b.indirect_buffers, b.indirect);
    add_gathered_light(make_gather(settings, direct, indirect), b.surfaces, b.pixels, b.gather_buffers, b.indirect);
    if (!film.walks.empty())
      launch(count, WalkFilmKernel{sample, b.indirect_buffers.traces, b.pixels, film.walks});
  }

  timed(b.film_ms, [&] {
    launch(count, FilmKernel{sample,
                             lights,
                             camera.position,
                             camera.forward,
                             b.surfaces,
                             b.pixels,
                             {b.direct, b.indirect, b.emission},
                             film.pixels});
  });
}

// Frame and seed together key the hash's seed; camera samples count in its frame slot.
Rng frame_rng(const Settings& settings, int sample) {
  const uvec4 key = pcg4d(uvec4(settings.seed, static_cast<std::uint32_t>(settings.frame), 0, 0));
  return {key.x, static_cast<std::uint32_t>(sample), 0};
}

// A structure that is made anew for every camera sample: its latest figures.
void set_structure(RenderStats& stats, const StructureStats& structure) {
  for (StructureStats& known : stats.structures)
    if (known.name == structure.name) {
      known = structure;
      return;
    }
  stats.structures.push_back(structure);
}

// A pass by the wall clock.
void add_pass_ms(RenderStats& stats, const char* name, double ms, std::uint64_t rays) {
  for (PassStats& pass : stats.passes) {
    if (pass.name != name) continue;
    pass.ms += ms;
    pass.rays += rays;
    return;
  }
  stats.passes.push_back({name, ms, rays});
}

// Adds what each thread measured, as wall time: the threads' sum over their number.
void add_pass(RenderStats& stats, const char* name, double thread_ms, std::uint64_t rays) {
  add_pass_ms(stats, name, thread_ms / tbb::this_task_arena::max_concurrency(), rays);
}

void add_gather_passes(RenderStats& stats, const GatherBuffers& gather) {
  add_pass(stats, "gather rays", gather.trace_ms, gather.rays_traced);
  add_pass(stats, "gather surfaces", gather.surface_ms, 0);
  add_pass(stats, "gather selection", gather.direct.select_ms + gather.indirect.select_ms, 0);
  add_pass(stats, "gather shadow rays", gather.direct.trace_ms + gather.indirect.trace_ms,
           gather.direct.rays + gather.indirect.rays);
}

// Shadow rays leave a substitute through this much of its surroundings, in units of D: it may lie inside geometry.
constexpr float kSubstituteOffset = 2.2e-3f;
// Distance that stands for none where kInBox leaves it out, in units of D.
constexpr float kInsideDistance = 0.2155f;

bool uses_bvh(const SelectionSettings& s) {
  return (s.selection == Selection::kRoot || s.selection == Selection::kCut) &&
         (s.hierarchy == Hierarchy::kSaoh || s.hierarchy == Hierarchy::kAgglomerative);
}

bool uses_tree(const SelectionSettings& s) {
  return (s.selection == Selection::kRoot || s.selection == Selection::kCut || s.selection == Selection::kPool) &&
         (s.hierarchy == Hierarchy::kPerfect || s.hierarchy == Hierarchy::kTwoLevel);
}

// Are VPLs chosen from a light tree of their own?
bool uses_vpl_light_tree(const IndirectSettings& s) {
  return s.transport == Transport::kVpl && !s.joint && (uses_tree(s) || uses_bvh(s));
}

// One tree over all lights of `lights`: a perfect one or a BVH. `floor`: least distance in the weights, metres.
StructureStats build_light_tree(const LightView& lights, const SelectionSettings& settings, bool keep_leaves,
                                float floor, LightTree& tree, LightBvh& bvh) {
  if (!uses_bvh(settings)) {
    tree.build(lights, {settings.width, settings.cones, keep_leaves, settings.weights, floor});
    return {"perfect tree", tree.build_ms(), tree.bytes(), tree.view().count};
  }
  bvh.build(lights, {settings.hierarchy, settings.weights, settings.cones, floor});
  return {settings.hierarchy == Hierarchy::kSaoh ? "SAOH tree" : "agglomerative tree", bvh.build_ms(), bvh.bytes(),
          bvh.view().count};
}

void build_two_level_tree(World& world, const DirectSettings& settings, RenderStats& stats) {
  TwoLevelTree& tree = world.two_level;
  const int meshes = tree.meshes_built();
  tree.build(world.geometry->arrays.view(), world.lights.view(),
             {settings.width, settings.cones, settings.mis, settings.weights});
  if (tree.meshes_built() > meshes)
    stats.structures.push_back({"bottom trees", tree.mesh_ms(), tree.mesh_bytes(), tree.mesh_triangles()});
  stats.structures.push_back({"two-level tree", tree.build_ms(), tree.bytes(), tree.top().view().count});
}

// weights[i] = weight_of(i), as a table to draw from.
template <class Weight>
StructureStats build_alias_table(AliasTable& table, const char* name, std::size_t count, const Weight& weight_of) {
  const Stopwatch watch;
  std::vector<float> weights(count);
  launch(static_cast<int>(count), [&](int i) { weights[static_cast<std::size_t>(i)] = weight_of(i); });
  table.build(weights);
  return {name, watch.ms(), table.bytes(), count};
}

// Over the flux of all emitters of `lights`.
StructureStats build_alias_table(AliasTable& table, const LightView& lights) {
  return build_alias_table(table, "alias table", lights.emitters.size(),
                           [&](int i) { return emitter_flux(lights, static_cast<std::uint32_t>(i)); });
}

// G_max, 1/m^2.
float vpl_clamp(const IndirectSettings& s, float diagonal) {
  return s.clamp > 0 ? s.clamp / (diagonal * diagonal) : kInfinity;
}

// Structures over virtual point lights, which have a line of their own in the statistics.
void set_vpl_structure(RenderStats& stats, const std::string& kind, StructureStats structure) {
  structure.name = kind + " " + structure.name;
  structure.of_vpls = true;
  set_structure(stats, structure);
}

// How samples of the lights are taken: of `tree`, `bvh` or the table that the sampler has.
void set_selection(const SelectionSettings& settings, const Settings& frame, int sample, DirectLighting& lighting) {
  LightSampler& sampler = lighting.sampler;
  const bool bvh = uses_bvh(settings);
  switch (settings.selection) {
    case Selection::kUniform:
      sampler.choice = LightChoice::kUniform;
      break;
    case Selection::kPower:
      sampler.choice = LightChoice::kPower;
      break;
    case Selection::kRoot:
      sampler.choice = bvh ? LightChoice::kBvh : LightChoice::kTree;
      lighting.use_split = bvh && settings.split > 0;
      lighting.split = {settings.split, settings.split_cap};
      break;
    case Selection::kCut: {
      sampler.choice = bvh ? LightChoice::kBvh : LightChoice::kTree;
      lighting.use_cuts = true;
      const float floor = settings.cut_floor * sampler.lights.bounds.diagonal();
      const float floor2 = bvh ? sampler.bvh.floor2 : sampler.tree.floor2;
      lighting.cut = {settings.spp, std::max(floor * floor, floor2), settings.cut_bound};
      lighting.lookup.share = settings.cut_share;
      lighting.lookup.interleave = settings.cut_interleave;
      lighting.lookup.frame = static_cast<std::uint32_t>(frame.frame) + static_cast<std::uint32_t>(sample);
      break;
    }
    case Selection::kPool:
      sampler.choice = LightChoice::kTree;
      lighting.use_pools = true;
      lighting.pools.size = settings.pool;
      lighting.pools.interleave = settings.cut_interleave;
      lighting.pools.areas.share = settings.cut_share * settings.cut_interleave;
      lighting.pools.areas.frame = static_cast<std::uint32_t>(frame.frame) + static_cast<std::uint32_t>(sample);
      break;
    case Selection::kAll:
      lighting.all = true;
      break;
  }
  lighting.rng = frame_rng(frame, sample);
  lighting.spp = settings.spp;
}

// The sampler that settings.indirect asks for over the virtual point lights as emitters.
DirectLighting make_vpl_light_tree_lighting(const World& world, const Settings& settings, int sample) {
  DirectLighting lighting;
  lighting.sampler.scene = world.geometry->arrays.view();
  lighting.sampler.lights = world.vpl_lights.view();
  lighting.sampler.tree = world.vpl_tree.view();
  lighting.sampler.bvh = world.vpl_bvh.view();
  lighting.sampler.vpl_gloss = settings.indirect.gloss;
  lighting.sampler.vpl_mirror_roughness = settings.indirect.mirror_roughness;
  lighting.tracer = &world.geometry->tracer;
  set_selection(settings.indirect, settings, sample, lighting);
  return lighting;
}

}  // namespace

// --- the world ---------------------------------------------------------------------------------------------

std::shared_ptr<Geometry> make_geometry(const Scene& scene, const Settings& settings, RenderStats& stats) {
  SceneState state = evaluate(scene, settings.time);
  SceneArrays arrays(scene);
  arrays.set_state(state);
  const Stopwatch watch;
  Tracer tracer(scene, state);
  stats.structures.push_back({kAccelerationStructure, watch.ms(), tracer.bytes(), state.instances.size()});
  return std::make_shared<Geometry>(Geometry{std::move(state), std::move(arrays), std::move(tracer)});
}

std::unique_ptr<World> make_world(const Scene& scene, const Settings& settings, RenderStats& stats,
                                  History::Kept* kept) {
  return make_world(scene, make_geometry(scene, settings, stats), settings, stats, kept);
}

std::unique_ptr<World> make_world(const Scene& scene, std::shared_ptr<Geometry> geometry, const Settings& settings,
                                  RenderStats& stats, History::Kept* kept) {
  History::Kept known;
  if (kept) known = take_kept(*kept, scene, settings);
  LightSet lights = known.lights ? std::move(*known.lights) : LightSet(scene, geometry->arrays);
  CameraInstance camera = resolve_camera(scene, geometry->state, settings);
  auto world = std::make_unique<World>(World{std::move(geometry), std::move(lights), {}, std::move(known.two_level), {}, {},
                                             std::move(camera), known.texture_key, known.shape_key, {}, {}, {}, {}, {}, {}});
  build_lights(*world, settings, stats);
  return world;
}

void keep(World&& world, History::Kept& kept) {
  kept.texture_key = world.texture_key;
  kept.shape_key = world.shape_key;
  kept.lights.emplace(std::move(world.lights));
  kept.two_level = std::move(world.two_level);
}

void build_lights(World& world, const Settings& settings, RenderStats& stats) {
  world.lights.gather(world.geometry->arrays, world.geometry->state, settings);
  const LightView lights = world.lights.view();
  stats.emitters = lights.emitters.size();
  stats.structures.push_back(
      {"light set", world.lights.gather_ms(), world.lights.bytes(), lights.emitters.size()});
  if (settings.indirect.joint) return;
  const DirectSettings& direct = settings.direct;
  if (uses_tree(direct) && direct.hierarchy == Hierarchy::kTwoLevel)
    build_two_level_tree(world, direct, stats);
  else if (uses_tree(direct) || uses_bvh(direct))
    stats.structures.push_back(build_light_tree(lights, direct, direct.mis, 0, world.tree, world.bvh));
  if (direct.selection == Selection::kPower) stats.structures.push_back(build_alias_table(world.alias, lights));
}

namespace {

// What chooses among the virtual point lights alone.
void build_vpl_structures(World& world, const IndirectSettings& indirect, RenderStats& stats) {
  const VplView vpls = world.vpls.view();
  const float d = vpls.diagonal;
  if (uses_vpl_light_tree(indirect)) {
    world.vpl_lights.gather(vpls, vpl_clamp(indirect, d));
    set_vpl_structure(stats, "VPL",
                      {"light set", world.vpl_lights.gather_ms(), world.vpl_lights.bytes(), vpls.vpls.size()});
    StructureStats tree = build_light_tree(world.vpl_lights.view(), indirect, false, indirect.distance_floor * d,
                                           world.vpl_tree, world.vpl_bvh);
    if (indirect.hierarchy == Hierarchy::kPerfect) tree.name = "light tree";
    set_vpl_structure(stats, "VPL", tree);
  } else if (indirect.selection == Selection::kRoot) {
    world.substitutes.build(vpls, {indirect.topology, indirect.min_nu, indirect.max_sigma * d,
                                   indirect.max_diagonal > 0 ? indirect.max_diagonal * d : kInfinity});
    set_structure(stats, {"substitute tree", world.substitutes.build_ms(), world.substitutes.bytes(),
                          world.substitutes.view().count, true});
  } else if (indirect.selection == Selection::kPower) {
    set_vpl_structure(stats, "VPL",
                      build_alias_table(world.vpl_alias, "alias table", vpls.vpls.size(), [&](int i) {
                        return luminance(vpls.vpls[static_cast<std::size_t>(i)].intensity);
                      }));
  }
}

// What chooses among emitters and virtual point lights as one set.
void build_joint_structures(World& world, const Settings& settings, RenderStats& stats) {
  const DirectSettings& direct = settings.direct;
  const VplView vpls = world.vpls.view();
  world.vpl_lights.gather_behind(world.lights.view(), vpls, vpl_clamp(settings.indirect, vpls.diagonal));
  const LightView lights = world.vpl_lights.view();
  set_vpl_structure(stats, "joint",
                    {"light set", world.vpl_lights.gather_ms(), world.vpl_lights.bytes(), lights.emitters.size()});
  if (uses_tree(direct) || uses_bvh(direct)) {
    const float floor = settings.indirect.distance_floor * vpls.diagonal;
    StructureStats tree = build_light_tree(lights, direct, direct.mis, floor, world.tree, world.bvh);
    if (direct.hierarchy == Hierarchy::kPerfect) tree.name = "light tree";
    set_vpl_structure(stats, "joint", tree);
  }
  if (direct.selection == Selection::kPower)
    set_vpl_structure(stats, "joint", build_alias_table(world.alias, lights));
}

}  // namespace

void trace_vpls(World& world, const Settings& settings, int sample, RenderStats& stats) {
  const IndirectSettings& indirect = settings.indirect;
  if (indirect.transport != Transport::kVpl || (indirect.keep_vpls && sample > 0)) return;
  VplTracing tracing;
  tracing.scene = world.geometry->arrays.view();
  tracing.lights = world.lights.view();
  tracing.bounds = world.geometry->state.bounds;
  tracing.tracer = &world.geometry->tracer;
  tracing.rng = frame_rng(settings, sample);
  tracing.paths = std::max(1, indirect.vpls / indirect.bounces);
  tracing.bounces = indirect.bounces;
  tracing.roulette_start = indirect.roulette_start;
  tracing.force_diffuse = settings.force_diffuse;
  world.vpls.trace(tracing);
  const VplView vpls = world.vpls.view();
  add_pass_ms(stats, "VPL paths", world.vpls.trace_ms(), world.vpls.rays());
  set_structure(stats, {"VPLs", world.vpls.trace_ms(), world.vpls.bytes(), vpls.vpls.size(), true});
  if (indirect.joint)
    build_joint_structures(world, settings, stats);
  else
    build_vpl_structures(world, indirect, stats);
}

IndirectLighting make_indirect_lighting(const World& world, const Settings& settings, int sample) {
  const IndirectSettings& s = settings.indirect;
  IndirectLighting indirect;
  if (s.transport != Transport::kVpl) return indirect;
  VplSampler& sampler = indirect.sampler;
  const VplView vpls = world.vpls.view();
  const float d = vpls.diagonal;
  if (!s.joint) sampler.lights = vpls;
  sampler.alias = world.vpl_alias.view();
  sampler.walk.tree = world.substitutes.view();
  sampler.walk.weight = s.weights;
  sampler.walk.floor2 = std::max(s.distance_floor * s.distance_floor, 1e-14f) * d * d;
  sampler.walk.inside2 = kInsideDistance * kInsideDistance * d * d;
  sampler.walk.cones = s.cones;
  sampler.walk.substitutes = s.stop == Stop::kSubstitute;
  sampler.choice = s.selection == Selection::kRoot    ? VplChoice::kTree
                   : s.selection == Selection::kPower ? VplChoice::kPower
                                                      : VplChoice::kUniform;
  sampler.clamp = vpl_clamp(s, d);
  sampler.substitute_offset = kSubstituteOffset * d;
  sampler.correction = s.correction;
  sampler.gloss = s.gloss;
  sampler.mirror_roughness = s.mirror_roughness;
  indirect.all = s.selection == Selection::kAll;
  indirect.use_light_tree = uses_vpl_light_tree(s);
  if (indirect.use_light_tree) indirect.light_tree = make_vpl_light_tree_lighting(world, settings, sample);
  indirect.tracer = &world.geometry->tracer;
  indirect.rng = frame_rng(settings, sample);
  indirect.spp = s.spp;
  return indirect;
}

DirectLighting make_direct_lighting(const World& world, const Settings& settings, int sample) {
  DirectLighting direct;
  LightSampler& sampler = direct.sampler;
  sampler.scene = world.geometry->arrays.view();
  sampler.lights = settings.indirect.joint ? world.vpl_lights.view() : world.lights.view();
  sampler.vpl_gloss = settings.indirect.gloss;
  sampler.vpl_mirror_roughness = settings.indirect.mirror_roughness;
  sampler.alias = world.alias.view();
  const bool two_level = settings.direct.hierarchy == Hierarchy::kTwoLevel;
  sampler.tree = two_level ? world.two_level.top().view() : world.tree.view();
  if (two_level) sampler.mesh_trees = world.two_level.view();
  sampler.bvh = world.bvh.view();
  direct.tracer = &world.geometry->tracer;
  direct.mis = settings.direct.mis;
  set_selection(settings.direct, settings, sample, direct);
  return direct;
}

// --- one camera sample of the whole image ------------------------------------------------------------------

void render_sample(const World& world, const Settings& settings, int sample, Film& film, RenderStats& stats) {
  const CameraView camera = make_camera_view(world.camera, settings.width, settings.height);
  const DirectLighting direct = make_direct_lighting(world, settings, sample);
  const IndirectLighting indirect = make_indirect_lighting(world, settings, sample);
  const std::vector<PixelWindow> tiles = make_tiles(crop_window(settings));
  tbb::enumerable_thread_specific<TileBuffers> buffers;

  launch(
      static_cast<int>(tiles.size()),
      [&](int i) {
        // Isolated: while a tile waits for its own inner loops it must not start another tile in the same
        // buffers.
        tbb::this_task_arena::isolate([&] {
          light_tile(world, settings, direct, indirect, camera, tiles[static_cast<std::size_t>(i)], sample,
                     buffers.local(), film);
        });
      },
      1);

  TileBuffers sum;
  for (const TileBuffers& b : buffers) {
    sum.camera_ms += b.camera_ms;
    sum.primary_ms += b.primary_ms;
    sum.surface_ms += b.surface_ms;
    sum.film_ms += b.film_ms;
    sum.primary_rays += b.primary_rays;
    sum.direct_buffers.add_counters(b.direct_buffers);
    sum.path_buffers.add_counters(b.path_buffers);
    sum.indirect_buffers.add_counters(b.indirect_buffers);
    sum.gather_buffers.add_counters(b.gather_buffers);
  }
  add_pass(stats, "camera rays", sum.camera_ms, 0);
  add_pass(stats, "primary hits", sum.primary_ms, sum.primary_rays);
  add_pass(stats, "surfaces", sum.surface_ms, 0);
  if (direct.use_split) add_pass(stats, "splitting", sum.direct_buffers.split_ms, 0);
  if (direct.use_pools) add_pass(stats, "light pools", sum.direct_buffers.pool_ms, 0);
  if (direct.use_cuts) add_pass(stats, "cuts", sum.direct_buffers.cut_ms, 0);
  add_pass(stats, "light selection", sum.direct_buffers.select_ms, 0);
  add_pass(stats, "shadow rays", sum.direct_buffers.trace_ms, sum.direct_buffers.rays);
  if (settings.direct.mis || settings.indirect.transport == Transport::kPath) {
    const PathBuffers& path = sum.path_buffers;
    add_pass(stats, "path rays", path.trace_ms, path.path_rays);
    add_pass(stats, "path surfaces", path.scatter_ms + path.arrive_ms, 0);
    add_pass(stats, "path light selection", path.direct.select_ms, 0);
    add_pass(stats, "path shadow rays", path.direct.trace_ms, path.direct.rays);
  }
  if (settings.indirect.transport == Transport::kVpl) {
    const IndirectBuffers& vpls = sum.indirect_buffers;
    if (indirect.light_tree.use_split) add_pass(stats, "VPL splitting", vpls.light_tree.split_ms, 0);
    if (indirect.light_tree.use_pools) add_pass(stats, "VPL pools", vpls.light_tree.pool_ms, 0);
    if (indirect.light_tree.use_cuts) add_pass(stats, "VPL cuts", vpls.light_tree.cut_ms, 0);
    if (!settings.indirect.joint) {
      add_pass(stats, "VPL selection", vpls.select_ms, 0);
      add_pass(stats, "VPL shadow rays", vpls.trace_ms, vpls.rays);
    }
    if (sum.gather_buffers.rays_traced > 0) add_gather_passes(stats, sum.gather_buffers);
  }
  add_pass(stats, "film", sum.film_ms, 0);
}

Image render(const Scene& scene, const Settings& settings, RenderStats* stats, const ProgressFunction& progress,
             History* history) {
  check(settings);
  RenderStats local;
  RenderStats& result = stats ? *stats : local;
  result = {};
  const int threads = settings.threads > 0 ? settings.threads : tbb::this_task_arena::max_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  return arena.execute([&] {
    const Stopwatch watch;
    History::Kept* const kept = history ? &history->kept() : nullptr;
    const std::unique_ptr<World> world = make_world(scene, settings, result, kept);
    Film film(settings.width, settings.height,
              settings.indirect.show && settings.indirect.transport == Transport::kVpl);
    for (int sample = 0; sample < settings.spp; ++sample) {
      trace_vpls(*world, settings, sample, result);
      render_sample(*world, settings, sample, film, result);
      result.spp_done = sample + 1;
      if (progress && !progress({result.spp_done, settings.spp, watch.ms() * 1e-3})) break;
    }
    if (kept) keep(std::move(*world), *kept);
    result.total_ms = watch.ms();
    return develop(film, result.spp_done);
  });
}

}  // namespace lumigrove
