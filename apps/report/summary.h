// Statistics of a comparison: means over seeds with 95 % intervals, ranks, time to equal error.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "results.h"

namespace lumigrove {

// Mean of `count` values with Student's 95 % interval; low = high = NaN when there is only one value, and all NaN when
// there is none.
struct Interval {
  double mean = kNotMeasured, low = kNotMeasured, high = kNotMeasured;
  int count = 0;
};
Interval interval_of(const std::vector<double>& values);

// How long a method takes to be as good as the best of its group is at equal time, by RMSE.
struct EqualError {
  double ratio = kNotMeasured;  // of its time to the best one's; 1 for the best itself
  bool extrapolated = false;    // beyond the end of the curve, with the slope of its last part
  bool never = false;           // the curve has become flat above that error
};

// One row of a table: a method at a budget, all frames and seeds.
struct SummaryRow {
  int method = 0;
  int runs = 0;                 // that reached the budget
  Interval spp, seconds, rays;  // of a run
  std::array<Interval, 4> errors;  // by metrics()
  std::array<int, 4> ranks{};   // within its light, by metrics(); 1 is best; equal where neither the intervals nor the
                                // reference can tell apart; 0: no value
  EqualError equal_error;       // kTime only
  Interval temporal_error, flicker;  // sequences only
};

// One line for each method, not of a budget.
struct CostRow {
  int method = 0;
  double build_ms = 0, sample_ms = 0, sample_low_ms = 0, sample_high_ms = 0;  // medians over runs
  double bytes = 0;             // structures over lights
  std::vector<PassTime> passes; // medians over runs
};

std::vector<SummaryRow> summarize(const Results& results, Budget budget);  // methods that have a value, in their order
std::vector<CostRow> costs(const Results& results);

// The largest of the references' own errors for methods measured on `light`; NaN: unknown.
Errors reference_errors(const Results& results, const std::string& light);

// Curves of one method: at each sample count that every run reached, and at last at the time budget, mean and interval of
// the values.
struct CurveBand {
  int method = 0;
  struct Point {
    double spp = 0, seconds = 0;
    Interval rmse, rel_mse;
  };
  std::vector<Point> points;
};
std::vector<CurveBand> curve_bands(const Results& results);

// Sentences that a reader should know before the numbers: an incomplete run, a reference that is too noisy for the best
// method's errors, methods that failed, single samples longer than the budget.
std::vector<std::string> cautions(const Results& results);

}  // namespace lumigrove
