// Runs methods on one scene at equal time and at equal samples, and measures them against a reference.
//
// Fairness  Each method works alone on all cores, one camera sample at a time. Always the one whose clock shows least
//           goes on, so that methods alternate (A B A B) and what disturbs the machine disturbs all. A clock runs while
//           its method builds structures over lights and takes samples; loading, geometry and its acceleration
//           structure, which all share, and measuring are on nobody's.
// Equal time     the whole number of samples that ends nearest to the budget
// Equal samples  the same number for all. A budget that was not asked for follows from the other: as many samples as the
//           slowest method takes in the time, or the time that the fastest takes for the samples.
// Images        light that surfaces reflect, as the method finds it, and emission that the camera sees directly as the reference
//           has it: no method samples that, and its noise would drown their differences.
// Reference the mean of two halves with seeds of their own; half their difference is how wrong it is itself.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "interrupt.h"
#include "method_spec.h"
#include "metrics/metrics.h"
#include "progress.h"
#include "results.h"
#include "view_options.h"

namespace lumigrove {

struct ComparedMethod {
  MethodSpec spec;
  Settings settings;
  std::string failure;  // why these settings cannot be rendered; empty when they can
};

struct ComparisonJob {
  std::string scene, environment;  // as given; environment may be empty
  std::vector<ComparedMethod> methods;
  BudgetSpec budget;
  int seeds = 4;
  std::vector<ComparedMethod> reference_methods;  // one that finds all light that is compared; perhaps one for direct light
  BudgetSpec reference_budget;  // neither: as long as all methods together
  std::string reference_file;   // instead of the method; empty: none
  std::string layer;            // measured instead of what each method finds; empty: none
  std::vector<int> frames;      // empty: one picture at settings.time
  double fps = 24;
  ViewOptions view;
  MetricSettings metrics;
  std::string tone = "filmic";
  std::filesystem::path folder;
  bool resume = false, force = false;
  std::string command;  // for the receipt
  ProgressStyle progress = ProgressStyle::kSilent;
};

// Writes EXRs, plots, results.json and report.html into the folder and returns what the file holds. An interrupt ends it early
// with what was measured until then (Results::complete is false). Throws Error when there is nothing to measure or the
// folder holds another comparison.
Results run_comparison(const ComparisonJob& job, const InterruptGuard& guard);

}  // namespace lumigrove
