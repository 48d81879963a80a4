// The presets rtslc and tree of the program against each other: not in the paper of real-time stochastic lightcuts.
#include <cmath>

#include "bench.h"
#include "rtslc_checks.h"
#include "rtslc_study.h"

namespace lumigrove::bench {
namespace {

constexpr int kImages = 12;

// What a preset says of direct light; of virtual point lights it is said too.
Method preset_method(const std::string& name) {
  Method method{name, {{"width", "16"}, {"cones", "true"}}};
  const std::string group = "direct.";
  for (const PresetInfo& preset : presets())
    if (preset.name == name)
      for (const auto& [key, value] : preset.values)
        if (key.starts_with(group)) method.values.emplace_back(key.substr(group.size()), value);
  return method;
}

// --- light samples alone -----------------------------------------------------------------------------------------

void report_equal_samples(const Subject& subject, const Report& report) {
  const int spp = make_preset("rtslc").direct.spp;
  const std::vector<Measured> all = SubjectStudy::of(subject).measure(
      {{preset_method("rtslc"), spp}, {preset_method("tree"), spp}}, kImages);
  const Measured &rtslc = all[0], &tree = all[1];
  const std::string what = fmt::format("equal time of sampling, {} spp each: RMSE rtslc / tree", spp);
  for (const Measured* side : {&rtslc, &tree})
    if (!side->ok()) {
      report(missing_relation(0, subject.scene, what, "", side->missing));
      return;
    }
  const Estimate ratio = root(equal_time_ratio(rtslc, tree)), samples = root(mse_ratio(rtslc, tree));
  report({0,
          subject.scene,
          what,
          "",
          ratio.value,
          ratio.error,
          {},
          1,
          fmt::format("rtslc: {}; tree: {}; RMSE at equal samples {:.3f} +- {:.3f}, time {:.3f}",
                      measured_text(rtslc), measured_text(tree), samples.value, samples.error,
                      rtslc.ms_median() / tree.ms_median())});
}

// --- whole camera samples ----------------------------------------------------------------------------------------

// Images of one camera sample a pixel: half the mean squared difference of two is the variance of one.
class Frames {
 public:
  Frames(const Scene& scene, const Settings& settings)
      : settings_(settings), film_(settings.width, settings.height), before_(film_.pixels.size()) {
    RenderStats stats;
    world_ = make_world(scene, settings_, stats);
    trace_vpls(*world_, settings_, 0, stats);
    render();
    ms_.clear();
  }

  // Two images.
  void pair() {
    render();
    for (std::size_t i = 0; i < before_.size(); ++i) before_[i] = light(i);
    render();
    double sum = 0;
    for (std::size_t i = 0; i < before_.size(); ++i)
      sum += static_cast<double>(length_squared(light(i) - before_[i]));
    variances_.push_back(sum / (2 * 3 * static_cast<double>(before_.size())));
  }

  double ms() const { return median(ms_); }
  Estimate variance() const { return mean_of(variances_); }

 private:
  vec3 light(std::size_t i) const {
    const FilmPixel& pixel = film_.pixels[i];
    return settings_.indirect.transport == Transport::kVpl ? pixel.indirect : pixel.direct;
  }

  void render() {
    ++settings_.seed;
    RenderStats stats;
    ms_.push_back(time_ms([&] { render_sample(*world_, settings_, 0, film_, stats); }));
  }

  Settings settings_;
  std::unique_ptr<World> world_;
  Film film_;
  std::vector<vec3> before_;
  std::vector<double> ms_, variances_;
};

Settings whole_settings(const Subject& subject, const std::string& preset) {
  Settings settings = sized(make_preset(preset), kImageWidth, kImageHeight);
  if (subject.vpls) {
    settings = subject_settings(subject, preset_method(preset), settings.direct.spp);
    settings.jitter = true;
    settings.indirect.vpls = SubjectStudy::of(subject).vpls_asked();
  }
  return settings;
}

void report_presets(const Subject& subject, const Report& report) {
  constexpr int kRounds = 3, kTreePairs = 3;
  const std::string what = "equal time of whole camera samples: RMSE rtslc / tree";
  if (const std::string missing = why_missing(subject, preset_method("rtslc"), 1); !missing.empty()) {
    report(missing_relation(0, subject.scene, what, "", missing));
    return;
  }
  const Scene& scene = SubjectStudy::of(subject).scene();
  Frames rtslc(scene, whole_settings(subject, "rtslc")), tree(scene, whole_settings(subject, "tree"));
  for (int round = 0; round < kRounds; ++round) {
    rtslc.pair();
    for (int i = 0; i < kTreePairs; ++i) tree.pair();
  }
  const Estimate a = rtslc.variance(), b = tree.variance();
  const double square = a.value * rtslc.ms() / (b.value * tree.ms());
  const Estimate ratio = root({square, square * std::hypot(a.error / a.value, b.error / b.value)});
  report({0,
          subject.scene,
          what,
          "",
          ratio.value,
          ratio.error,
          {},
          1,
          fmt::format(
              "rtslc {:.0f} ms, variance {:.4g}; tree {:.0f} ms, variance {:.4g}; {}x{}, jittered, {} light",
              rtslc.ms(), a.value, tree.ms(), b.value, kImageWidth, kImageHeight,
              subject.vpls ? "indirect" : "direct")});
}

}  // namespace

void check_presets(const Report& report) {
  for (const Subject& subject : kSubjects) {
    report_equal_samples(subject, report);
    report_presets(subject, report);
  }
}

}  // namespace lumigrove::bench
