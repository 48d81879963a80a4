// The bench: named measurements whose values are ratios or sizes, because absolute times mean little on
// shared machines. Both sides of a ratio are timed in one run, in turns, so that what disturbs one disturbs
// the other.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/stopwatch.h"

namespace lumigrove::bench {

struct Options {
  int runs = 9;  // repetitions of each side
};

struct Result {
  double value = 0;
  std::vector<std::pair<std::string, double>> details;  // what the value was made from, units in the names
};

// Names are stable: they outlive the code behind them.
struct Benchmark {
  const char* name;
  const char* unit;
  const char* description;
  std::optional<double> limit;  // the value should not exceed it
  Result (*run)(const Options&);
};

const std::vector<Benchmark>& benchmarks();  // registry.cpp

// One file each.
Result frame_floor_night_city(const Options& options);
Result frame_floor_cornell_lights(const Options& options);
Result frame_floor_rtslc_cornell_lights(const Options& options);
Result frame_floor_pool_cornell_lights(const Options& options);
Result build_tree_1m(const Options& options);
Result sample_scaling(const Options& options);
Result build_two_level(const Options& options);
Result sample_two_level_night_city(const Options& options);
Result sample_two_level_cornell_lights(const Options& options);
Result sample_two_level_cut_night_city(const Options& options);
Result memory_per_emitter(const Options& options);
Result error_tree_power(const Options& options);
Result error_two_level_cut(const Options& options);
Result build_agglomerative(const Options& options);
Result build_saoh(const Options& options);
Result sample_light_bvh(const Options& options);
Result sort_radix_1m(const Options& options);
Result build_substitute_1m(const Options& options);
Result build_substitute_growth(const Options& options);
Result vpl_trace_night_city(const Options& options);
Result vpl_trace_colonnade(const Options& options);
Result frame_floor_sst_colonnade(const Options& options);
Result frame_floor_sst_living_room(const Options& options);
Result memory_per_vpl(const Options& options);
Result sst_steps(const Options& options);
Result sst_growth(const Options& options);
Result slc_growth(const Options& options);
Result error_sst_slc(const Options& options);
Result error_sst_path2(const Options& options);

inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <class Function>
double time_ms(const Function& function) {
  const Stopwatch watch;
  function();
  return watch.ms();
}

template <class Function>
double median_ms(int runs, const Function& function) {
  std::vector<double> times;
  for (int i = 0; i < runs; ++i) times.push_back(time_ms(function));
  return median(times);
}

struct PairTimes {
  double a_ms = 0, b_ms = 0;  // medians
  double ratio = 0;           // median over repetitions of a / b
  double lowest_ratio = 0, highest_ratio = 0;
};

// Times `a` and `b` in turns after one untimed call of each. `prepare` runs untimed before every call.
template <class A, class B, class Prepare>
PairTimes time_in_turns(int runs, const A& a, const B& b, const Prepare& prepare) {
  prepare();
  a();
  prepare();
  b();
  std::vector<double> a_ms, b_ms, ratios;
  for (int i = 0; i < runs; ++i) {
    prepare();
    a_ms.push_back(time_ms(a));
    prepare();
    b_ms.push_back(time_ms(b));
    ratios.push_back(a_ms.back() / b_ms.back());
  }
  const auto [lowest, highest] = std::minmax_element(ratios.begin(), ratios.end());
  return {median(a_ms), median(b_ms), median(ratios), *lowest, *highest};
}

template <class A, class B>
PairTimes time_in_turns(int runs, const A& a, const B& b) {
  return time_in_turns(runs, a, b, [] {});
}

}  // namespace lumigrove::bench
