#include "summary.h"

#include <gtest/gtest.h>

#include <cmath>

#include "frame_changes.h"
#include "temp_folder.h"

namespace lumigrove {
namespace {

constexpr std::size_t kRmse = 0;

// Three seeds of methods whose RMSE falls as constants[m] / sqrt(seconds), one sample a second.
Results made_results(const std::vector<double>& constants, double reference_error) {
  Results results;
  results.width = results.height = 16;
  results.frames = {0};
  results.seeds = 3;
  results.budget_s = 16;
  results.budget_spp = 16;
  results.complete = true;
  results.references.push_back({"direct light", 0, "r.exr", "made", {reference_error, 0, 0, 0}});
  for (int method = 0; method < static_cast<int>(constants.size()); ++method) {
    Contender contender;
    contender.name = "m" + std::to_string(method);
    contender.light = "direct light";
    results.methods.push_back(contender);
    for (int seed = 0; seed < 3; ++seed) {
      Run run;
      run.method = method;
      run.seed = seed;
      run.complete = true;
      run.sample_ms = 1000;
      const double scatter = 1 + 0.001 * (seed - 1);
      const auto error = [&](double t) { return scatter * constants[static_cast<std::size_t>(method)] / std::sqrt(t); };
      for (int spp = 1; spp <= 16; spp *= 2) run.curve.push_back({spp, double(spp), 1, error(spp), 0.1});
      for (Stage& stage : run.stages) stage = {16, 16, 1, {error(16), 0.1, 0.9, 0.1}, ""};
      results.runs.push_back(run);
    }
  }
  return results;
}

// R 4: qt(0.975, c(2, 9, 30, 100)).
TEST(Summary, IntervalsAreStudents) {
  const Interval three = interval_of({1, 2, 3});
  EXPECT_NEAR(three.mean, 2, 1e-12);
  EXPECT_NEAR(three.high - three.mean, 4.302653 / std::sqrt(3), 1e-3);
  const auto half_of = [](int count) {
    std::vector<double> values;
    for (int i = 0; i < count; ++i) values.push_back(i % 2);
    const Interval interval = interval_of(values);
    const double deviation = std::sqrt(count * 0.25 / (count - 1));
    return (interval.high - interval.mean) / deviation * std::sqrt(count);
  };
  EXPECT_NEAR(half_of(10), 2.262157, 1e-3);
  EXPECT_NEAR(half_of(31 + 1), 2.0395, 2e-3);
  EXPECT_NEAR(half_of(101 + 1), 1.98373, 2e-3);
}

TEST(Summary, OneValueHasNoIntervalAndNoneNoMean) {
  EXPECT_EQ(interval_of({5}).mean, 5);
  EXPECT_TRUE(std::isnan(interval_of({5}).low));
  EXPECT_TRUE(std::isnan(interval_of({kNotMeasured}).mean));
}

TEST(Summary, RanksFollowTheErrors) {
  const auto rows = summarize(made_results({3, 1, 2}, 0.001), Budget::kTime);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[0].ranks[kRmse], 3);
  EXPECT_EQ(rows[1].ranks[kRmse], 1);
  EXPECT_EQ(rows[2].ranks[kRmse], 2);
}

TEST(Summary, DifferencesBelowTheReferencesOwnErrorAreNotRanked) {
  const auto rows = summarize(made_results({1, 1.2, 3}, 0.1), Budget::kTime);  // errors 0.25, 0.3, 0.75
  EXPECT_EQ(rows[0].ranks[kRmse], 1);
  EXPECT_EQ(rows[1].ranks[kRmse], 1);
  EXPECT_EQ(rows[2].ranks[kRmse], 3);
}

TEST(Summary, DifferencesWithinTheIntervalsAreNotRanked) {
  Results results = made_results({1, 1.0005}, 0);
  EXPECT_EQ(summarize(results, Budget::kTime)[1].ranks[kRmse], 1);
}

TEST(Summary, MethodsOfDifferentLightAreRankedApart) {
  Results results = made_results({1, 2}, 0.001);
  results.methods[1].light = "all light";
  const auto rows = summarize(results, Budget::kTime);
  EXPECT_EQ(rows[0].ranks[kRmse], 1);
  EXPECT_EQ(rows[1].ranks[kRmse], 1);
  EXPECT_EQ(rows[1].equal_error.ratio, 1);
}

// Error 2 / sqrt(t) reaches 1 / sqrt(16) at t = 64: beyond its curve's end at 16.
TEST(Summary, TimeToEqualErrorFollowsTheSlope) {
  const auto rows = summarize(made_results({1, 2}, 0.001), Budget::kTime);
  EXPECT_EQ(rows[0].equal_error.ratio, 1);
  EXPECT_FALSE(rows[0].equal_error.extrapolated);
  EXPECT_TRUE(rows[1].equal_error.extrapolated);
  EXPECT_NEAR(rows[1].equal_error.ratio, 4, 0.02);
}

// Runs reach it with different numbers of samples.
TEST(Summary, CurvesEndAtTheTimeBudget) {
  Results results = made_results({1}, 0.001);
  for (lumigrove::Run& run : results.runs) {
    run.stages[0].spp = 20 + run.seed;
    run.stages[0].seconds = 20;
    run.stages[0].errors[kRmse] = 0.2;
  }
  const CurveBand band = curve_bands(results).at(0);
  ASSERT_EQ(band.points.size(), 6u);
  EXPECT_EQ(band.points.back().spp, 21);
  EXPECT_EQ(band.points.back().seconds, 20);
  EXPECT_NEAR(band.points.back().rmse.mean, 0.2, 1e-12);
}

TEST(Summary, ACurveThatHasBecomeFlatNeverGetsThere) {
  Results results = made_results({1, 2}, 0.001);
  for (lumigrove::Run& run : results.runs)
    if (run.method == 1)
      for (CurvePoint& point : run.curve) point.rmse = 0.9 + 0.01 / point.spp;
  EXPECT_TRUE(summarize(results, Budget::kTime)[1].equal_error.never);
}

TEST(Summary, CautionsNameANoisyReferenceAnInterruptAndFailures) {
  Results results = made_results({1, 2}, 0.2);
  results.complete = false;
  results.methods[1].failure = "it broke";
  std::string all;
  for (const std::string& sentence : cautions(results)) all += sentence + "\n";
  EXPECT_NE(all.find("interrupted"), std::string::npos);
  EXPECT_NE(all.find("m1 failed: it broke"), std::string::npos);
  EXPECT_NE(all.find("80 % of the best"), std::string::npos);
  EXPECT_TRUE(cautions(made_results({1, 2}, 0.02)).empty());
}

// Seeds are repetitions of the mean over frames: frames that differ widely do not widen the interval.
TEST(Summary, SequencesAreAveragedBeforeSeedsAreCompared) {
  Results results = made_results({1}, 0.001);
  results.frames = {0, 1};
  const std::vector<lumigrove::Run> first = results.runs;
  for (lumigrove::Run run : first) {
    run.frame = 1;
    for (Stage& stage : run.stages) stage.errors[kRmse] *= 100;
    results.runs.push_back(run);
  }
  const Interval rmse = summarize(results, Budget::kTime)[0].errors[kRmse];
  EXPECT_NEAR(rmse.mean, 0.25 * 101 / 2, 1e-6);
  EXPECT_EQ(rmse.count, 3);
  EXPECT_LT(rmse.high - rmse.mean, 0.01 * rmse.mean);
}

TEST(FrameChanges, CountWhatGoesBeyondTheReference) {
  // The reference brightens by 0.1; the method by 0.3 in one value and darkens by 0.1 in the other.
  const FrameChange change = change_between({0.5f, 0.5f}, {0.8f, 0.4f}, {0.2f, 0.2f}, {0.3f, 0.3f});
  EXPECT_NEAR(change.error, (0.2 + 0.2) / 2, 1e-6);
  EXPECT_NEAR(change.flicker, (0.3 + 0.1) / 2 - 0.1, 1e-6);
}

}  // namespace
}  // namespace lumigrove
