// The perfect light tree: its build, its walk, its memory.
#include <tbb/parallel_sort.h>

#include "base/morton.h"
#include "bench.h"
#include "frame/frame.h"
#include "surface_batch.h"

namespace lumigrove::bench {
namespace {

// The keys that the tree sorts: Morton codes of the emitters' centres in their box.
LargeArray<KeyIndex> morton_keys(const LightView& lights) {
  const auto centre = [](const Emitter& e) {
    return e.punctual() ? e.p0 : e.p0 + (e.e1 + e.e2) * (1.0f / 3);
  };
  Box3 box;
  for (const Emitter& e : lights.emitters) box = unite(box, centre(e));
  const vec3 scale = inverse_extent(box);
  LargeArray<KeyIndex> keys;
  for (const Emitter& e : lights.emitters) {
    keys.push_back({morton30((centre(e) - box.lo) * scale), static_cast<std::uint32_t>(keys.size())});
  }
  return keys;
}

}  // namespace

Result build_tree_1m(const Options& options) {
  const Scene scene = load_scene("fireflies?n=1000000");
  const Settings settings = make_preset("tree");
  RenderStats stats;
  const std::unique_ptr<World> world = make_world(scene, settings, stats);
  const LightView lights = world->lights.view();
  const LargeArray<KeyIndex> input = morton_keys(lights);
  LargeArray<KeyIndex> pairs;
  const auto less = [](KeyIndex a, KeyIndex b) { return a.key < b.key; };
  const PairTimes times = time_in_turns(
      options.runs, [&] { world->tree.build(lights, {settings.direct.width, settings.direct.cones, false}); },
      [&] { tbb::parallel_sort(pairs.begin(), pairs.end(), less); }, [&] { pairs = input; });
  return {times.ratio,
          {{"build_ms", times.a_ms},
           {"parallel_sort_ms", times.b_ms},
           {"lowest_ratio", times.lowest_ratio},
           {"highest_ratio", times.highest_ratio},
           {"emitters", static_cast<double>(lights.emitters.size())}}};
}

Result sample_scaling(const Options& options) {
  SurfaceBatch many("fireflies?n=1000000"), few("fireflies?n=10000");
  const PairTimes times = time_in_turns(
      options.runs, [&] { many.sample(); }, [&] { few.sample(); });
  const double many_ns = times.a_ms * 1e6 / static_cast<double>(many.size());
  const double few_ns = times.b_ms * 1e6 / static_cast<double>(few.size());
  const double per_surface = static_cast<double>(few.size()) / static_cast<double>(many.size());
  return {times.ratio * per_surface,
          {{"ns per sample, 1 M emitters, all threads", many_ns},
           {"ns per sample, 10 k emitters, all threads", few_ns},
           {"lowest_ratio", times.lowest_ratio * per_surface},
           {"highest_ratio", times.highest_ratio * per_surface}}};
}

Result memory_per_emitter(const Options&) {
  Result result;
  for (const char* name : {"night-city", "cornell-lights", "fireflies?n=1000000"}) {
    const Scene scene = load_scene(name);
    RenderStats stats;
    const std::unique_ptr<World> world = make_world(scene, make_preset("tree"), stats);
    const double bytes = static_cast<double>(world->lights.bytes() + world->tree.bytes());
    const double per_emitter = bytes / static_cast<double>(stats.emitters);
    result.details.emplace_back(std::string(name) + ", bytes per emitter", per_emitter);
    result.value = std::max(result.value, per_emitter);
  }
  return result;
}

}  // namespace lumigrove::bench
