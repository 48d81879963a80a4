// The two-level light tree beside the perfect tree over the same emitters: what a frame rebuilds, and a light sample.
#include "bench.h"
#include "frame/frame.h"
#include "surface_batch.h"

namespace lumigrove::bench {
namespace {

Settings two_level_settings() {
  Settings settings = make_preset("tree");
  settings.direct.hierarchy = Hierarchy::kTwoLevel;
  return settings;
}

}  // namespace

Result build_two_level(const Options& options) {
  const Scene scene = load_scene("night-city");
  const Settings settings = two_level_settings();
  RenderStats stats;
  const std::unique_ptr<World> world = make_world(scene, settings, stats);
  const SceneView view = world->arrays.view();
  const LightView lights = world->lights.view();
  const LightTree::Options tree{settings.direct.width, settings.direct.cones, false};
  const double first_ms = world->two_level.mesh_ms();
  const PairTimes times = time_in_turns(
      options.runs, [&] { world->two_level.build(view, lights, tree); },
      [&] { world->tree.build(lights, tree); });
  return {times.ratio,
          {{"two-level, rebuilt every frame, ms", times.a_ms},
           {"perfect tree, ms", times.b_ms},
           {"trees of meshes, built once, ms", first_ms},
           {"two-level, bytes", static_cast<double>(world->two_level.bytes())},
           {"perfect tree, bytes", static_cast<double>(world->tree.bytes())},
           {"leaves of the top level", static_cast<double>(world->two_level.top().view().count)},
           {"leaves of meshes", static_cast<double>(world->two_level.mesh_triangles())},
           {"emitters", static_cast<double>(lights.emitters.size())},
           {"lowest_ratio", times.lowest_ratio},
           {"highest_ratio", times.highest_ratio}}};
}

namespace {

Result sample_two_level(const Options& options, const std::string& scene) {
  SurfaceBatch one_level(scene), two_level(scene, two_level_settings());
  const PairTimes times = time_in_turns(
      options.runs, [&] { two_level.sample(); }, [&] { one_level.sample(); });
  const double samples = static_cast<double>(one_level.size());
  return {times.ratio,
          {{"ns per sample, two levels, all threads", times.a_ms * 1e6 / samples},
           {"ns per sample, one level, all threads", times.b_ms * 1e6 / samples},
           {"lowest_ratio", times.lowest_ratio},
           {"highest_ratio", times.highest_ratio}}};
}

}  // namespace

Result sample_two_level_night_city(const Options& options) { return sample_two_level(options, "night-city"); }
Result sample_two_level_cornell_lights(const Options& options) {
  return sample_two_level(options, "cornell-lights");
}

}  // namespace lumigrove::bench
