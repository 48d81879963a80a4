// Statistical tests with fixed seeds: chi-square of frequencies, z-tests of means.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <vector>

namespace lumigrove::testing {

// P(X >= x) of a chi-square distribution: the regularised upper incomplete gamma function Q(freedom/2, x/2),
// by its series below the mode and Lentz's continued fraction above.
inline double chi_square_tail(double x, int freedom) {
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

// Probability of frequencies at least as far from `expected` as `observed`, both counts of the same draws
// (equal totals). Neighbouring cells are pooled until each expects 5. A hit where nothing may fall gives 0.
inline double chi_square_p_value(std::span<const double> observed, std::span<const double> expected) {
  struct Cell {
    double observed = 0, expected = 0;
  };
  std::vector<Cell> cells;
  Cell open;
  for (std::size_t i = 0; i < observed.size(); ++i) {
    if (!(expected[i] > 0) && observed[i] > 0) return 0;
    open.observed += observed[i];
    open.expected += expected[i];
    if (open.expected >= 5) {
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

// Mean and its standard error of a growing number of samples (Welford).
class RunningMean {
 public:
  void add(double x) {
    ++count_;
    const double delta = x - mean_;
    mean_ += delta / static_cast<double>(count_);
    squares_ += delta * (x - mean_);
  }
  long count() const { return count_; }
  double mean() const { return mean_; }
  double variance() const { return count_ > 1 ? squares_ / static_cast<double>(count_ - 1) : 0; }
  double standard_error() const {
    return count_ > 0 ? std::sqrt(variance() / static_cast<double>(count_)) : 0;
  }

 private:
  long count_ = 0;
  double mean_ = 0, squares_ = 0;
};

// |mean - expected| within `z` standard errors, plus `tolerance` for rounding.
inline ::testing::AssertionResult mean_within(double mean, double standard_error, double expected,
                                              double z = 4, double tolerance = 0) {
  const double limit = z * standard_error + tolerance;
  if (std::abs(mean - expected) <= limit) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure()
         << "mean " << mean << " is " << std::abs(mean - expected) << " from " << expected << "; " << limit
         << " allowed (standard error " << standard_error << ")";
}
inline ::testing::AssertionResult mean_within(const RunningMean& samples, double expected, double z = 4,
                                              double tolerance = 0) {
  return mean_within(samples.mean(), samples.standard_error(), expected, z, tolerance);
}

}  // namespace lumigrove::testing
