#include "summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <set>

namespace lumigrove {
namespace {

constexpr std::size_t kRmse = static_cast<std::size_t>(Metric::kRmse);
constexpr double kFlatSlope = -0.15;       // of log error over log time: no longer falling
constexpr double kMonteCarloSlope = -0.5;  // of an unbiased mean; nothing falls faster for long
constexpr double kQuietReference = 0.1;    // share of the best error that its own error should stay below
constexpr double kLongSample = 1.5;        // budgets

bool known(double value) { return value - value == 0; }

// 97.5 % quantiles of Student's distribution; beyond the table the expansion of Cornish and Fisher is good to 1e-3.
double student(int degrees) {
  static constexpr std::array<double, 10> kTable = {12.7062, 4.3027, 3.1824, 2.7764, 2.5706,
                                                    2.4469,  2.3646, 2.3060, 2.2622, 2.2281};
  if (degrees <= static_cast<int>(kTable.size())) return kTable[static_cast<std::size_t>(degrees - 1)];
  constexpr double kZ = 1.959964;
  return kZ + (kZ * kZ * kZ + kZ) / (4 * degrees) +
         (5 * std::pow(kZ, 5) + 16 * std::pow(kZ, 3) + 3 * kZ) / (96.0 * degrees * degrees);
}

double median(std::vector<double> values) {
  if (values.empty()) return kNotMeasured;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Means over frames are what seeds are repetitions of; with one seed the frames themselves are all there is.
class Samples {
 public:
  void add(int seed, double value) {
    if (known(value)) by_seed_[seed].push_back(value);
  }
  Interval interval() const {
    if (by_seed_.size() == 1) return interval_of(by_seed_.begin()->second);
    std::vector<double> means;
    for (const auto& [seed, values] : by_seed_)
      means.push_back(std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size()));
    return interval_of(means);
  }

 private:
  std::map<int, std::vector<double>> by_seed_;
};

template <class Value>
Interval interval_over(const std::vector<const Run*>& runs, const Value& value) {
  Samples samples;
  for (const Run* run : runs) samples.add(run->seed, value(*run));
  return samples.interval();
}

std::vector<const Run*> runs_of(const Results& results, int method, const std::function<bool(const Run&)>& wanted) {
  std::vector<const Run*> runs;
  for (const Run& run : results.runs)
    if (run.method == method && wanted(run)) runs.push_back(&run);
  return runs;
}

const std::string& light_of(const Results& results, int method) {
  return results.methods[static_cast<std::size_t>(method)].light;
}

Interval change_interval(const Results& results, int method, Budget budget, double FrameChange::*value) {
  Samples samples;
  for (const FrameChange& change : results.changes)
    if (change.method == method && change.budget == budget) samples.add(change.seed, change.*value);
  return samples.interval();
}

SummaryRow summary_row(const Results& results, int method, Budget budget, const std::vector<const Run*>& runs) {
  SummaryRow row;
  row.method = method;
  row.runs = static_cast<int>(runs.size());
  row.spp = interval_over(runs, [=](const Run& run) { return double(run.stage(budget).spp); });
  row.seconds = interval_over(runs, [=](const Run& run) { return run.stage(budget).seconds; });
  row.rays = interval_over(runs, [=](const Run& run) { return run.stage(budget).rays; });
  for (std::size_t m = 0; m < row.errors.size(); ++m)
    row.errors[m] = interval_over(runs, [=](const Run& run) { return run.stage(budget).errors[m]; });
  row.temporal_error = change_interval(results, method, budget, &FrameChange::error);
  row.flicker = change_interval(results, method, budget, &FrameChange::flicker);
  return row;
}

// --- ranks -----------------------------------------------------------------------------------------------------

double half_width(const Interval& interval) {
  return known(interval.high) ? interval.high - interval.mean : 0;
}

// The difference is more than chance and more than what the reference itself may be wrong by.
bool told_apart(const Interval& a, const Interval& b, double reference_error) {
  const double difference = std::abs(a.mean - b.mean);
  const double chance = std::hypot(half_width(a), half_width(b));
  return difference > chance && !(difference <= reference_error);
}

void rank(std::vector<SummaryRow*>& rows, std::size_t metric, double reference_error) {
  std::erase_if(rows, [&](const SummaryRow* row) { return !known(row->errors[metric].mean); });
  const bool lower = metrics()[metric].lower_is_better;
  std::sort(rows.begin(), rows.end(), [&](const SummaryRow* a, const SummaryRow* b) {
    const double x = a->errors[metric].mean, y = b->errors[metric].mean;
    return x != y ? (lower ? x < y : x > y) : a->method < b->method;
  });
  const SummaryRow* leader = nullptr;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    SummaryRow& row = *rows[i];
    const bool ties = leader && !told_apart(leader->errors[metric], row.errors[metric], reference_error);
    row.ranks[metric] = ties ? leader->ranks[metric] : static_cast<int>(i) + 1;
    if (!ties) leader = &row;
  }
}

std::vector<std::string> lights(const Results& results) {
  std::vector<std::string> names;
  for (const Contender& method : results.methods)
    if (std::find(names.begin(), names.end(), method.light) == names.end()) names.push_back(method.light);
  return names;
}

// --- time to equal error -------------------------------------------------------------------------------------------

struct TimeAndError {
  double seconds, error;
};

// Where a falling line through two points in logarithmic axes meets `error`.
double crossing(TimeAndError a, TimeAndError b, double error) {
  const double t = std::log(a.error / error) / std::log(a.error / b.error);
  return a.seconds * std::pow(b.seconds / a.seconds, t);
}

// The slope over the last quarter of the logarithm of time, at least a factor of two.
double last_slope(const std::vector<TimeAndError>& curve) {
  const TimeAndError last = curve.back();
  for (std::size_t i = curve.size() - 1; i-- > 0;)
    if (curve[i].seconds <= last.seconds / 4 || (i == 0 && curve[i].seconds < last.seconds))
      return std::log(last.error / curve[i].error) / std::log(last.seconds / curve[i].seconds);
  return kMonteCarloSlope;
}

EqualError equal_error_of(const std::vector<TimeAndError>& curve, TimeAndError best) {
  EqualError result;
  if (curve.empty()) return result;
  if (curve.front().error <= best.error) {
    result.ratio = curve.front().seconds / best.seconds;
    return result;
  }
  for (std::size_t i = 1; i < curve.size(); ++i)
    if (curve[i].error <= best.error) {
      result.ratio = crossing(curve[i - 1], curve[i], best.error) / best.seconds;
      return result;
    }
  result.extrapolated = true;
  const double slope = std::max(last_slope(curve), kMonteCarloSlope);
  if (slope > kFlatSlope) {
    result.never = true;
    return result;
  }
  const TimeAndError last = curve.back();
  result.ratio = last.seconds * std::pow(best.error / last.error, 1 / slope) / best.seconds;
  return result;
}

void add_equal_errors(const Results& results, std::vector<SummaryRow>& rows) {
  const std::vector<CurveBand> bands = curve_bands(results);
  for (const std::string& light : lights(results)) {
    const SummaryRow* best = nullptr;
    for (const SummaryRow& row : rows) {
      const double error = row.errors[kRmse].mean;
      if (light_of(results, row.method) == light && error > 0 && (!best || error < best->errors[kRmse].mean)) best = &row;
    }
    if (!best) continue;
    for (SummaryRow& row : rows) {
      if (light_of(results, row.method) != light) continue;
      std::vector<TimeAndError> curve;
      for (const CurveBand& band : bands)
        if (band.method == row.method)
          for (const CurveBand::Point& point : band.points)
            if (point.rmse.mean > 0) curve.push_back({point.seconds, point.rmse.mean});
      row.equal_error = equal_error_of(curve, {best->seconds.mean, best->errors[kRmse].mean});
      if (&row == best) row.equal_error = {1, false, false};
    }
  }
}

// --- medians of passes -----------------------------------------------------------------------------------------------

std::vector<PassTime> median_passes(const std::vector<const Run*>& runs) {
  std::vector<PassTime> passes;
  for (const PassTime& pass : runs.front()->passes) {
    std::vector<double> ms, rays;
    for (const Run* run : runs)
      for (const PassTime& other : run->passes)
        if (other.name == pass.name) {
          ms.push_back(other.ms);
          rays.push_back(other.rays);
        }
    passes.push_back({pass.name, median(ms), median(rays)});
  }
  return passes;
}

// --- curves -------------------------------------------------------------------------------------------------------------

// The time budget, where runs have stopped after different numbers of samples, ends the curve.
void add_end(const std::vector<const Run*>& runs, CurveBand& band) {
  Samples spp, seconds, rmse, rel_mse;
  for (const Run* run : runs) {
    const Stage& stage = run->stage(Budget::kTime);
    if (stage.spp == 0) return;
    spp.add(run->seed, stage.spp);
    seconds.add(run->seed, stage.seconds);
    rmse.add(run->seed, stage.errors[kRmse]);
    rel_mse.add(run->seed, stage.errors[static_cast<std::size_t>(Metric::kRelMse)]);
  }
  const double end = seconds.interval().mean;
  if (band.points.empty() || end > band.points.back().seconds)
    band.points.push_back({spp.interval().mean, end, rmse.interval(), rel_mse.interval()});
}

// --- cautions ----------------------------------------------------------------------------------------------------------

void caution_of_reference(const Results& results, const std::string& light, std::vector<std::string>& sentences) {
  const double own = reference_errors(results, light)[kRmse];
  double best = kNotMeasured;
  for (Budget budget : kBudgets)
    for (const SummaryRow& row : summarize(results, budget))
      if (light_of(results, row.method) == light && !(row.errors[kRmse].mean >= best)) best = row.errors[kRmse].mean;
  if (!known(best)) return;
  if (!known(own))
    sentences.push_back(fmt::format("How wrong the reference of {} is, is not known: nothing is ranked by it.", light));
  else if (own > kQuietReference * best)
    sentences.push_back(fmt::format(
        "The reference of {} has an RMSE of its own of {:.2g}, {:.0f} % of the best method's: differences below it are "
        "not ranked. A longer --reference-budget makes it smaller.",
        light, own, 100 * own / best));
}

}  // namespace

Interval interval_of(const std::vector<double>& values) {
  std::vector<double> finite;
  for (double value : values)
    if (known(value)) finite.push_back(value);
  Interval result;
  result.count = static_cast<int>(finite.size());
  if (finite.empty()) return result;
  const double n = static_cast<double>(finite.size());
  result.mean = std::accumulate(finite.begin(), finite.end(), 0.0) / n;
  if (finite.size() < 2) return result;
  double squares = 0;
  for (double value : finite) squares += (value - result.mean) * (value - result.mean);
  const double half = student(result.count - 1) * std::sqrt(squares / (n - 1) / n);
  result.low = result.mean - half;
  result.high = result.mean + half;
  return result;
}

Errors reference_errors(const Results& results, const std::string& light) {
  Errors largest = kNoErrors;
  for (const Reference& reference : results.references)
    if (reference.light == light)
      for (std::size_t m = 0; m < largest.size(); ++m)
        if (!(reference.errors[m] <= largest[m])) largest[m] = reference.errors[m];
  return largest;
}

std::vector<SummaryRow> summarize(const Results& results, Budget budget) {
  std::vector<SummaryRow> rows;
  for (int method = 0; method < static_cast<int>(results.methods.size()); ++method) {
    const auto runs = runs_of(results, method, [=](const Run& run) { return run.stage(budget).spp > 0; });
    if (!runs.empty()) rows.push_back(summary_row(results, method, budget, runs));
  }
  for (const std::string& light : lights(results)) {
    const Errors own = reference_errors(results, light);
    for (std::size_t m = 0; m < own.size(); ++m) {
      std::vector<SummaryRow*> group;
      for (SummaryRow& row : rows)
        if (light_of(results, row.method) == light) group.push_back(&row);
      rank(group, m, own[m]);
    }
  }
  if (budget == Budget::kTime) add_equal_errors(results, rows);
  return rows;
}

std::vector<CostRow> costs(const Results& results) {
  std::vector<CostRow> rows;
  for (int method = 0; method < static_cast<int>(results.methods.size()); ++method) {
    const auto runs = runs_of(results, method, [](const Run& run) { return run.sample_ms > 0; });
    if (runs.empty()) continue;
    const auto middle = [&](const std::function<double(const Run&)>& value) {
      std::vector<double> values;
      for (const Run* run : runs) values.push_back(value(*run));
      return median(values);
    };
    CostRow row;
    row.method = method;
    row.build_ms = middle([](const Run& run) { return run.build_ms; });
    row.sample_ms = middle([](const Run& run) { return run.sample_ms; });
    row.sample_low_ms = middle([](const Run& run) { return run.sample_low_ms; });
    row.sample_high_ms = middle([](const Run& run) { return run.sample_high_ms; });
    row.bytes = middle([](const Run& run) {
      double bytes = 0;
      for (const StructureSize& structure : run.structures) bytes += structure.bytes;
      return bytes;
    });
    row.passes = median_passes(runs);
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<CurveBand> curve_bands(const Results& results) {
  std::vector<CurveBand> bands;
  for (int method = 0; method < static_cast<int>(results.methods.size()); ++method) {
    auto runs = runs_of(results, method, [](const Run& run) { return run.complete; });
    if (runs.empty()) runs = runs_of(results, method, [](const Run&) { return true; });
    std::map<int, std::vector<std::pair<const Run*, const CurvePoint*>>> by_spp;
    for (const Run* run : runs)
      for (const CurvePoint& point : run->curve) by_spp[point.spp].emplace_back(run, &point);
    CurveBand band{method, {}};
    for (const auto& [spp, points] : by_spp) {
      if (points.size() != runs.size()) continue;
      Samples seconds, rmse, rel_mse;
      for (const auto& [run, point] : points) {
        seconds.add(run->seed, point->seconds);
        rmse.add(run->seed, point->rmse);
        rel_mse.add(run->seed, point->rel_mse);
      }
      band.points.push_back({double(spp), seconds.interval().mean, rmse.interval(), rel_mse.interval()});
    }
    add_end(runs, band);
    if (!band.points.empty()) bands.push_back(std::move(band));
  }
  return bands;
}

std::vector<std::string> cautions(const Results& results) {
  std::vector<std::string> sentences;
  if (!results.complete)
    sentences.push_back("The comparison was interrupted: what follows is what was measured until then; --resume continues it.");
  for (const Contender& method : results.methods)
    if (!method.failure.empty()) sentences.push_back(fmt::format("{} failed: {}", method.name, method.failure));
  for (const std::string& light : lights(results)) caution_of_reference(results, light, sentences);
  std::set<int> slow;
  for (const Run& run : results.runs)
    if (run.stage(Budget::kTime).spp == 1 && run.stage(Budget::kTime).seconds > kLongSample * results.budget_s)
      slow.insert(run.method);
  for (int method : slow)
    sentences.push_back(fmt::format("One sample of {} takes longer than the budget of {:.3g} s: at equal time it has had more.",
                                    results.methods[static_cast<std::size_t>(method)].name, results.budget_s));
  if (results.seeds * static_cast<int>(results.frames.size()) == 1)
    sentences.push_back("With one seed there are no intervals: differences may be chance.");
  if (lights(results).size() > 1)
    sentences.push_back(
        "Methods that compute different light are measured against different references and not ranked together.");
  return sentences;
}

}  // namespace lumigrove
