// The presets rtslc and pool of the program against its preset tree: not in the paper of real-time stochastic lightcuts.
#include <array>
#include <cmath>

#include "bench.h"
#include "rtslc_checks.h"
#include "rtslc_study.h"

namespace lumigrove::bench {
namespace {

constexpr int kPresetImages = 24;
// The middle of the image: of whole camera samples.
constexpr std::array<int, 4> kWindow = {320, 960, 180, 540};

constexpr std::array<const char*, 2> kPresets = {"rtslc", "pool"};

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
  std::vector<Entry> entries = {{preset_method("tree"), spp}};
  for (const char* preset : kPresets) entries.push_back({preset_method(preset), spp});
  const std::vector<Measured> all = SubjectStudy::of(subject).measure(entries, kPresetImages);
  const Measured& tree = all[0];
  for (std::size_t k = 1; k < all.size(); ++k) {
    const Measured& ours = all[k];
    const std::string& name = ours.entry.method.name;
    const std::string what = fmt::format("equal time of sampling, {} spp each: RMSE {} / tree", spp, name);
    const std::string& missing = ours.ok() ? tree.missing : ours.missing;
    if (!missing.empty()) {
      report(missing_relation(0, subject.scene, what, "", missing));
      continue;
    }
    const Estimate ratio = root(equal_time_ratio(ours, tree)), samples = root(mse_ratio(ours, tree));
    report({0,
            subject.scene,
            what,
            "",
            ratio.value,
            ratio.error,
            {},
            1,
            fmt::format("{}: {}; tree: {}; RMSE at equal samples {:.3f} +- {:.3f}, time {:.3f}", name,
                        measured_text(ours), measured_text(tree), samples.value, samples.error,
                        ours.ms_median() / tree.ms_median())});
  }
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

void report_presets(const Subject& subject, const std::string& preset, const Report& report) {
  constexpr int kRounds = 6, kTreePairs = 4;
  const std::string what = fmt::format("equal time of whole camera samples: RMSE {} / tree", preset);
  if (const std::string missing = why_missing(subject, preset_method(preset), 1); !missing.empty()) {
    report(missing_relation(0, subject.scene, what, "", missing));
    return;
  }
  const Scene& scene = SubjectStudy::of(subject).scene();
  Frames ours(scene, whole_settings(subject, preset)), tree(scene, whole_settings(subject, "tree"));
  for (int round = 0; round < kRounds; ++round) {
    ours.pair();
    for (int i = 0; i < kTreePairs; ++i) tree.pair();
  }
  const Estimate a = ours.variance(), b = tree.variance();
  const double square = a.value * ours.ms() / (b.value * tree.ms());
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
           "{} {:.0f} ms, variance {:.4g}; tree {:.0f} ms, variance {:.4g}; {}x{} pixels, jittered, {} light", preset,
           ours.ms(), a.value, tree.ms(), b.value, kWindow[1] - kWindow[0], kWindow[3] - kWindow[2],
           subject.vpls ? "indirect" : "direct")});
}

}  // namespace

void check_presets(const Report& report) {
  for (const Subject& subject : kSubjects) {
    report_equal_samples(subject, report);
    for (const char* preset : kPresets) report_presets(subject, preset, report);
  }
}

}  // namespace lumigrove::bench
