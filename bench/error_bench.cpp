// Error of light selection, at equal time or at equal samples.
#include <cmath>

#include "bench.h"
#include "frame/frame.h"
#include "metrics/metrics.h"

namespace lumigrove::bench {
namespace {

constexpr int kWidth = 640, kHeight = 360;
constexpr int kReferenceSpp = 512;  // 64 times the tree's: a reference eight times as exact as what is judged
constexpr int kTreeSpp = 8;
constexpr std::uint32_t kSeeds = 16;  // a few bright samples rule one image's error, so it is averaged over seeds

struct Contestant {
  Settings settings;
  std::unique_ptr<World> world;

  Contestant(const Scene& scene, const Settings& asked) : settings(asked) {
    settings.width = kWidth;
    settings.height = kHeight;
    RenderStats stats;
    world = make_world(scene, settings, stats);
  }

  RgbImage render(int spp, std::uint32_t seed) {
    settings.seed = seed;
    RenderStats stats;
    Film film(kWidth, kHeight);
    for (int sample = 0; sample < spp; ++sample) render_sample(*world, settings, sample, film, stats);
    return rgb_of(develop(film, spp), "", settings.preset);
  }

  // Root of the mean squared error over kSeeds images.
  double error(const RgbImage& reference, int spp) {
    double sum = 0;
    for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
      const double one = rmse(reference, render(spp, seed));
      sum += one * one;
    }
    return std::sqrt(sum / kSeeds);
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
  Contestant tree(scene, make_preset("tree")), power(scene, make_preset("power"));
  const PairTimes times = time_in_turns(
      options.runs, [&] { tree.frame(kTreeSpp); }, [&] { power.frame(kTreeSpp); });
  // As many samples as power affords in the tree's time, to the nearest whole one.
  const int power_spp = std::max(1, static_cast<int>(std::lround(kTreeSpp * times.ratio)));

  const RgbImage reference = Contestant(scene, make_preset("tree")).render(kReferenceSpp, 1000);
  const double tree_rmse = tree.error(reference, kTreeSpp), power_rmse = power.error(reference, power_spp);
  return {tree_rmse / power_rmse,
          {{"tree samples a pixel", kTreeSpp},
           {"power samples a pixel in the same time", static_cast<double>(power_spp)},
           {"time of a tree sample / of a power sample", times.ratio},
           {"tree RMSE", tree_rmse},
           {"power RMSE", power_rmse}}};
}

Result error_two_level_cut(const Options&) {
  const Scene scene = load_scene("night-city");
  Settings settings = make_preset("rtslc");
  settings.jitter = false;  // edges are no matter of light selection
  Contestant one_level(scene, settings);
  settings.direct.hierarchy = Hierarchy::kTwoLevel;
  Contestant two_level(scene, settings);
  const RgbImage reference = one_level.render(kReferenceSpp / settings.direct.spp, 1000);
  const double two = two_level.error(reference, 1), one = one_level.error(reference, 1);
  return {two / one,
          {{"nodes of a cut", static_cast<double>(settings.direct.spp)},
           {"two levels, RMSE", two},
           {"one level, RMSE", one}}};
}

}  // namespace lumigrove::bench
