// The presets rtslc and tree of the program against each other: not in the paper of real-time stochastic lightcuts.
#include <array>
#include <cmath>

#include "bench.h"
#include "rtslc_checks.h"
#include "rtslc_study.h"

namespace lumigrove::bench {
namespace {

constexpr int kImages = 24;
// The middle of the image: of whole camera samples.
constexpr std::array<int, 4> kWindow = {320, 960, 180, 540};

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
      : settings_(settings), film_(settings.width, settings.height) {
    RenderStats stats;
    world_ = make_world(scene, settings_, stats);
    trace_vpls(*world_, settings_, 0, stats);
    render();
    ms_.clear();
  }

  // Two images.
  void pair() {
    render();
    const std::vector<vec3> before = light();
    render();
    const std::vector<vec3> after = light();
    double sum = 0;
    for (std::size_t i = 0; i < after.size(); ++i)
      sum += static_cast<double>(length_squared(after[i] - before[i]));
    variances_.push_back(sum / (2 * 3 * static_cast<double>(after.size())));
  }

  double ms() const { return median(ms_); }
  Estimate variance() const { return mean_of(variances_); }

 private:
  // Of the pixels of the window.
  std::vector<vec3> light() const {
    const auto [x0, x1, y0, y1] = kWindow;
    std::vector<vec3> light;
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) {
        const FilmPixel& pixel =
            film_.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(film_.width) +
                         static_cast<std::size_t>(x)];
        light.push_back(settings_.indirect.transport == Transport::kVpl ? pixel.indirect : pixel.direct);
      }
    return light;
  }

  void render() {
    ++settings_.seed;
    RenderStats stats;
    ms_.push_back(time_ms([&] { render_sample(*world_, settings_, 0, film_, stats); }));
  }

  Settings settings_;
  std::unique_ptr<World> world_;
  Film film_;
  std::vector<double> ms_, variances_;
};

Settings whole_settings(const Subject& subject, const std::string& preset) {
  Settings settings = sized(make_preset(preset), kImageWidth, kImageHeight);
  if (subject.vpls) {
    settings = subject_settings(subject, preset_method(preset), settings.direct.spp);
    settings.jitter = true;
    settings.indirect.vpls = SubjectStudy::of(subject).vpls_asked();
  }
  settings.pixel_bounds = kWindow;
  return settings;
}

void report_presets(const Subject& subject, const Report& report) {
  constexpr int kRounds = 6, kTreePairs = 4;
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
  report(
      {0,
       subject.scene,
       what,
       "",
       ratio.value,
       ratio.error,
       {},
       1,
       fmt::format(
           "rtslc {:.0f} ms, variance {:.4g}; tree {:.0f} ms, variance {:.4g}; {}x{} pixels, jittered, {} light",
           rtslc.ms(), a.value, tree.ms(), b.value, kWindow[1] - kWindow[0], kWindow[3] - kWindow[2],
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
