#include "study.h"

#include <cmath>
#include <string_view>

#include "device/device.h"

namespace lumigrove::bench {
namespace {

void add_values(const RgbImage& image, std::vector<double>& sum) {
  sum.resize(image.rgb.size());
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += static_cast<double>(image.rgb[i]);
}

RgbImage divided(const std::vector<double>& sum, int count, RgbImage like) {
  for (std::size_t i = 0; i < sum.size(); ++i) like.rgb[i] = static_cast<float>(sum[i] / count);
  return like;
}

}  // namespace

// --- means ---------------------------------------------------------------------------------------------------

Estimate Mean::estimate() const { return {mean_, count_ > 1 ? std::sqrt(variance() / count_) : 0}; }

Estimate ratio_of_means(std::span<const double> a, std::span<const double> b) {
  Mean mean_a, mean_b, residual;
  for (const double x : a) mean_a.add(x);
  for (const double x : b) mean_b.add(x);
  const double ratio = mean_a.mean() / mean_b.mean();
  for (std::size_t i = 0; i < a.size(); ++i) residual.add(a[i] - ratio * b[i]);  // linearised about the means
  return {ratio, residual.estimate().error / mean_b.mean()};
}

Estimate root(Estimate square) {
  const double value = std::sqrt(square.value);
  return {value, square.error / (2 * value)};
}

Estimate mean_of(std::span<const double> values) {
  Mean mean;
  for (const double value : values) mean.add(value);
  return mean.estimate();
}

Estimate mean_difference(std::span<const double> a, std::span<const double> b) {
  Mean mean;
  for (std::size_t i = 0; i < a.size(); ++i) mean.add(a[i] - b[i]);
  return mean.estimate();
}

void add_to(std::vector<Mean>& values, const RgbImage& image) {
  values.resize(image.rgb.size());
  launch(static_cast<int>(values.size()), [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    values[i].add(static_cast<double>(image.rgb[i]));
  });
}

double mean_variance(const std::vector<Mean>& values) {
  double sum = 0;
  for (const Mean& value : values) sum += value.estimate().error * value.estimate().error;
  return sum / static_cast<double>(values.size());
}

// --- a scene -------------------------------------------------------------------------------------------------

Study::Study(Scene study_scene, const Settings& settings) : scene(std::move(study_scene)) {
  RenderStats stats;
  world = make_world(scene, settings, stats);
}

void Study::trace(const Settings& settings) {
  RenderStats stats;
  trace_vpls(*world, settings, 0, stats);
}

void Study::build_substitutes(float min_nu, float max_sigma) {
  const VplView vpls = world->vpls.view();
  world->substitutes.build(vpls, {Topology::kRadix, min_nu, max_sigma * vpls.diagonal, kInfinity});
}

SampleImage layers_of(const Film& film, int samples) {
  const Image image = develop(film, samples);
  return {rgb_of(image, "", "render"), rgb_of(image, "indirect", "render")};
}

SampleImage render_one(const Study& study, const Settings& settings) {
  RenderStats stats;
  Film film(settings.width, settings.height);
  render_sample(*study.world, settings, 0, film, stats);
  return layers_of(film, 1);
}

void ImageMean::add(const SampleImage& image) {
  ++count_;
  add_values(image.beauty, beauty_);
  add_values(image.indirect, indirect_);
  last_ = image;
}

SampleImage ImageMean::mean() const {
  return {divided(beauty_, count_, last_.beauty), divided(indirect_, count_, last_.indirect)};
}

double mean_value(const RgbImage& image) {
  double sum = 0;
  for (const float value : image.rgb) sum += static_cast<double>(value);
  return sum / static_cast<double>(image.rgb.size());
}

double tone_mapped_ssim(const RgbImage& reference, const RgbImage& test, const ToneMap& tone) {
  const auto encoded = [&](RgbImage image) {
    image.rgb = tone_map(image.rgb, tone);
    return image;
  };
  return ssim(encoded(reference), encoded(test));
}

// --- time ------------------------------------------------------------------------------------------------------

double pass_ms(const Study& study, const Settings& settings, std::initializer_list<const char*> passes) {
  RenderStats stats;
  Film film(settings.width, settings.height);
  render_sample(*study.world, settings, 0, film, stats);
  double ms = 0;
  for (const PassStats& pass : stats.passes)
    for (const std::string_view name : passes) ms += pass.name == name ? pass.ms : 0;
  return ms;
}

}  // namespace lumigrove::bench
