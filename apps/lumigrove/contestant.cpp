#include "contestant.h"

#include <algorithm>

#include "base/stopwatch.h"
#include "device/device.h"

namespace lumigrove {
namespace {

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

template <class Get>
RgbImage rgb_image(const Film& film, const Get& get) {
  RgbImage image{film.width, film.height, std::vector<float>(film.pixels.size() * 3), ""};
  launch(
      static_cast<int>(film.pixels.size()),
      [&](int i) {
        const vec3 value = get(film.pixels[static_cast<std::size_t>(i)]);
        for (int c = 0; c < 3; ++c) image.rgb[static_cast<std::size_t>(3 * i + c)] = value[c];
      },
      8192);
  return image;
}

}  // namespace

Contestant::Contestant(const Scene& scene, std::shared_ptr<Geometry> geometry, const Settings& settings)
    : settings_(settings) {
  check(settings_);
  RenderStats untimed;
  world_ = make_world(scene, std::move(geometry), settings_, untimed);
}

double Contestant::time_small_sample(int divisor) {
  Settings small = settings_;
  small.width = std::max(1, settings_.width / divisor);
  small.height = std::max(1, settings_.height / divisor);
  Film film(small.width, small.height);
  RenderStats untimed;
  const Stopwatch watch;
  trace_vpls(*world_, small, 0, untimed);
  render_sample(*world_, small, 0, film, untimed);
  return watch.ms() * 1e-3;
}

// Part of a sample's time goes with the pixels, part does not (virtual point lights and their tree).
double Contestant::predict_sample_s() {
  constexpr int kSmall = 32, kLarger = 8, kAbsurd = 600;  // the last in seconds
  const double small = time_small_sample(kSmall);
  const double worst = small * kSmall * kSmall;
  if (worst > 4 * kAbsurd) return worst;  // the larger one would already take minutes
  const double larger = time_small_sample(kLarger);
  constexpr double kSmallShare = 1.0 / (kSmall * kSmall), kLargerShare = 1.0 / (kLarger * kLarger);
  const double a_pixel = std::max(0.0, (larger - small) / (kLargerShare - kSmallShare));
  return std::max(larger, larger + a_pixel * (1 - kLargerShare));
}

void Contestant::begin(std::uint32_t seed) {
  settings_.seed = seed;
  film_ = std::make_unique<Film>(settings_.width, settings_.height);
  stats_ = {};
  spp_ = 0;
  samples_s_ = 0;
  sample_s_.clear();
  const Stopwatch watch;
  build_lights(*world_, settings_, stats_);
  build_s_ = watch.ms() * 1e-3;
}

void Contestant::sample() {
  const Stopwatch watch;
  trace_vpls(*world_, settings_, spp_, stats_);
  render_sample(*world_, settings_, spp_, *film_, stats_);
  sample_s_.push_back(watch.ms() * 1e-3);
  samples_s_ += sample_s_.back();
  ++spp_;
}

double Contestant::median_sample_s() const { return quantile(sample_s_, 0.5); }

double Contestant::rays() const {
  double rays = 0;
  for (const PassStats& pass : stats_.passes) rays += static_cast<double>(pass.rays);
  return rays;
}

RgbImage Contestant::image(const std::string& light) const {
  if (light == kAllLight) return rgb_image(*film_, [](const FilmPixel& p) { return p.direct + p.indirect; });
  if (light == kDirectLight) return part(&FilmPixel::direct);
  return rgb_of(develop(*film_, spp_), light, settings_.preset);
}

RgbImage Contestant::part(vec3 FilmPixel::*light) const {
  return rgb_image(*film_, [=](const FilmPixel& p) { return p.*light; });
}

void Contestant::describe(Run& run) const {
  run.build_ms = build_s_ * 1e3;
  run.sample_ms = quantile(sample_s_, 0.5) * 1e3;
  run.sample_low_ms = quantile(sample_s_, 0.25) * 1e3;
  run.sample_high_ms = quantile(sample_s_, 0.75) * 1e3;
  run.passes.clear();
  for (const PassStats& pass : stats_.passes)
    run.passes.push_back({pass.name, pass.ms / spp_, static_cast<double>(pass.rays) / spp_});
  run.structures.clear();
  for (const StructureStats& structure : stats_.structures)
    run.structures.push_back({structure.name, structure.build_ms, static_cast<double>(structure.bytes)});
}

}  // namespace lumigrove
