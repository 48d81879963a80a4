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
  const SceneView view = world->geometry->arrays.view();
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

namespace {

// Frames lit below shared cuts.
struct CutFrames {
  Settings settings = make_preset("rtslc");
  std::unique_ptr<World> world;
  Film film{settings.width, settings.height};

  CutFrames(const Scene& scene, Hierarchy hierarchy) {
    settings.direct.hierarchy = hierarchy;
    RenderStats stats;
    world = make_world(scene, settings, stats);
  }

  struct Times {
    double cuts = 0, selection = 0, shadow = 0;
    double choice() const { return cuts + selection; }
    double all() const { return choice() + shadow; }
  };
  Times render() {
    RenderStats stats;
    render_sample(*world, settings, 0, film, stats);
    Times times;
    for (const PassStats& pass : stats.passes) {
      if (pass.name == "cuts") times.cuts = pass.ms;
      if (pass.name == "light selection") times.selection = pass.ms;
      if (pass.name == "shadow rays") times.shadow = pass.ms;
    }
    return times;
  }
};

}  // namespace

Result sample_two_level_cut_night_city(const Options& options) {
  const Scene scene = load_scene("night-city");
  CutFrames two_level(scene, Hierarchy::kTwoLevel), one_level(scene, Hierarchy::kPerfect);
  two_level.render();
  one_level.render();
  std::vector<double> all, choice, cuts, two_ms, one_ms;
  for (int i = 0; i < options.runs; ++i) {
    const CutFrames::Times two = two_level.render(), one = one_level.render();
    all.push_back(two.all() / one.all());
    choice.push_back(two.choice() / one.choice());
    cuts.push_back(two.cuts / two.all());
    two_ms.push_back(two.all());
    one_ms.push_back(one.all());
  }
  const auto [lowest, highest] = std::minmax_element(all.begin(), all.end());
  const double lowest_ratio = *lowest, highest_ratio = *highest;
  return {median(all),
          {{"without shadow rays", median(choice)},
           {"share of selecting cuts, two levels", median(cuts)},
           {"two levels, ms", median(two_ms)},
           {"one level, ms", median(one_ms)},
           {"lowest_ratio", lowest_ratio},
           {"highest_ratio", highest_ratio}}};
}

Result sample_two_level_night_city(const Options& options) { return sample_two_level(options, "night-city"); }
Result sample_two_level_cornell_lights(const Options& options) {
  return sample_two_level(options, "cornell-lights");
}

}  // namespace lumigrove::bench
