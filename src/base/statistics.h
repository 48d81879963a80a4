// What statistical tests are made of: p-values of frequencies and of means, means that grow, and what many tests at once
// make of a p-value.
#pragma once

#include <cstddef>
#include <span>

namespace lumigrove {

// P(X >= x) of a chi-square distribution.
double chi_square_tail(double x, int freedom);

// Probability of frequencies at least as far from `expected` as `observed`, both counts of the same draws
// (equal totals). Neighbouring cells are pooled until each expects `least`. A hit where nothing may fall gives 0.
double chi_square_p_value(std::span<const double> observed, std::span<const double> expected, double least = 5);

// Bound of the probability that a sum of independent numbers is `deviation` or more away from its mean, on either side;
// `variance`: of the sum, `most`: the farthest that one number may be from its own mean. Bernstein's inequality: no
// approximation, however skewed the numbers are; for large sums close to the normal tail.
double bernstein_p_value(double deviation, double variance, double most);

// Probability of a p-value as small as `p`, or smaller, among `tests` independent ones (Sidak); a bound if they are not.
double sidak_p_value(double p, std::size_t tests);

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
  double standard_error() const;

 private:
  long count_ = 0;
  double mean_ = 0, squares_ = 0;
};

}  // namespace lumigrove
