#include "frame/audit.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>

#include "base/rng.h"
#include "base/statistics.h"
#include "device/device.h"

namespace lumigrove {
namespace {

// The chi-square distribution's tail is trusted far out, so cells are larger than is usual.
constexpr double kLeastExpected = 20;
// By so much a mean may be off by rounding: lanes round otherwise than single numbers. Of the sum; and of what an average
// point has, where hardly anything shines.
constexpr double kRounding = 2e-4, kRoundingOfDark = 1e-6;
// Likewise of the sum of all probabilities.
constexpr double kRoundingOfSum = 1e-3;
// A walk's probability of finding nothing is what is left of 1: below this, rounding.
constexpr double kLeastDead = 1e-5;
constexpr int kLeastEstimates = 64;

struct MissedHere {
  std::uint32_t light;
  double share;
};

struct Mean {
  double value = 0, variance = 0, most = 0;  // of the mean of all estimates; `most` likewise
  double model_variance = 0;                 // V / N alone: does not depend on what was drawn
  std::size_t estimates = 0;
};

struct PointResult {
  double sum = 0;  // S
  double frequencies_p = 1;
  std::string frequencies;  // what was drawn too often or too rarely
  std::vector<MissedHere> missed;
  Mean mean;
  std::uint64_t draws = 0;
};

std::uint32_t seed_of(const AuditOptions& options, std::uint32_t point, std::uint32_t use) {
  return pcg4d(uvec4(options.seed, point, use, 0x5eed5u)).x;
}

// --- frequencies ---------------------------------------------------------------------------------------------

struct Frequencies {
  std::vector<double> observed, expected;  // by cell; the last: draws that found nothing
  std::vector<double> claimed;             // by cell: draws in an estimate
  double most_sum = 0;                     // of a part's probabilities
};

Frequencies draw_all(const AuditedSampler& sampler, const SamplerAtPoint& at, const AuditOptions& options,
                     std::uint32_t point) {
  const std::size_t cells = sampler.cells;
  Frequencies f{std::vector<double>(cells + 1), std::vector<double>(cells + 1), std::vector<double>(cells), 0};
  if (at.parts.empty()) return f;
  const auto draws = static_cast<std::size_t>(std::max(1, options.draws / static_cast<int>(at.parts.size())));
  std::vector<double> pdf(cells);
  std::vector<std::uint32_t> drawn(draws);
  for (std::size_t part = 0; part < at.parts.size(); ++part) {
    std::fill(pdf.begin(), pdf.end(), 0.0);
    at.pdf(part, pdf);
    double sum = 0;
    for (std::size_t c = 0; c < cells; ++c) {
      sum += pdf[c];
      f.expected[c] += pdf[c] * static_cast<double>(draws);
      f.claimed[c] += pdf[c] * at.parts[part];
    }
    f.most_sum = std::max(f.most_sum, sum);
    f.expected[cells] += std::max(1 - sum, kLeastDead) * static_cast<double>(draws);
    at.draw(part, seed_of(options, point, static_cast<std::uint32_t>(part)), drawn);
    for (const std::uint32_t cell : drawn) ++f.observed[std::min<std::size_t>(cell, cells)];
  }
  return f;
}

std::string cell_text(const AuditedSampler& sampler, std::size_t cell) {
  if (cell >= sampler.cells) return "no light";
  const auto c = static_cast<std::uint32_t>(cell);
  return sampler.describe_cell ? sampler.describe_cell(c).text() : sampler.describe(c).text();
}

// The cell that is farthest from its expectation.
std::string worst_cell(const AuditedSampler& sampler, const Frequencies& f) {
  std::size_t worst = 0;
  double most = -1, all = 0;
  for (std::size_t c = 0; c <= sampler.cells; ++c) {
    const double apart = f.observed[c] - f.expected[c];
    const double far = f.expected[c] > 0 ? apart * apart / std::max(f.expected[c], 1.0)
                                         : std::numeric_limits<double>::infinity() * (f.observed[c] > 0 ? 1 : 0);
    if (far > most) {
      most = far;
      worst = c;
    }
    all += f.observed[c];
  }
  return fmt::format("{} was drawn {} times in {}, but {:.4g} times are claimed", cell_text(sampler, worst),
                     f.observed[worst], all, f.expected[worst]);
}

void test_frequencies(const AuditedSampler& sampler, const Frequencies& f, PointResult& result) {
  if (f.most_sum > 1 + kRoundingOfSum) {
    result.frequencies_p = 0;
    result.frequencies = fmt::format("the probabilities add up to {:.6g}", f.most_sum);
    return;
  }
  result.frequencies_p = chi_square_p_value(f.observed, f.expected, kLeastExpected);
  if (result.frequencies_p < 0.01) result.frequencies = worst_cell(sampler, f);
}

// --- means ---------------------------------------------------------------------------------------------------

// Variance of one estimate and the most that one draw adds, if the claims are true.
struct Model {
  double variance = 0, most = 0;
};
Model model_of(const std::vector<LightMoments>& light, const std::vector<double>& claimed, double sum, double draws) {
  Model model;
  double squares = 0;
  for (std::size_t l = 0; l < light.size(); ++l) {
    if (!(light[l].most > 0) || !(claimed[l] > 0)) continue;
    squares += static_cast<double>(light[l].square) / claimed[l];
    model.most = std::max(model.most, static_cast<double>(light[l].most) / claimed[l]);
  }
  model.variance = std::max(0.0, squares - (draws > 0 ? sum * sum / draws : 0));
  return model;
}

Mean mean_of(const std::vector<double>& estimates, double sum, double variance_of_sum, const Model& model) {
  Mean mean;
  mean.estimates = estimates.size();
  RunningMean running;
  double farthest = 0;
  for (const double x : estimates) {
    running.add(x);
    farthest = std::max(farthest, std::abs(x - sum));
  }
  const double n = static_cast<double>(std::max<std::size_t>(1, estimates.size()));
  mean.value = running.mean();
  mean.model_variance = model.variance / n + variance_of_sum;
  mean.variance = std::max(model.variance, running.variance()) / n + variance_of_sum;
  mean.most = std::max(model.most, farthest) / n;
  return mean;
}

// --- one point -----------------------------------------------------------------------------------------------

PointResult audit_at(const AuditedSampler& sampler, const AuditPoint& point, std::uint32_t number,
                     const AuditOptions& options, std::span<std::uint8_t> reached) {
  PointResult result;
  const std::vector<LightMoments> light = sampler.light(point, number);
  double variance_of_sum = 0;
  for (std::size_t l = 0; l < light.size(); ++l) {
    result.sum += static_cast<double>(light[l].mean);
    variance_of_sum += static_cast<double>(light[l].variance_of_mean);
    if (light[l].most > 0) std::atomic_ref(reached[l]).store(1, std::memory_order_relaxed);
  }
  const SamplerAtPoint at = sampler.at(point, number);
  const Frequencies f = draw_all(sampler, at, options, number);
  test_frequencies(sampler, f, result);
  for (const double o : f.observed) result.draws += static_cast<std::uint64_t>(o);

  const std::vector<double> claimed = sampler.of_lights ? sampler.of_lights(f.claimed) : f.claimed;
  for (std::size_t l = 0; l < light.size(); ++l)
    if (light[l].most > 0 && !(claimed[l] > 0))
      result.missed.push_back(
          {static_cast<std::uint32_t>(l), result.sum > 0 ? static_cast<double>(light[l].mean) / result.sum : 0});

  double draws = 0;
  for (const double part : at.parts) draws += part;
  const int estimates = std::max(kLeastEstimates, static_cast<int>(options.draws / std::max(1.0, at.work)));
  result.mean = mean_of(at.estimate(estimates, seed_of(options, number, 0x4000u)), result.sum, variance_of_sum,
                        sampler.of_lights ? Model{} : model_of(light, claimed, result.sum, draws));
  return result;
}

// --- all points ----------------------------------------------------------------------------------------------

void add_missed(const AuditedSampler& sampler, std::span<const PointResult> results, AuditRow& row) {
  std::map<std::uint32_t, MissedLight> missed;
  for (std::uint32_t p = 0; p < results.size(); ++p)
    for (const MissedHere& here : results[p].missed) {
      MissedLight& light = missed[here.light];
      light.light = here.light;
      if (light.points++ > 0 && here.share <= light.share) continue;
      light.point = p;
      light.share = here.share;
    }
  row.missed_count = static_cast<std::uint32_t>(missed.size());
  for (const auto& [number, light] : missed) row.missed.push_back(light);
  std::stable_sort(row.missed.begin(), row.missed.end(),
                   [](const MissedLight& a, const MissedLight& b) { return a.share > b.share; });
  if (row.missed.size() > kNamedLights) row.missed.resize(kNamedLights);
  for (MissedLight& light : row.missed) light.name = sampler.describe(light.light);
}

void take_worse(WorstTest& worst, double p, std::uint32_t point, const std::string& what) {
  if (!(p < worst.p)) return;
  worst.p = p;
  worst.point = point;
  worst.what = what;
}

void test_means(std::span<const PointResult> results, AuditRow& row) {
  double average = 0;
  for (const PointResult& r : results) average += r.sum / static_cast<double>(results.size());
  double weights = 0, deviation = 0, variance = 0, most = 0;
  for (std::uint32_t p = 0; p < results.size(); ++p) {
    const PointResult& r = results[p];
    const double apart = r.mean.value - r.sum;
    const double tolerance = kRounding * r.sum + kRoundingOfDark * average;
    const double p_value = std::isfinite(apart)
                               ? bernstein_p_value(std::abs(apart) - tolerance, r.mean.variance, r.mean.most)
                               : 0.0;
    take_worse(row.mean, p_value, p,
               r.sum > 0 ? fmt::format("the mean of {} estimates is {:.4g} times the sum over all lights",
                                       r.mean.estimates, r.mean.value / r.sum)
                         : fmt::format("the mean of {} estimates is {:.4g}, but no light shines there",
                                       r.mean.estimates, r.mean.value));
    if (!(r.sum > kRoundingOfDark * average)) continue;
    const double s2 = r.sum * r.sum, weight = 1 / (1e-6 + r.mean.model_variance / s2);
    weights += weight;
    deviation += weight * apart / r.sum;
    variance += weight * weight * r.mean.variance / s2;
    most = std::max(most, weight * r.mean.most / r.sum);
  }
  row.tests += results.size();
  if (!(weights > 0)) return;
  row.mean_ratio = 1 + deviation / weights;
  const double beyond = std::max(0.0, std::abs(deviation) - kRounding * weights);
  row.z = beyond > 0 ? std::copysign(beyond / std::sqrt(std::max(variance, 1e-300)), deviation) : 0;
  ++row.tests;
  const double p_value = std::isfinite(deviation) ? bernstein_p_value(beyond, variance, most) : 0.0;
  take_worse(row.mean, p_value, kNoCell,
             fmt::format("over all points the mean is {:.4g} times the sum over all lights", row.mean_ratio));
}

}  // namespace

std::string LightName::text() const {
  std::string text = kind;
  if (triangle != kNoCell) text += fmt::format(" {}", triangle);
  if (!mesh.empty()) text += fmt::format(" of mesh '{}'", mesh);
  if (!light.empty()) text += fmt::format(" '{}'", light);
  if (!node.empty()) text += fmt::format(" at node '{}'", node);
  if (!material.empty()) text += fmt::format(", material '{}'", material);
  if (stable_id != kNoCell) text += fmt::format(" (id {})", stable_id);
  return text;
}

std::string point_text(const AuditPoint& point) {
  const vec3 p = point.surface.position;
  return fmt::format("({:.5g}, {:.5g}, {:.5g}){}", p.x, p.y, p.z, point.seen ? ", seen by the camera" : "");
}

AuditRow audit_sampler(const AuditedSampler& sampler, std::span<const AuditPoint> points, const AuditOptions& options) {
  AuditRow row;
  row.reached.resize(sampler.lights);
  std::vector<PointResult> results(points.size());
  launch(
      static_cast<int>(points.size()),
      [&](int i) {
        const auto k = static_cast<std::size_t>(i);
        results[k] = audit_at(sampler, points[k], static_cast<std::uint32_t>(i), options, row.reached);
      },
      1);
  row.name = sampler.name;
  row.word = sampler.word;
  row.unbiased = sampler.unbiased;
  row.lights = sampler.lights;
  for (std::uint32_t p = 0; p < results.size(); ++p) {
    const PointResult& r = results[p];
    row.points += r.sum > 0 ? 1 : 0;
    row.draws += r.draws;
    row.estimates += r.mean.estimates;
    take_worse(row.frequencies, r.frequencies_p, p, r.frequencies);
  }
  row.tests = results.size();
  add_missed(sampler, results, row);
  test_means(results, row);
  return row;
}

void judge(std::span<AuditRow> rows, std::span<const AuditPoint> points, const AuditOptions& options) {
  std::size_t tests = 0;
  for (const AuditRow& row : rows) tests += row.tests;
  const auto where = [&](const WorstTest& test) {
    return test.point == kNoCell ? std::string() : fmt::format(" at {}", point_text(points[test.point]));
  };
  for (AuditRow& row : rows) {
    row.failures.clear();
    for (WorstTest* test : {&row.frequencies, &row.mean}) test->corrected = sidak_p_value(test->p, tests);
    if (row.frequencies.corrected < options.significance)
      row.failures.push_back(fmt::format("{}: draws do not follow their probabilities{}: {} (p = {:.2g}, corrected for {} "
                                         "tests)",
                                         row.name, where(row.frequencies), row.frequencies.what,
                                         row.frequencies.corrected, tests));
    if (row.missed_count > 0) {
      std::string sentence = fmt::format("{}: {} that {} never drawn there: ", row.name,
                                         row.missed_count == 1 ? "1 light shines at a point"
                                                               : fmt::format("{} lights shine at points", row.missed_count),
                                         row.missed_count == 1 ? "but is" : "but are");
      for (const MissedLight& light : row.missed)
        sentence += fmt::format("{}{}, {:.3g} % of the light at {}{}", &light == row.missed.data() ? "" : "; ",
                                light.name.text(), 100 * light.share, point_text(points[light.point]),
                                light.points > 1 ? fmt::format(" and missed at {} more", light.points - 1) : "");
      if (row.missed_count > row.missed.size())
        sentence += fmt::format("; and {} more", row.missed_count - row.missed.size());
      row.failures.push_back(sentence);
    }
    if (row.unbiased && row.mean.corrected < options.significance)
      row.failures.push_back(fmt::format("{}: the estimates are biased: {}{} (p = {:.2g}, corrected for {} tests)",
                                         row.name, row.mean.what, where(row.mean), row.mean.corrected, tests));
  }
}

}  // namespace lumigrove
