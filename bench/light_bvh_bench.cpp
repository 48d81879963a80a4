// The trees that the perfect light tree is compared with: their builds, and the price of a sample.
#include "bench.h"
#include "frame/frame.h"
#include "surface_batch.h"

namespace lumigrove::bench {
namespace {

constexpr const char* kScene = "cornell-lights";

Result build_ratio(const Options& options, Hierarchy builder) {
  const Scene scene = load_scene(kScene);
  const Settings settings = make_preset("tree");
  RenderStats stats;
  const std::unique_ptr<World> world = make_world(scene, settings, stats);
  const LightView lights = world->lights.view();
  const PairTimes times = time_in_turns(
      options.runs, [&] { world->bvh.build(lights, {builder, Weights::kMinMax, true}); },
      [&] { world->tree.build(lights, {settings.direct.width, settings.direct.cones, false}); });
  return {times.ratio,
          {{"build_ms", times.a_ms},
           {"perfect_ms", times.b_ms},
           {"lowest_ratio", times.lowest_ratio},
           {"highest_ratio", times.highest_ratio},
           {"emitters", static_cast<double>(lights.emitters.size())}}};
}

}  // namespace

Result build_agglomerative(const Options& options) { return build_ratio(options, Hierarchy::kAgglomerative); }

Result build_saoh(const Options& options) { return build_ratio(options, Hierarchy::kSaoh); }

Result sample_light_bvh(const Options& options) {
  const Scene scene = load_scene(kScene);
  RenderStats stats;
  const Settings tree = make_preset("tree");
  Settings bvh = make_preset("ats"), bvh_min_max = bvh, binary = tree;
  bvh_min_max.direct.weights = Weights::kMinMax;
  binary.direct.width = 2;
  const std::unique_ptr<World> world = make_world(scene, bvh, stats), other = make_world(scene, bvh_min_max, stats),
                               perfect = make_world(scene, tree, stats), halves = make_world(scene, binary, stats);
  SampleBatch batch(*world, tree);
  const auto sampling = [&](const World& w, const Settings& settings) {
    return [&batch, direct = make_direct_lighting(w, settings, 0)] { batch.sample(direct); };
  };
  const auto reference = sampling(*perfect, tree);
  const PairTimes times = time_in_turns(options.runs, sampling(*world, bvh), reference);
  const PairTimes min_max = time_in_turns(options.runs, sampling(*other, bvh_min_max), reference);
  const PairTimes two = time_in_turns(options.runs, sampling(*halves, binary), reference);
  const double ns = 1e6 / static_cast<double>(batch.size());
  return {times.ratio,
          {{"ns per sample, SAOH tree, all threads", times.a_ms * ns},
           {"ns per sample, perfect tree, all threads", times.b_ms * ns},
           {"ratio with min-max weights", min_max.ratio},
           {"ratio of the binary perfect tree", two.ratio},
           {"lowest_ratio", times.lowest_ratio},
           {"highest_ratio", times.highest_ratio}}};
}

}  // namespace lumigrove::bench
