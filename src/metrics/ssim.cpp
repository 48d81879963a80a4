// Structural similarity: Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image Quality Assessment:
// From Error Visibility to Structural Similarity", IEEE Transactions on Image Processing 13(4), 2004,
// equation 13 with C1 = (K1 L)^2, C2 = (K2 L)^2. The paper filters gray images; here each sRGB-encoded
// channel is filtered and the mean over the three is taken. Pixels nearer to the border than half a window
// are left out.
#include <fmt/format.h>

#include "device/reduce.h"
#include "metrics/check.h"
#include "metrics/plane.h"

namespace lumigrove {
namespace {

constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;
constexpr double kSigma = 1.5;

// Window mean of product(i) around every pixel i. In double: variances are small differences of large means.
template <class Product>
DoublePlane window_mean(int width, int height, const std::vector<double>& window, const Product& product) {
  DoublePlane plane(width, height);
  launch(plane.size(),
         [&](int i) { plane.values[static_cast<std::size_t>(i)] = product(static_cast<std::size_t>(i)); });
  return filter_separable(plane, window, window);
}

double channel_ssim(const RgbImage& reference, const RgbImage& test, std::size_t channel) {
  const int width = test.width, height = test.height;
  const std::vector<double> window = normalized<double>(gaussian(kSigma, kSsimWindow / 2));
  const auto r = [&](std::size_t i) { return double{reference.rgb[3 * i + channel]}; };
  const auto t = [&](std::size_t i) { return double{test.rgb[3 * i + channel]}; };
  const DoublePlane mean_r = window_mean(width, height, window, r),
                    mean_t = window_mean(width, height, window, t);
  const DoublePlane rr = window_mean(width, height, window, [&](std::size_t i) { return r(i) * r(i); });
  const DoublePlane tt = window_mean(width, height, window, [&](std::size_t i) { return t(i) * t(i); });
  const DoublePlane rt = window_mean(width, height, window, [&](std::size_t i) { return r(i) * t(i); });

  const int border = kSsimWindow / 2, inner_width = width - 2 * border, inner_height = height - 2 * border;
  const auto similarity = [&](int inner) {
    const auto i = static_cast<std::size_t>(inner / inner_width + border) * static_cast<std::size_t>(width) +
                   static_cast<std::size_t>(inner % inner_width + border);
    const double mr = mean_r.values[i], mt = mean_t.values[i];
    const double variance_r = rr.values[i] - mr * mr, variance_t = tt.values[i] - mt * mt;
    const double covariance = rt.values[i] - mr * mt;
    return (2 * mr * mt + kC1) * (2 * covariance + kC2) /
           ((mr * mr + mt * mt + kC1) * (variance_r + variance_t + kC2));
  };
  const int inner_pixels = inner_width * inner_height;
  return reduce(inner_pixels, 0.0, similarity, std::plus<>()) / inner_pixels;
}

}  // namespace

double ssim(const RgbImage& reference, const RgbImage& test) {
  check_pair(reference, test);
  if (std::min(test.width, test.height) < kSsimWindow)
    throw Error(fmt::format("{}: SSIM needs at least {}x{} pixels, not {}x{}", test.name, kSsimWindow,
                            kSsimWindow, test.width, test.height));
  double sum = 0;
  for (std::size_t channel = 0; channel < 3; ++channel) sum += channel_ssim(reference, test, channel);
  return sum / 3;
}

}  // namespace lumigrove
