#include "summary_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "html.h"

namespace lumigrove {
namespace {

bool chosen(const Contender& method, const std::string& light) { return light.empty() || method.light == light; }

Row message_row(const Table& table, const std::string& name, const std::string& message) {
  Row row;
  row.cells.resize(table.columns.size());
  row.cells[table.name_column].text = name;
  row.message = message;
  return row;
}

// "+- 0.0012", with the mean's number of decimals.
std::string half_width_text(const Interval& interval) {
  return is_number(interval.low) && interval.high > interval.low ? "+- " + number_text((interval.high - interval.low) / 2, 2) : "";
}

Cell error_cell(const Interval& interval, bool best) {
  Cell cell = number_cell(interval.mean, number_text(interval.mean), half_width_text(interval), best);
  if (is_number(interval.low))
    cell.title = fmt::format("95 % interval {} to {}, {} runs", number_text(interval.low), number_text(interval.high),
                             interval.count);
  return cell;
}

Cell equal_error_cell(const EqualError& equal) {
  if (equal.never) return number_cell(std::numeric_limits<double>::infinity(), "never");
  if (!is_number(equal.ratio)) return {"-"};
  return number_cell(equal.ratio, fmt::format("{}x{}", equal.extrapolated ? "~" : "", number_text(equal.ratio, 2)));
}

Cell rank_cell(int rank) {
  return rank > 0 ? number_cell(rank, fmt::format("{}", rank), {}, rank == 1) : Cell{"-"};
}

bool is_sequence(const Results& results) { return results.frames.size() > 1; }

std::vector<Column> summary_columns(const Results& results, Budget budget, bool show_light) {
  std::vector<Column> columns = {
      {"rank", "#", "rank by RMSE; equal where intervals or the reference cannot tell methods apart", true},
      {"method", "method", "as --methods named it"}};
  if (show_light) columns.push_back({"light", "light", "what the method is measured on"});
  columns.push_back({"estimator", "estimator", "what its mean tends to", false, true, 0, false});
  columns.push_back({"spp", "spp", "camera samples a pixel", true, false});
  columns.push_back({"seconds", "time", "its structures over lights and camera samples", true});
  columns.push_back({"rays", "rays", "all rays of a run", true, true, 0, false});
  for (const MetricInfo& info : metrics())
    columns.push_back({info.key, info.label, info.formula, true, info.lower_is_better});
  if (is_sequence(results)) {
    columns.push_back({"temporal_error", "temporal error", "mean |(a' - a) - (r' - r)| between neighbouring frames, "
                       "tone-mapped sRGB", true});
    columns.push_back({"flicker", "flicker", "mean |a' - a| - mean |r' - r| between neighbouring frames", true});
  }
  if (budget == Budget::kTime)
    columns.push_back({"equal_error", "time to equal error",
                       "its time to the RMSE of the best at equal time, relative to the best; ~ extrapolated", true});
  return columns;
}

Row summary_row(const Results& results, const SummaryRow& summary, Budget budget, bool show_light) {
  const Contender& method = results.methods[static_cast<std::size_t>(summary.method)];
  Row row;
  row.cells = {rank_cell(summary.ranks[0]), {method.name}};
  if (show_light) row.cells.push_back({method.light});
  row.cells.push_back({method.estimator});
  const double spp = summary.spp.mean;
  row.cells.push_back(number_cell(spp, spp == std::round(spp) ? fmt::format("{:.0f}", spp) : number_text(spp)));
  row.cells.push_back(number_cell(summary.seconds.mean, seconds_text(summary.seconds.mean)));
  row.cells.push_back(number_cell(summary.rays.mean, count_text(summary.rays.mean)));
  for (std::size_t m = 0; m < metrics().size(); ++m)
    row.cells.push_back(error_cell(summary.errors[m], summary.ranks[m] == 1));
  if (is_sequence(results)) {
    row.cells.push_back(error_cell(summary.temporal_error, false));
    row.cells.push_back(error_cell(summary.flicker, false));
  }
  if (budget == Budget::kTime) row.cells.push_back(equal_error_cell(summary.equal_error));
  return row;
}

// The best first, by RMSE; what has none last.
bool before(const SummaryRow& a, const SummaryRow& b) {
  const bool a_known = is_number(a.errors[0].mean), b_known = is_number(b.errors[0].mean);
  return a_known && b_known ? a.errors[0].mean < b.errors[0].mean : a_known && !b_known;
}

std::string why_nothing(const Results& results, const Contender& method, Budget budget) {
  if (!method.failure.empty()) return method.failure;
  return fmt::format("has not reached {}{}", budget_label(budget),
                     results.complete ? "" : ": the comparison is not complete");
}

std::string budget_text(const Results& results, Budget budget) {
  return budget == Budget::kTime ? seconds_text(results.budget_s) : fmt::format("{} spp", results.budget_spp);
}

std::string passes_text(const CostRow& cost) {
  std::vector<PassTime> passes = cost.passes;
  std::stable_sort(passes.begin(), passes.end(), [](const PassTime& a, const PassTime& b) { return a.ms > b.ms; });
  std::string text;
  for (const PassTime& pass : passes)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", pass.name, number_text(pass.ms));
  return text;
}

Row cost_row(const Contender& method, const CostRow& cost) {
  double rays = 0;
  for (const PassTime& pass : cost.passes) rays += pass.rays;
  const std::string quartiles =
      fmt::format("({} to {})", number_text(cost.sample_low_ms), number_text(cost.sample_high_ms));
  Row row;
  row.cells = {{method.name},
               number_cell(cost.sample_ms, number_text(cost.sample_ms), quartiles),
               number_cell(rays, count_text(rays)),
               number_cell(rays / cost.sample_ms * 1e-3, number_text(rays / cost.sample_ms * 1e-3)),
               number_cell(cost.build_ms, number_text(cost.build_ms)),
               number_cell(cost.bytes, bytes_text(cost.bytes)),
               {passes_text(cost)}};
  return row;
}

}  // namespace

std::vector<std::string> lights_of(const Results& results) {
  std::vector<std::string> lights;
  for (const Contender& method : results.methods)
    if (std::find(lights.begin(), lights.end(), method.light) == lights.end()) lights.push_back(method.light);
  return lights;
}

Table summary_table(const Results& results, Budget budget, const std::string& light) {
  const bool show_light = light.empty() && lights_of(results).size() > 1;
  Table table;
  table.key = fmt::format("summary-{}", budget_key(budget));
  table.caption = fmt::format("{}: {}", budget_label(budget), budget_text(results, budget));
  table.caption[0] = static_cast<char>(std::toupper(table.caption[0]));
  table.columns = summary_columns(results, budget, show_light);
  table.name_column = 1;
  std::vector<SummaryRow> rows = summarize(results, budget);
  std::stable_sort(rows.begin(), rows.end(), [](const SummaryRow& a, const SummaryRow& b) { return before(a, b); });
  std::vector<bool> shown(results.methods.size());
  for (const SummaryRow& row : rows) {
    const auto method = static_cast<std::size_t>(row.method);
    if (chosen(results.methods[method], light)) table.rows.push_back(summary_row(results, row, budget, show_light));
    shown[method] = true;
  }
  for (std::size_t m = 0; m < results.methods.size(); ++m) {
    const Contender& method = results.methods[m];
    if (!shown[m] && chosen(method, light))
      table.rows.push_back(message_row(table, method.name, why_nothing(results, method, budget)));
  }
  return table;
}

Table cost_table(const Results& results, const std::string& light) {
  Table table;
  table.key = "costs";
  table.caption = "What a camera sample costs";
  table.columns = {{"method", "method", "as --methods named it"},
                   {"sample_ms", "ms a sample", "wall time of one camera sample of the whole picture: median, quartiles", true},
                   {"sample_rays", "rays a sample", "of one camera sample of the whole picture", true},
                   {"mrays_per_s", "Mrays/s", "million rays a second, whatever else the time was spent on", true, false},
                   {"build_ms", "build ms", "structures over the scene's lights, built once", true},
                   {"bytes", "memory", "structures over lights, without the acceleration structure of the scene", true},
                   {"passes", "ms of passes", "wall time of each pass in one camera sample, longest first", false, true, 0, false}};
  for (const CostRow& cost : costs(results)) {
    const Contender& method = results.methods[static_cast<std::size_t>(cost.method)];
    if (chosen(method, light)) table.rows.push_back(cost_row(method, cost));
  }
  return table;
}

}  // namespace lumigrove
