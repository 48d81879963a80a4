// Checks 6 and 7 of the reproduction of stochastic substitute trees: errors and times of images.
#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "bench.h"
#include "sst_checks.h"
#include "sst_study.h"

namespace lumigrove::bench {
namespace {

constexpr int kReferenceSpp = 384;
constexpr int kGroups = 5, kGroupSpp = 16;  // images of 1 sample a pixel, and means of so many of them
constexpr int kTimeRuns = 7;

// --- errors ----------------------------------------------------------------------------------------------------

// One value an image.
struct ImageErrors {
  std::vector<double> squared, squared_indirect, ssim;

  void add(const Reference& reference, const SampleImage& image) {
    squared.push_back(squared_error(reference, image.beauty));
    squared_indirect.push_back(squared_indirect_error(reference, image.indirect));
    ssim.push_back(tone_mapped_ssim(reference.image.beauty, image.beauty));
  }
};

struct MethodErrors {
  ImageErrors one, group;  // of 1 sample a pixel, of kGroupSpp
};

// What is measured in a scene is measured once: two checks read it.
class ErrorStudy {
 public:
  static ErrorStudy& of(const std::string& scene, bool diffuse) {
    static std::map<std::pair<std::string, bool>, ErrorStudy> all;
    return all.try_emplace({scene, diffuse}, scene, diffuse).first->second;
  }

  ErrorStudy(const std::string& scene, bool diffuse)
      : scene_(load_scene(scene)), reference_(make_reference(scene_, diffuse, kReferenceSpp)) {
    fmt::print(stderr, "  reference of {}, {}: done\n", scene, diffuse ? "diffuse" : "glossy");
  }

  const Reference& reference() const { return reference_; }

  // Methods of equal seeds have equal VPLs.
  const MethodErrors& errors(const std::string& method, Settings settings) {
    const auto [found, missing] = errors_.try_emplace(method);
    if (missing) measure(sized(settings, kErrorWidth, kErrorHeight), found->second);
    return found->second;
  }

 private:
  void measure(Settings settings, MethodErrors& errors) {
    Study study(scene_, settings);
    settings.seed = 0;
    for (int group = 0; group < kGroups; ++group) {
      ImageMean mean;
      for (int sample = 0; sample < kGroupSpp; ++sample) {
        ++settings.seed;
        study.trace(settings);
        const SampleImage image = render_one(study, settings);
        errors.one.add(reference_, image);
        mean.add(image);
      }
      errors.group.add(reference_, mean.mean());
    }
  }

  Scene scene_;
  Reference reference_;
  std::map<std::string, MethodErrors> errors_;
};

Estimate rmse_of(const std::vector<double>& squared) {
  Mean mean;
  for (const double value : squared) mean.add(value);
  return root(mean.estimate());
}

Estimate rmse_ratio(const std::vector<double>& a, const std::vector<double>& b) { return root(ratio_of_means(a, b)); }

std::string rmse_note(const std::vector<double>& a, const std::vector<double>& b, double reference_variance) {
  return fmt::format("RMSE {:.4g} and {:.4g}; standard error of the reference {:.2g}, taken off", rmse_of(a).value,
                     rmse_of(b).value, std::sqrt(reference_variance));
}

// --- 6: errors -------------------------------------------------------------------------------------------------

// Table 1 of the paper: Sponza stands for colonnade.
struct PeerRow {
  const char* scene;
  bool diffuse;
  double sst_rmse, slc_rmse, sst_ssim, slc_ssim;
};
constexpr PeerRow kPeerRows[] = {{"colonnade", true, 17, 17, .971, .967},
                                 {"living-room", true, 26, 33, .960, .956},
                                 {"colonnade", false, 17, 17, .970, .967},
                                 {"living-room", false, 40, 47, .946, .940}};

void report_errors(const PeerRow& row, const ImageErrors& sst, const ImageErrors& slc, int spp,
                   const Reference& reference, const Report& report) {
  const std::string where = fmt::format("{}, {} spp", row.diffuse ? "diffuse" : "glossy", spp);
  const Estimate ratio = rmse_ratio(sst.squared, slc.squared), ssim = mean_difference(sst.ssim, slc.ssim);
  const Estimate indirect = rmse_ratio(sst.squared_indirect, slc.squared_indirect);
  report({6,
          row.scene,
          "RMSE sst / slc, " + where,
          fmt::format("{:.2f}", row.sst_rmse / row.slc_rmse),
          ratio.value,
          ratio.error,
          {},
          1,
          rmse_note(sst.squared, slc.squared, reference.beauty_variance)});
  report({6,
          row.scene,
          "the same, indirect light alone",
          "",
          indirect.value,
          indirect.error,
          {},
          1,
          rmse_note(sst.squared_indirect, slc.squared_indirect, reference.indirect_variance)});
  report({6,
          row.scene,
          "SSIM sst - slc, " + where,
          fmt::format("{:+.3f}", row.sst_ssim - row.slc_ssim),
          ssim.value,
          ssim.error,
          0,
          {},
          fmt::format("SSIM {:.4f} and {:.4f}", mean_of(sst.ssim).value, mean_of(slc.ssim).value)});
}

void report_peer_errors(const PeerRow& row, const Report& report) {
  ErrorStudy& study = ErrorStudy::of(row.scene, row.diffuse);
  const MethodErrors& sst = study.errors("sst", sst_settings(row.diffuse));
  const MethodErrors& slc = study.errors("slc", slc_settings(row.diffuse));
  report_errors(row, sst.one, slc.one, 1, study.reference(), report);
  report_errors(row, sst.group, slc.group, kGroupSpp, study.reference(), report);
}

// --- 6: times and steps ----------------------------------------------------------------------------------------

struct GrowthRow {
  const char* scene;
  double sst_ms[4], slc_ms[4];  // published
};
constexpr int kGrowthVpls[] = {10000, 100000, 500000, 1000000};
constexpr GrowthRow kGrowthRows[] = {{"colonnade", {2.77, 3.36, 3.78, 3.92}, {2.74, 4.54, 6.12, 7.00}},
                                     {"living-room", {2.27, 2.88, 3.36, 3.73}, {2.17, 4.34, 6.63, 8.04}}};
constexpr double kTie = 0.12;  // how far from 1 a ratio counts as a tie

struct SamplingTimes {
  double sst_ms, slc_ms;
  double vpls;
};

SamplingTimes sampling_times(const char* scene, int vpls) {
  Settings sst = sized(sst_settings(true), kTimeWidth, kTimeHeight),
           slc = sized(slc_settings(true), kTimeWidth, kTimeHeight);
  sst.indirect.vpls = slc.indirect.vpls = vpls;
  Study study(scene, sst);
  study.trace(sst);
  std::vector<double> sst_ms, slc_ms;
  sampling_ms(study, sst);
  for (int run = 0; run < kTimeRuns; ++run) {
    sst_ms.push_back(sampling_ms(study, sst));
    slc_ms.push_back(sampling_ms(study, slc));
  }
  return {median(sst_ms), median(slc_ms), static_cast<double>(study.world->vpls.view().vpls.size())};
}

void report_times(const GrowthRow& row, const Report& report) {
  std::vector<SamplingTimes> times;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < std::size(kGrowthVpls); ++i) {
    times.push_back(sampling_times(row.scene, kGrowthVpls[i]));
    const SamplingTimes& t = times.back();
    ratios.push_back(t.slc_ms / t.sst_ms);
    const bool tie = i == 0;
    report({6, row.scene, fmt::format("sampling time slc / sst, {} VPLs", kGrowthVpls[i]),
            fmt::format("{:.2f}", row.slc_ms[i] / row.sst_ms[i]), ratios.back(), 0, tie ? 1 - kTie : 1,
            tie ? std::optional(1 + kTie) : std::nullopt,
            fmt::format("sst {:.1f} ms, slc {:.1f} ms at {}x{}; {} VPLs", t.sst_ms, t.slc_ms, kTimeWidth, kTimeHeight,
                        t.vpls)});
  }
  report({6, row.scene, "that ratio, 1 M / 10 k VPLs", "above 1", ratios.back() / ratios.front(), 0, 1, {}});
  const double sst = row.sst_ms[3] / row.sst_ms[0], slc = row.slc_ms[3] / row.slc_ms[0];
  report({6,
          row.scene,
          "sampling time of sst, 1 M / 10 k VPLs",
          fmt::format("{:.1f}", sst),
          times.back().sst_ms / times.front().sst_ms,
          0,
          {},
          sst});
  report({6,
          row.scene,
          "sampling time of slc, 1 M / 10 k VPLs",
          fmt::format("{:.1f}", slc),
          times.back().slc_ms / times.front().slc_ms,
          0,
          {},
          slc});
}

void report_steps(const char* scene, const Report& report) {
  const Settings settings = sized(sst_settings(true), kErrorWidth, kErrorHeight);
  Study study(scene, settings);
  study.trace(settings);
  const SeenImage seen(*study.world, settings);
  const auto walks = [&](const Settings& method) {
    return trace_walks(make_indirect_lighting(*study.world, method, 0), seen);
  };
  const std::vector<VplTrace> sst = walks(settings), slc = walks(sized(slc_settings(true), kErrorWidth, kErrorHeight));
  report({6,
          scene,
          "mean steps of a walk, sst / slc, 100 k VPLs",
          "15/20 = 0.75",
          mean_steps(sst) / mean_steps(slc),
          0,
          {},
          15.0 / 20,
          fmt::format("{:.2f} and {:.2f}; of the longest of {} walks side by side {:.2f} and {:.2f}", mean_steps(sst),
                      mean_steps(slc), kWalkLanes, mean_longest_steps(sst), mean_longest_steps(slc))});
}

// --- 7: paths ----------------------------------------------------------------------------------------------------

struct PathRow {
  const char* scene;
  double sst_rmse, sst_ms, rmse[3], ms[3];  // of paths of 1, 2 and 3 bounces
};
constexpr PathRow kPathRows[] = {{"colonnade", 17, 3.36, {29, 15, 12}, {2.75, 5.45, 8.10}},
                                 {"living-room", 26, 2.88, {70, 39, 24}, {1.78, 3.33, 4.76}}};

// Paths of 1 bounce are worse, of 3 bounces as good.
Relation path_error(const PathRow& row, int bounces, int spp, const ImageErrors& path, const ImageErrors& sst,
                    const Reference& reference) {
  const Estimate ratio = rmse_ratio(path.squared, sst.squared);
  Relation relation{7,
                    row.scene,
                    fmt::format("RMSE path, {} bounce{} / sst, {} spp", bounces, bounces > 1 ? "s" : "", spp),
                    fmt::format("{:.2f}", row.rmse[bounces - 1] / row.sst_rmse),
                    ratio.value,
                    ratio.error};
  if (bounces == 1) relation.at_least = 1;
  if (bounces == 3) relation.at_most = 1;
  const Estimate indirect = rmse_ratio(path.squared_indirect, sst.squared_indirect);
  relation.note =
      fmt::format("{}; of indirect light alone {:.4g} and {:.4g}, ratio {:.3f} +- {:.3f}",
                  rmse_note(path.squared, sst.squared, reference.beauty_variance), rmse_of(path.squared_indirect).value,
                  rmse_of(sst.squared_indirect).value, indirect.value, indirect.error);
  return relation;
}

void report_path_errors(const PathRow& row, const Report& report) {
  ErrorStudy& study = ErrorStudy::of(row.scene, true);
  const MethodErrors& sst = study.errors("sst", sst_settings(true));
  for (int bounces = 1; bounces <= 3; ++bounces) {
    const MethodErrors& path = study.errors(fmt::format("path {}", bounces), path_settings(true, bounces));
    report(path_error(row, bounces, 1, path.one, sst.one, study.reference()));
    report(path_error(row, bounces, kGroupSpp, path.group, sst.group, study.reference()));
  }
}

void report_path_times(const PathRow& row, const Report& report) {
  const Settings sst = sized(sst_settings(true), kTimeWidth, kTimeHeight);
  Study sst_study(row.scene, sst), path_study(row.scene, sized(path_settings(true, 1), kTimeWidth, kTimeHeight));
  std::vector<double> sampling, frame, path_sampling[3], path_frame[3];
  for (int run = 0; run < kTimeRuns; ++run) {
    frame.push_back(time_ms([&] {
      sst_study.trace(sst);
      sampling.push_back(sampling_ms(sst_study, sst));
    }));
    for (int k = 0; k < 3; ++k) {
      const Settings path = sized(path_settings(true, k + 1), kTimeWidth, kTimeHeight);
      path_frame[k].push_back(time_ms([&] { path_sampling[k].push_back(path_ms(path_study, path)); }));
    }
  }
  for (int k = 0; k < 3; ++k) {
    Relation relation{7, row.scene,
                      fmt::format("time of indirect light, path, {} bounce{} / sst", k + 1, k > 0 ? "s" : ""),
                      fmt::format("{:.2f}", row.ms[k] / row.sst_ms), median(path_sampling[k]) / median(sampling)};
    if (k == 2) relation.at_least = 1;
    relation.note = fmt::format("{:.1f} ms and {:.1f} ms; whole frames {:.1f} ms and {:.1f} ms (ratio {:.2f})",
                                median(path_sampling[k]), median(sampling), median(path_frame[k]), median(frame),
                                median(path_frame[k]) / median(frame));
    report(relation);
  }
}

}  // namespace

void check_peers(const Report& report) {
  for (const PeerRow& row : kPeerRows) report_peer_errors(row, report);
  for (const char* scene : kStudyScenes) report_steps(scene, report);
  for (const GrowthRow& row : kGrowthRows) report_times(row, report);
}

void check_paths(const Report& report) {
  for (const PathRow& row : kPathRows) {
    report_path_errors(row, report);
    report_path_times(row, report);
  }
}

}  // namespace lumigrove::bench
