// The trees that the perfect light tree is compared with: their builds, and the price of a sample.
#include "bench.h"
#include "device/device.h"
#include "frame/frame.h"
#include "methods/light_sampling/direct_lighting_kernel.h"
#include "scene/surface_kernel.h"

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

// What a camera sees, and room for one light sample for each.
struct Surfaces {
  std::vector<Surface> surfaces;
  std::vector<std::uint32_t> pixels;
  std::vector<Ray> shadow;
  std::vector<vec3> contribution;

  Surfaces(const World& world, const Settings& settings) {
    const CameraView camera = make_camera_view(world.camera, settings.width, settings.height);
    const PixelWindow window{0, 0, settings.width, settings.height};
    const auto n = static_cast<std::size_t>(window.count());
    std::vector<Ray> rays(n);
    std::vector<Hit> hits(n);
    pixels.resize(n);
    surfaces.resize(n);
    shadow.resize(n);
    contribution.resize(n);
    launch(window.count(), CameraKernel{camera, window, rays, pixels, 0, 0, true});
    world.tracer.closest(rays, hits, Coherence::kCoherent);
    launch(window.count(), SurfaceKernel{world.arrays.view(), rays, hits, surfaces});
  }

  // One light sample at every surface: choice, point, shading, shadow ray; nothing is traced.
  void sample(const DirectLighting& direct) {
    launch(walk_batches(static_cast<int>(surfaces.size())),
           DirectLightKernel{direct.sampler, direct.rng, kDimLight, 1.0f, false, surfaces, pixels, shadow, contribution},
           kLaunchGrain / kWalkBatch);
  }
};

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
  Surfaces surfaces(*world, tree);
  const auto sampling = [&](const World& w, const Settings& settings) {
    return [&surfaces, direct = make_direct_lighting(w, settings, 0)] { surfaces.sample(direct); };
  };
  const auto reference = sampling(*perfect, tree);
  const PairTimes times = time_in_turns(options.runs, sampling(*world, bvh), reference);
  const PairTimes min_max = time_in_turns(options.runs, sampling(*other, bvh_min_max), reference);
  const PairTimes two = time_in_turns(options.runs, sampling(*halves, binary), reference);
  const double ns = 1e6 / static_cast<double>(surfaces.surfaces.size());
  return {times.ratio,
          {{"ns per sample, SAOH tree, all threads", times.a_ms * ns},
           {"ns per sample, perfect tree, all threads", times.b_ms * ns},
           {"ratio with min-max weights", min_max.ratio},
           {"ratio of the binary perfect tree", two.ratio},
           {"lowest_ratio", times.lowest_ratio},
           {"highest_ratio", times.highest_ratio}}};
}

}  // namespace lumigrove::bench
