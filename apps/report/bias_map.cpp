#include "bias_map.h"

#include <algorithm>
#include <cmath>

#include "base/vec.h"
#include "summary.h"

namespace lumigrove {
namespace {

double block_mean(const RgbImage& image, int column, int row) {
  double sum = 0;
  int count = 0;
  for (int y = row * kBiasBlock; y < std::min((row + 1) * kBiasBlock, image.height); ++y)
    for (int x = column * kBiasBlock; x < std::min((column + 1) * kBiasBlock, image.width); ++x, ++count) {
      const float* rgb = image.rgb.data() + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + x);
      sum += luminance(vec3(rgb[0], rgb[1], rgb[2]));
    }
  return sum / count;
}

// Standard error of a block of the reference, from its relMSE: the variance of a pixel is about relMSE * (Y^2 + epsilon).
double reference_error(double value, double rel_mse) {
  if (!(rel_mse > 0)) return 0;
  return std::sqrt(rel_mse * (value * value + kRelMseEpsilon)) / kBiasBlock;
}

}  // namespace

BlockMeans block_means(const RgbImage& image) {
  BlockMeans means{(image.width + kBiasBlock - 1) / kBiasBlock, (image.height + kBiasBlock - 1) / kBiasBlock, {}};
  for (int row = 0; row < means.rows; ++row)
    for (int column = 0; column < means.columns; ++column) means.values.push_back(block_mean(image, column, row));
  return means;
}

std::vector<double> bias_of(const std::vector<BlockMeans>& seeds, const BlockMeans& reference,
                            double reference_rel_mse) {
  std::vector<double> bias(reference.values.size(), kNotMeasured);
  std::vector<double> values(seeds.size());
  for (std::size_t block = 0; block < bias.size(); ++block) {
    for (std::size_t s = 0; s < seeds.size(); ++s) values[s] = seeds[s].values[block];
    const Interval interval = interval_of(values);
    const double wanted = reference.values[block], difference = interval.mean - wanted;
    // Two standard errors of the reference beside Student's interval of the seeds, as errors of two unrelated things.
    const double half = std::hypot((interval.high - interval.low) / 2, 2 * reference_error(wanted, reference_rel_mse));
    const double sum = interval.mean + wanted;
    if (!(half >= 0) || !(sum >= 0)) continue;
    bias[block] = std::abs(difference) <= half || sum == 0 ? 0 : difference / sum;
  }
  return bias;
}

double bias_scale(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  std::erase_if(values, [](double value) { return !(value > 0); });
  double largest = 0;
  if (!values.empty()) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 49 / 50);
    std::nth_element(values.begin(), at, values.end());
    largest = *at;
  }
  for (const double scale : {0.01, 0.02, 0.05, 0.1, 0.2, 0.5})
    if (largest <= scale) return scale;
  return 1;
}

std::vector<std::uint8_t> bias_codes(const std::vector<double>& bias, double scale) {
  std::vector<std::uint8_t> codes;
  for (const double value : bias) {
    const bool defined = value - value == 0;
    const double t = std::clamp(defined ? value / scale : 0.0, -1.0, 1.0);
    int code = 128 + static_cast<int>(std::lround(127 * t));
    if (code == 128 && defined && value != 0) code = value < 0 ? 127 : 129;  // faint, but not noise
    codes.push_back(defined ? static_cast<std::uint8_t>(code) : std::uint8_t{0});
  }
  return codes;
}

}  // namespace lumigrove
