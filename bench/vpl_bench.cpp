// Tracing of virtual point lights over its ray floor.
#include "bare_embree.h"
#include "bench.h"
#include "frame/frame.h"
#include "methods/vpl/vpl.h"

namespace lumigrove::bench {
namespace {

// 33,333 paths of at most 3 bounces: the substitute trees' 100,000 lights.
Result trace_over_floor(const char* scene_name, const Options& options) {
  const Scene scene = load_scene(scene_name);
  const Settings settings = make_preset("tree");
  RenderStats stats;
  const std::unique_ptr<World> world = make_world(scene, settings, stats);
  VplTracing tracing;
  tracing.scene = world->geometry->arrays.view();
  tracing.lights = world->lights.view();
  tracing.bounds = world->geometry->state.bounds;
  tracing.tracer = &world->geometry->tracer;

  VplSet vpls;
  RayRecorder recorder;
  world->geometry->tracer.record(&recorder);
  vpls.trace(tracing);
  world->geometry->tracer.record(nullptr);
  BareEmbree bare(scene, world->geometry->state);
  bare.set_rays(recorder.closest, {});
  const int mode = bare.best_closest_mode(5);

  const PairTimes times =
      time_in_turns(options.runs, [&] { vpls.trace(tracing); }, [&] { bare.trace_closest(mode); });
  Result result{times.ratio, {}};
  result.details = {{"trace_ms", times.a_ms},
                    {"floor_ms, " + BareEmbree::mode_name(mode), times.b_ms},
                    {"lowest_ratio", times.lowest_ratio},
                    {"highest_ratio", times.highest_ratio},
                    {"rays", static_cast<double>(vpls.rays())},
                    {"lights", static_cast<double>(vpls.view().vpls.size())},
                    {"emitters", static_cast<double>(tracing.lights.emitters.size())}};
  return result;
}

}  // namespace

Result vpl_trace_night_city(const Options& options) { return trace_over_floor("night-city", options); }
Result vpl_trace_colonnade(const Options& options) { return trace_over_floor("colonnade", options); }

}  // namespace lumigrove::bench
