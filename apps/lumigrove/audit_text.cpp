#include "audit_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "json_text.h"

namespace lumigrove {
namespace {

std::size_t seen_points(const AuditReport& report) {
  return static_cast<std::size_t>(
      std::count_if(report.points.begin(), report.points.end(), [](const AuditPoint& p) { return p.seen; }));
}

std::size_t all_tests(const AuditReport& report) {
  std::size_t tests = 0;
  for (const AuditRow& row : report.rows) tests += row.tests;
  return tests;
}

const char* verdict(const AuditRow& row) {
  if (!row.holds()) return "BROKEN";
  return row.unbiased ? "holds" : "holds, biased";
}

std::string never_found_text(const AuditReport& report) {
  if (report.never_found_count == 0) return "Every light shines at some of the points.\n";
  std::string text = fmt::format("{} of {} lights shine at none of the points: ", report.never_found_count, report.emitters);
  for (const LightName& light : report.never_found)
    text += fmt::format("{}{}", &light == report.never_found.data() ? "" : "; ", light.text());
  if (report.never_found_count > report.never_found.size())
    text += fmt::format("; and {} more", report.never_found_count - report.never_found.size());
  return text + ".\n";
}

Json json_of(const LightName& light) {
  Json json = {{"kind", light.kind}};
  for (const auto& [key, value] : {std::pair<const char*, const std::string&>{"node", light.node},
                                   {"mesh", light.mesh},
                                   {"material", light.material},
                                   {"name", light.light}})
    if (!value.empty()) json[key] = value;
  if (light.triangle != kNoCell) json["triangle"] = light.triangle;
  if (light.stable_id != kNoCell) json["stable_id"] = light.stable_id;
  return json;
}

Json json_of(const AuditPoint& point) {
  return {{"position", json_list(point.surface.position)}, {"normal", json_list(point.surface.normal)}, {"seen", point.seen}};
}

Json json_of(const AuditReport& report, const WorstTest& test) {
  Json json = {{"p", test.p}, {"corrected_p", test.corrected}, {"what", test.what}};
  json["point"] = test.p < 1 && test.point != kNoCell ? json_of(report.points[test.point]) : Json();
  return json;
}

Json json_of(const AuditReport& report, const AuditRow& row, const std::vector<std::string>& methods) {
  Json missed = Json::array();
  for (const MissedLight& light : row.missed)
    missed.push_back({{"light", json_of(light.name)},
                      {"point", json_of(report.points[light.point])},
                      {"share", light.share},
                      {"points", light.points}});
  return {{"name", row.name},
          {"methods", methods},
          {"lights", row.lights},
          {"lit_points", row.points},
          {"draws", row.draws},
          {"estimates", row.estimates},
          {"frequencies", json_of(report, row.frequencies)},
          {"missed_lights", row.missed_count},
          {"missed", missed},
          {"mean_ratio", row.mean_ratio},
          {"z", row.z},
          {"mean", json_of(report, row.mean)},
          {"unbiased", row.unbiased},
          {"word", row.word},
          {"holds", row.holds()},
          {"failures", row.failures}};
}

}  // namespace

bool AuditReport::holds() const {
  return std::all_of(rows.begin(), rows.end(), [](const AuditRow& row) { return row.holds(); });
}

std::string audit_text(const AuditReport& report) {
  const std::size_t seen = seen_points(report);
  std::string text = fmt::format(
      "{}: {} lights; {} points, {} of them seen by the camera, {} draws at each; family-wise significance {:g} over {} "
      "tests\n\n",
      report.scene, report.emitters, report.points.size(), seen, report.options.draws, report.options.significance,
      all_tests(report));
  std::size_t width = 7;
  for (const AuditRow& row : report.rows) width = std::max(width, row.name.size());
  text += fmt::format("{:<{}}  {:>8} {:>6} {:>11} {:>11} {:>7} {:>9} {:>7} {:>11}  {}\n", "sampler", width, "lights",
                      "points", "draws", "chi-square", "missed", "mean", "z", "mean's p", "verdict");
  for (const AuditRow& row : report.rows)
    text += fmt::format("{:<{}}  {:>8} {:>6} {:>11} {:>11.3g} {:>7} {:>9.5f} {:>7.2f} {:>11.3g}  {}\n", row.name, width,
                        row.lights, row.points, row.draws, row.frequencies.corrected, row.missed_count, row.mean_ratio,
                        row.z, row.mean.corrected, verdict(row));
  text += "\nchi-square: worst p-value of frequencies against claimed probabilities; missed: lights that shine at a point "
          "but cannot be drawn there;\nmean: estimates over the sum of all lights. p-values are corrected for all tests; "
          "points: those that any light shines at.\n\n";
  for (const AuditRow& row : report.rows)
    if (!row.word.empty()) text += fmt::format("{}: {}.\n", row.name, row.word);
  for (const std::string& note : report.notes) text += note + "\n";
  return text + never_found_text(report);
}

std::string audit_json(const AuditReport& report) {
  Json json = {{"scene", report.scene},
                    {"lights", report.emitters},
                    {"points", report.points.size()},
                    {"seen_points", seen_points(report)},
                    {"draws", report.options.draws},
                    {"seed", report.options.seed},
                    {"significance", report.options.significance},
                    {"tests", all_tests(report)},
                    {"holds", report.holds()}};
  json["samplers"] = Json::array();
  for (std::size_t i = 0; i < report.rows.size(); ++i)
    json["samplers"].push_back(json_of(report, report.rows[i], report.methods[i]));
  json["notes"] = report.notes;
  Json first = Json::array();
  for (const LightName& light : report.never_found) first.push_back(json_of(light));
  json["never_found"] = {{"count", report.never_found_count}, {"first", first}};
  // Names need not be UTF-8, JSON strings must be.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace lumigrove
