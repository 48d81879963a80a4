// Error of light selection at equal time.
#include <cmath>

#include "bench.h"
#include "frame/frame.h"
#include "metrics/metrics.h"

namespace lumigrove::bench {
namespace {

constexpr int kWidth = 640, kHeight = 360;
constexpr int kReferenceSpp = 512;  // 64 times the tree's: a reference eight times as exact as what is judged
constexpr int kTreeSpp = 8;

struct Contestant {
  Settings settings;
  std::unique_ptr<World> world;

  Contestant(const Scene& scene, const char* preset, std::uint32_t seed) : settings(make_preset(preset)) {
    settings.width = kWidth;
    settings.height = kHeight;
    settings.seed = seed;
    RenderStats stats;
    world = make_world(scene, settings, stats);
  }

  RgbImage render(int spp) {
    RenderStats stats;
    Film film(kWidth, kHeight);
    for (int sample = 0; sample < spp; ++sample) render_sample(*world, settings, sample, film, stats);
    return rgb_of(develop(film, spp), "", settings.preset);
  }

  // One frame's work: lights, their structure, `spp` camera samples.
  void frame(int spp) {
    RenderStats stats;
    Film film(kWidth, kHeight);
    build_lights(*world, settings, stats);
    for (int sample = 0; sample < spp; ++sample) render_sample(*world, settings, sample, film, stats);
  }
};

}  // namespace

Result error_tree_power(const Options& options) {
  const Scene scene = load_scene("night-city");
  Contestant tree(scene, "tree", 1), power(scene, "power", 2);
  const PairTimes times = time_in_turns(
      options.runs, [&] { tree.frame(kTreeSpp); }, [&] { power.frame(kTreeSpp); });
  // As many samples as power affords in the tree's time, to the nearest whole one.
  const int power_spp = std::max(1, static_cast<int>(std::lround(kTreeSpp * times.ratio)));

  const RgbImage reference = Contestant(scene, "tree", 3).render(kReferenceSpp);
  const double tree_rmse = rmse(reference, tree.render(kTreeSpp));
  const double power_rmse = rmse(reference, power.render(power_spp));
  return {tree_rmse / power_rmse,
          {{"tree samples a pixel", kTreeSpp},
           {"power samples a pixel in the same time", static_cast<double>(power_spp)},
           {"time of a tree sample / of a power sample", times.ratio},
           {"tree RMSE", tree_rmse},
           {"power RMSE", power_rmse}}};
}

}  // namespace lumigrove::bench
