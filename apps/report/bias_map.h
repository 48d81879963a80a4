// Where the mean of a method differs from the reference by more than noise: its systematic error.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "metrics/metrics.h"

namespace lumigrove {

inline constexpr int kBiasBlock = 8;  // pixels a side

// Luminance of blocks, mean over their pixels; not finite where a pixel is not.
struct BlockMeans {
  int columns = 0, rows = 0;
  std::vector<double> values;
};
BlockMeans block_means(const RgbImage& image);

// One value a block: (a - r) / (a + r) of the mean over seeds and the reference; 0 where zero lies in the 95 % interval;
// NaN where it is not defined. `reference_rel_mse`: of the reference itself, whose noise widens the interval; NaN: unknown,
// counts as none.
std::vector<double> bias_of(const std::vector<BlockMeans>& seeds, const BlockMeans& reference, double reference_rel_mse);

// Largest of 1, 2, 5 % ... 100 % that all but one value in fifty reach at most; for the colour scale.
double bias_scale(std::vector<double> values);

// 0: not defined, 128: zero, 1 and 255: -scale and +scale, or beyond.
std::vector<std::uint8_t> bias_codes(const std::vector<double>& bias, double scale);

}  // namespace lumigrove
