#include "metrics/metrics.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "base/vec.h"
#include "device/reduce.h"
#include "metrics/check.h"

namespace lumigrove {
namespace {

int size_of(const RgbImage& image) { return static_cast<int>(image.rgb.size()); }

// Mean of term(reference value, test value) over pixels and channels.
template <class Term>
double mean_error(const RgbImage& reference, const RgbImage& test, const Term& term) {
  const auto value = [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    return term(static_cast<double>(reference.rgb[at]), static_cast<double>(test.rgb[at]));
  };
  return reduce(size_of(reference), 0.0, value, std::plus<>()) / size_of(reference);
}

bool pixel_is_finite(const RgbImage& image, std::size_t pixel) {
  const float* rgb = image.rgb.data() + 3 * pixel;
  return is_finite(rgb[0]) && is_finite(rgb[1]) && is_finite(rgb[2]);
}

void check_finite(const RgbImage& image) {
  const std::size_t pixels = image.rgb.size() / 3, width = static_cast<std::size_t>(image.width);
  std::size_t bad = 0, first = 0;
  for (std::size_t p = 0; p < pixels; ++p)
    if (!pixel_is_finite(image, p) && bad++ == 0) first = p;
  if (bad > 0)
    throw Error(fmt::format("{}: {} of {} pixels are not finite, the first at ({}, {}); no metric is defined",
                            image.name, bad, pixels, first % width, first / width));
}

void check_shape(const RgbImage& image) {
  const bool positive = image.width > 0 && image.height > 0;
  if (!positive ||
      image.rgb.size() != 3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height))
    throw Error(fmt::format("{}: {}x{} pixels with {} values are not an RGB image", image.name, image.width,
                            image.height, image.rgb.size()));
}

}  // namespace

void check_pair(const RgbImage& reference, const RgbImage& test) {
  check_shape(reference);
  check_shape(test);
  if (reference.width != test.width || reference.height != test.height)
    throw Error(fmt::format("{} has {}x{} pixels but the reference {} has {}x{}", test.name, test.width,
                            test.height, reference.name, reference.width, reference.height));
  check_finite(reference);
  check_finite(test);
}

RgbImage rgb_of(const Image& image, const std::string& layer, const std::string& name) {
  const Layer* found = image.find(layer);
  const std::size_t channels = found ? found->channels.size() : 0;
  const bool colored = channels >= 3 && !found->values.empty() && found->channels[0] == "R" &&
                       found->channels[1] == "G" && found->channels[2] == "B";
  if (!colored)
    throw Error(layer.empty()
                    ? fmt::format("{}: it has no channels R, G and B", name)
                    : fmt::format("{}: it has no channels {}.R, {}.G and {}.B", name, layer, layer, layer));
  RgbImage result{image.width, image.height, {}, name};
  result.rgb.reserve(found->values.size() / channels * 3);
  for (std::size_t at = 0; at < found->values.size(); at += channels)
    result.rgb.insert(result.rgb.end(), {found->values[at], found->values[at + 1], found->values[at + 2]});
  return result;
}

double rmse(const RgbImage& reference, const RgbImage& test) {
  check_pair(reference, test);
  return std::sqrt(mean_error(reference, test, [](double r, double t) { return (t - r) * (t - r); }));
}

double rel_mse(const RgbImage& reference, const RgbImage& test) {
  check_pair(reference, test);
  return mean_error(reference, test,
                    [](double r, double t) { return (t - r) * (t - r) / (r * r + kRelMseEpsilon); });
}

const std::vector<MetricInfo>& metrics() {
  static const std::vector<MetricInfo> table = {
      {Metric::kRmse, "rmse", "RMSE", "sqrt(mean((a-r)^2)) over pixels and channels, linear RGB", true},
      {Metric::kRelMse, "relmse", "relMSE", "mean((a-r)^2/(r^2+0.01)) over pixels and channels, linear RGB",
       true},
      {Metric::kSsim, "ssim", "SSIM",
       "mean((2 ma mr+1e-4)(2 sar+9e-4)/((ma^2+mr^2+1e-4)(sa^2+sr^2+9e-4))), 11x11 Gaussian, sigma 1.5, "
       "tone-mapped "
       "sRGB (Wang et al. 2004)",
       false},
      {Metric::kFlip, "flip", "FLIP", "mean(dEc^(1-dEf)), tone-mapped sRGB (LDR-FLIP, Andersson et al. 2020)",
       true},
  };
  return table;
}

double Comparison::value(Metric metric) const {
  switch (metric) {
    case Metric::kRmse:
      return rmse;
    case Metric::kRelMse:
      return rel_mse;
    case Metric::kSsim:
      return ssim;
    case Metric::kFlip:
      return flip;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

Comparison compare_images(const RgbImage& reference, const RgbImage& test, const MetricSettings& settings) {
  Comparison result;
  result.rmse = rmse(reference, test);
  result.rel_mse = rel_mse(reference, test);
  const RgbImage shown_reference{reference.width, reference.height, tone_map(reference.rgb, settings.tone),
                                 reference.name};
  const RgbImage shown_test{test.width, test.height, tone_map(test.rgb, settings.tone), test.name};
  const bool window_fits = std::min(test.width, test.height) >= kSsimWindow;
  result.ssim = window_fits ? ssim(shown_reference, shown_test) : std::numeric_limits<double>::quiet_NaN();
  result.flip_map = flip_map(shown_reference, shown_test, settings.pixels_per_degree);
  const double sum = std::accumulate(result.flip_map.begin(), result.flip_map.end(), 0.0);
  result.flip = sum / static_cast<double>(result.flip_map.size());
  return result;
}

}  // namespace lumigrove
