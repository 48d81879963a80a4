// A whole frame over its ray floor.
#include "bare_embree.h"
#include "bench.h"
#include "frame/frame.h"

namespace lumigrove::bench {
namespace {

// Every frame of an animation gathers the lights, builds the tree and renders. The acceleration structure is left out on
// both sides: the floor replays rays through a finished one.
Result frame_over_floor(const char* scene_name, const char* preset, const Options& options) {
  const Scene scene = load_scene(scene_name);
  const Settings settings = make_preset(preset);
  RenderStats stats;
  const std::unique_ptr<World> world = make_world(scene, settings, stats);
  Film film(settings.width, settings.height);

  RayRecorder recorder;
  world->geometry->tracer.record(&recorder);
  render_sample(*world, settings, 0, film, stats);
  world->geometry->tracer.record(nullptr);
  BareEmbree bare(scene, world->geometry->state);
  bare.set_rays(recorder.closest, recorder.occluded);
  const int closest_mode = bare.best_closest_mode(3), occluded_mode = bare.best_occluded_mode(3);

  stats = {};
  const PairTimes times = time_in_turns(
      options.runs,
      [&] {
        build_lights(*world, settings, stats);
        render_sample(*world, settings, 0, film, stats);
      },
      [&] {
        bare.trace_closest(closest_mode);
        bare.trace_occluded(occluded_mode);
      });

  Result result{times.ratio, {}};
  result.details = {{"frame_ms", times.a_ms},
                    {"floor_ms", times.b_ms},
                    {"lowest_ratio", times.lowest_ratio},
                    {"highest_ratio", times.highest_ratio},
                    {"emitters", static_cast<double>(stats.emitters)},
                    {"primary_rays", static_cast<double>(bare.closest_count())},
                    {"shadow_rays", static_cast<double>(bare.occluded_count())},
                    {"floor primary rays: " + BareEmbree::mode_name(closest_mode) + ", ms",
                     median_ms(options.runs, [&] { bare.trace_closest(closest_mode); })},
                    {"floor shadow rays: " + BareEmbree::mode_name(occluded_mode) + ", ms",
                     median_ms(options.runs, [&] { bare.trace_occluded(occluded_mode); })}};
  const double frames = options.runs + 1;
  double lights_ms = 0;
  for (const StructureStats& structure : stats.structures) lights_ms += structure.build_ms;
  result.details.emplace_back("lights and tree, ms", lights_ms / frames);
  for (const PassStats& pass : stats.passes)
    result.details.emplace_back(pass.name + ", ms", pass.ms / frames);
  return result;
}

}  // namespace

Result frame_floor_night_city(const Options& options) { return frame_over_floor("night-city", "tree", options); }
Result frame_floor_cornell_lights(const Options& options) {
  return frame_over_floor("cornell-lights", "tree", options);
}
Result frame_floor_rtslc_cornell_lights(const Options& options) {
  return frame_over_floor("cornell-lights", "rtslc", options);
}
Result frame_floor_pool_cornell_lights(const Options& options) {
  return frame_over_floor("cornell-lights", "pool", options);
}

}  // namespace lumigrove::bench
