// Stochastic substitute trees: a whole frame over its ray floor, memory, steps and time of walks, error at equal time.
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

#include "bare_embree.h"
#include "bench.h"
#include "sst_study.h"

namespace lumigrove::bench {
namespace {

// --- floor -----------------------------------------------------------------------------------------------------

// A part of a frame's rays, traced in the way that is fastest for them.
class FloorPart {
 public:
  FloorPart(const Study& study, std::span<const Ray> closest, std::span<const Ray> occluded)
      : bare_(study.scene, study.world->geometry->state) {
    bare_.set_rays(closest, occluded);
    closest_mode_ = bare_.best_closest_mode(3);
    occluded_mode_ = bare_.best_occluded_mode(3);
  }

  void trace() const {
    bare_.trace_closest(closest_mode_);
    bare_.trace_occluded(occluded_mode_);
  }
  std::size_t count() const { return bare_.closest_count() + bare_.occluded_count(); }
  std::string mode() const { return BareEmbree::mode_name(bare_.closest_count() > 0 ? closest_mode_ : occluded_mode_); }

 private:
  BareEmbree bare_;
  int closest_mode_, occluded_mode_;
};

// What `work` asks of the tracer.
template <class Function>
RayRecorder record(Study& study, const Function& work) {
  RayRecorder recorder;
  study.world->geometry->tracer.record(&recorder);
  work();
  study.world->geometry->tracer.record(nullptr);
  return recorder;
}

// Rays of one frame by their kind.
struct FrameRays {
  RayRecorder paths, direct, indirect;  // of `direct`, the camera's rays too
};

FrameRays record_frame(Study& study, const Settings& settings) {
  FrameRays rays;
  rays.paths = record(study, [&] { study.trace(settings); });
  Settings direct = settings;
  direct.indirect.transport = Transport::kNone;
  rays.direct = record(study, [&] { render_one(study, direct); });
  // Without emitters only the shadow rays of the virtual point lights are left, which have been traced.
  Settings dark = settings;
  dark.light_scale = 0;
  RenderStats stats;
  build_lights(*study.world, dark, stats);
  rays.indirect = record(study, [&] { render_one(study, dark); });
  build_lights(*study.world, settings, stats);
  return rays;
}

void add_passes(const RenderStats& stats, double frames, Result& result) {
  const double thread_ns =
      1e6 * std::max(1, tbb::this_task_arena::max_concurrency()) / frames / (kTimeWidth * kTimeHeight);
  for (const PassStats& pass : stats.passes)
    result.details.emplace_back(pass.name + ", thread-ns per pixel", pass.ms * thread_ns);
}

// Every frame traces its virtual point lights and builds their tree. The acceleration structure is left out on both
// sides: the floor replays rays through a finished one.
Result frame_over_floor(const char* scene_name, bool diffuse, const Options& options) {
  const Settings settings = sized(sst_settings(diffuse), kTimeWidth, kTimeHeight);
  Study study(scene_name, settings);
  const FrameRays rays = record_frame(study, settings);
  const FloorPart paths(study, rays.paths.closest, {}), camera(study, rays.direct.closest, {}),
      direct(study, {}, rays.direct.occluded), indirect(study, {}, rays.indirect.occluded);

  RenderStats stats;
  Film film(settings.width, settings.height);
  double tree_ms = 0;
  const PairTimes times = time_in_turns(
      options.runs,
      [&] {
        build_lights(*study.world, settings, stats);
        trace_vpls(*study.world, settings, 0, stats);
        tree_ms += study.world->substitutes.build_ms();
        render_sample(*study.world, settings, 0, film, stats);
      },
      [&] {
        paths.trace();
        camera.trace();
        direct.trace();
        indirect.trace();
      });

  Result result{times.ratio, {}};
  const double frames = options.runs + 1;
  result.details = {{"frame_ms", times.a_ms},
                    {"floor_ms", times.b_ms},
                    {"lowest_ratio", times.lowest_ratio},
                    {"highest_ratio", times.highest_ratio},
                    {"VPLs", static_cast<double>(study.world->vpls.view().vpls.size())}};
  const auto add_floor = [&](const char* name, const FloorPart& part) {
    result.details.emplace_back(std::string(name) + ": rays", static_cast<double>(part.count()));
    result.details.emplace_back(std::string(name) + ": floor, " + part.mode() + ", ms",
                                median_ms(options.runs, [&] { part.trace(); }));
  };
  add_floor("VPL paths", paths);
  add_floor("primary hits", camera);
  add_floor("shadow rays", direct);
  add_floor("VPL shadow rays", indirect);
  result.details.emplace_back("substitute tree, ms", tree_ms / frames);
  add_passes(stats, frames, result);
  return result;
}

// The preset lights gloss too, by walks of its own; the same without, beside it.
Result frames_over_floor(const char* scene_name, const Options& options) {
  Result result = frame_over_floor(scene_name, false, options);
  const Result diffuse = frame_over_floor(scene_name, true, options);
  result.details.emplace_back("all surfaces diffuse: ratio", diffuse.value);
  for (const auto& [name, value] : diffuse.details)
    if (name.find("VPL selection") != name.npos || name == "frame_ms" || name == "floor_ms")
      result.details.emplace_back("all surfaces diffuse: " + name, value);
  return result;
}

// --- walks -----------------------------------------------------------------------------------------------------

// Times of both methods, on the same tree, among `vpls` virtual point lights; 1 sample a pixel of the whole image.
struct GrowthStudy {
  Settings few, many;
  Study few_study, many_study;

  GrowthStudy(const char* scene, Settings settings)
      : few(with_vpls(settings, 10000)),
        many(with_vpls(settings, 1000000)),
        few_study(scene, few),
        many_study(scene, many) {
    few_study.trace(few);
    many_study.trace(many);
  }

 private:
  static Settings with_vpls(Settings settings, int vpls) {
    settings = sized(settings, kTimeWidth, kTimeHeight);
    settings.indirect.vpls = vpls;
    return settings;
  }
};

Result sampling_growth(const Settings& settings, const Options& options) {
  Result result;
  for (const char* scene : kStudyScenes) {
    const GrowthStudy growth(scene, settings);
    std::vector<double> few, many, ratios;
    sampling_ms(growth.few_study, growth.few);
    for (int run = 0; run < options.runs; ++run) {
      few.push_back(sampling_ms(growth.few_study, growth.few));
      many.push_back(sampling_ms(growth.many_study, growth.many));
      ratios.push_back(many.back() / few.back());
    }
    const double ratio = median(ratios);
    result.value = std::max(result.value, ratio);
    result.details.emplace_back(std::string(scene) + ": ratio", ratio);
    result.details.emplace_back(std::string(scene) + ": ms, 10 k VPLs", median(few));
    result.details.emplace_back(std::string(scene) + ": ms, 1 M VPLs", median(many));
  }
  return result;
}

// --- error at equal time -----------------------------------------------------------------------------------------

constexpr int kSstSpp = 8;
constexpr int kReferenceSpp = 512;
constexpr std::uint32_t kSeeds = 12;

// A method in one scene: whole frames at full size are timed, small ones compared.
struct Contestant {
  Settings settings;
  Study study;

  Contestant(const Scene& scene, const Settings& method) : settings(method), study(scene, method) {}

  void frame() {
    const Settings full = sized(settings, kTimeWidth, kTimeHeight);
    study.trace(full);
    RenderStats stats;
    Film film(full.width, full.height);
    render_sample(*study.world, full, 0, film, stats);
  }

  // At a fraction of a sample: noise falls with its inverse, in which it is interpolated between whole ones.
  std::vector<double> squared_errors_at(const Reference& reference, double spp) {
    const int below = std::max(1, static_cast<int>(spp)), above = below + 1;
    std::vector<double> errors = squared_errors(reference, below);
    const double share = (1 / spp - 1.0 / below) / (1.0 / above - 1.0 / below);
    if (!(share > 0)) return errors;
    const std::vector<double> better = squared_errors(reference, above);
    for (std::size_t i = 0; i < errors.size(); ++i) errors[i] += (better[i] - errors[i]) * share;
    return errors;
  }

  std::vector<double> squared_errors(const Reference& reference, int spp) {
    Settings small = sized(settings, kErrorWidth, kErrorHeight);
    std::vector<double> errors;
    for (std::uint32_t image = 0; image < kSeeds; ++image) {
      ImageMean mean;
      for (int sample = 0; sample < spp; ++sample) {
        ++small.seed;
        study.trace(small);
        mean.add(render_one(study, small));
      }
      errors.push_back(squared_error(reference, mean.mean().beauty));
    }
    return errors;
  }
};

Result error_against(const char* name, const Settings& other_settings, const Options& options) {
  const Scene scene = load_scene("colonnade");
  Contestant sst(scene, sst_settings(true)), other(scene, other_settings);
  const PairTimes times = time_in_turns(
      options.runs, [&] { sst.frame(); }, [&] { other.frame(); });
  const double other_spp = std::max(1.0, kSstSpp * times.ratio);
  const Reference reference = make_reference(scene, true, kReferenceSpp);
  const std::vector<double> a = sst.squared_errors(reference, kSstSpp);
  const std::vector<double> b = other.squared_errors_at(reference, other_spp);
  const Estimate ratio = root(ratio_of_means(a, b));
  const auto rmse_of = [](const std::vector<double>& squared) {
    Mean mean;
    for (const double x : squared) mean.add(x);
    return std::sqrt(mean.mean());
  };
  return {ratio.value,
          {{"standard error", ratio.error},
           {"sst samples a pixel", kSstSpp},
           {std::string(name) + " samples a pixel in the same time", other_spp},
           {std::string("time of a frame of sst / of ") + name, times.ratio},
           {"sst frame_ms", times.a_ms},
           {std::string(name) + " frame_ms", times.b_ms},
           {"sst RMSE", rmse_of(a)},
           {std::string(name) + " RMSE", rmse_of(b)},
           {"error of the reference", std::sqrt(reference.beauty_variance)}}};
}

}  // namespace

Result frame_floor_sst_colonnade(const Options& options) { return frames_over_floor("colonnade", options); }
Result frame_floor_sst_living_room(const Options& options) { return frames_over_floor("living-room", options); }

Result memory_per_vpl(const Options&) {
  Result result;
  for (const char* scene : kStudyScenes) {
    const Settings settings = sst_settings(false);
    Study study(scene, settings);
    study.trace(settings);
    const double vpls = static_cast<double>(study.world->vpls.view().vpls.size());
    const double bytes = static_cast<double>(study.world->vpls.bytes() + study.world->substitutes.bytes());
    const double scratch = static_cast<double>(study.world->substitutes.scratch_bytes());
    result.value = std::max(result.value, bytes / vpls);
    result.details.emplace_back(std::string(scene) + ": VPLs", vpls);
    result.details.emplace_back(std::string(scene) + ": bytes per VPL", bytes / vpls);
    result.details.emplace_back(std::string(scene) + ": with the buffers of the tree's build",
                                (bytes + scratch) / vpls);
  }
  return result;
}

Result sst_steps(const Options&) {
  Result result;
  for (const char* scene : kStudyScenes) {
    const Settings sst = sized(sst_settings(true), kErrorWidth, kErrorHeight),
                   slc = sized(slc_settings(true), kErrorWidth, kErrorHeight);
    Study study(scene, sst);
    study.trace(sst);
    const SeenImage seen(*study.world, sst);
    const double a = mean_steps(trace_walks(make_indirect_lighting(*study.world, sst, 0), seen));
    const double b = mean_steps(trace_walks(make_indirect_lighting(*study.world, slc, 0), seen));
    result.value = std::max(result.value, a / b);
    result.details.emplace_back(std::string(scene) + ": steps of sst", a);
    result.details.emplace_back(std::string(scene) + ": steps of slc", b);
  }
  return result;
}

Result sst_growth(const Options& options) { return sampling_growth(sst_settings(true), options); }
Result slc_growth(const Options& options) { return sampling_growth(slc_settings(true), options); }

Result error_sst_slc(const Options& options) { return error_against("slc", slc_settings(true), options); }
Result error_sst_path2(const Options& options) { return error_against("path 2", path_settings(true, 2), options); }

}  // namespace lumigrove::bench
