#include "base/statistics.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace lumigrove {

// The regularised upper incomplete gamma function Q(freedom/2, x/2), by its series below the mode and Lentz's continued
// fraction above.
double chi_square_tail(double x, int freedom) {
  const double a = 0.5 * freedom, y = 0.5 * x;
  if (y <= 0) return 1;
  const double front = std::exp(a * std::log(y) - y - std::lgamma(a));
  if (y < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 100000 && term > sum * 1e-16; ++n) sum += term *= y / (a + n);
    return 1 - front * sum;
  }
  double b = y + 1 - a, c = 1e300, d = 1 / b, fraction = d;
  for (int n = 1; n < 100000; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    const double factor = c * d;
    fraction *= factor;
    if (std::abs(factor - 1) < 1e-15) break;
  }
  return front * fraction;
}

double chi_square_p_value(std::span<const double> observed, std::span<const double> expected, double least) {
  struct Cell {
    double observed = 0, expected = 0;
  };
  std::vector<Cell> cells;
  Cell open;
  for (std::size_t i = 0; i < observed.size(); ++i) {
    if (!(expected[i] > 0) && observed[i] > 0) return 0;
    open.observed += observed[i];
    open.expected += expected[i];
    if (open.expected >= least) {
      cells.push_back(open);
      open = {};
    }
  }
  if (cells.empty()) return 1;  // too few draws to say anything
  cells.back().observed += open.observed;
  cells.back().expected += open.expected;
  if (cells.size() < 2) return 1;
  double chi = 0;
  for (const Cell& c : cells) chi += (c.observed - c.expected) * (c.observed - c.expected) / c.expected;
  return chi_square_tail(chi, static_cast<int>(cells.size()) - 1);
}

double bernstein_p_value(double deviation, double variance, double most) {
  const double scale = variance + most * deviation / 3;
  if (!(deviation > 0)) return 1;
  if (!(scale > 0)) return 0;
  return std::min(1.0, 2 * std::exp(-0.5 * deviation * deviation / scale));
}

double sidak_p_value(double p, std::size_t tests) {
  if (p >= 1) return 1;
  return -std::expm1(static_cast<double>(tests) * std::log1p(-p));
}

double RunningMean::standard_error() const {
  return count_ > 0 ? std::sqrt(variance() / static_cast<double>(count_)) : 0;
}

}  // namespace lumigrove
