// Statistical tests with fixed seeds: z-tests of means as assertions; src/base/statistics.h has the rest.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "base/statistics.h"

namespace lumigrove::testing {

using lumigrove::chi_square_p_value;
using lumigrove::chi_square_tail;
using lumigrove::RunningMean;

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
