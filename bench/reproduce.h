// A reproduction: what a paper reports, one relation a row, beside what is measured here. Limits are data; whether a
// relation holds follows from them.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "table.h"

namespace lumigrove::bench {

enum class Verdict { kHolds, kWithinError, kFails, kReported };

inline const char* verdict_name(Verdict verdict) {
  static constexpr std::array<const char*, 4> kNames = {"holds", "within error", "DOES NOT HOLD", "-"};
  return kNames[static_cast<std::size_t>(verdict)];
}

// Standard errors by which a value may lie beyond its limit and still be called noise.
inline constexpr double kSigmas = 3;

struct Relation {
  int check = 0;          // number in the list of acceptance checks; 0: none of them
  std::string scene;      // empty: made for the purpose
  std::string what;       // the quantity
  std::string published;  // in the paper's words or numbers; empty: not published
  double ours = 0;
  double error = 0;                                   // standard error of `ours`; 0: exact, or not known
  std::optional<double> at_least = {}, at_most = {};  // neither: a number to be read
  std::string note = {};                              // the numbers behind it

  Verdict verdict() const {
    if (!at_least && !at_most) return Verdict::kReported;
    if (between(0)) return Verdict::kHolds;
    return between(kSigmas * error) ? Verdict::kWithinError : Verdict::kFails;
  }

 private:
  bool between(double tolerance) const {  // never true of NaN
    return ours - ours == 0 && (!at_least || ours >= *at_least - tolerance) &&
           (!at_most || ours <= *at_most + tolerance);
  }
};

using Relations = std::vector<Relation>;

inline std::string limit_text(const Relation& r) {
  if (r.at_least && r.at_most)
    return *r.at_least == *r.at_most ? fmt::format("{:.4g}", *r.at_least)
                                     : fmt::format("{:.4g} to {:.4g}", *r.at_least, *r.at_most);
  if (r.at_least) return fmt::format(">= {:.4g}", *r.at_least);
  return r.at_most ? fmt::format("<= {:.4g}", *r.at_most) : "";
}

inline std::string ours_text(const Relation& r) {
  return r.error > 0 ? fmt::format("{:.4g} +- {:.1g}", r.ours, r.error) : fmt::format("{:.4g}", r.ours);
}

// An empty table of relations. Its widths are fixed, so that rows can be printed as they are found.
inline Table relation_table(const std::string& caption = {}) {
  Table table;
  table.key = "relations";
  table.caption = caption;
  table.columns = {{"check", "", "group of relations", false, true, 2},
                   {"scene", "scene", "empty: made for the purpose", false, true, 14},
                   {"relation", "relation", "the quantity, and the numbers behind it", false, true, 72},
                   {"published", "published", "in the paper's words or numbers", true, true, 14},
                   {"ours", "ours", "measured here, with its standard error", true, true, 18},
                   {"wanted", "wanted", "limits that the published numbers imply", true, true, 14},
                   {"verdict", "", "verdict", false, true, 14}};
  table.name_column = 2;
  return table;
}

// For sorting; NaN when the text starts with none.
inline double leading_number(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end == text.c_str() ? std::nan("") : value;
}

inline Row relation_row(const Relation& r) {
  Row row;
  row.cells = {{fmt::format("{}", r.check)},
               {r.scene},
               {r.what},
               number_cell(leading_number(r.published), r.published),
               number_cell(r.ours, ours_text(r)),
               number_cell(r.at_least ? *r.at_least : r.at_most.value_or(std::nan("")), limit_text(r)),
               {verdict_name(r.verdict())}};
  row.note = r.note;
  return row;
}

inline nlohmann::ordered_json to_json(const Relation& r) {
  nlohmann::ordered_json json = {{"check", r.check},         {"scene", r.scene}, {"relation", r.what},
                                 {"published", r.published}, {"ours", r.ours},   {"error", r.error}};
  if (r.at_least) json["at_least"] = *r.at_least;
  if (r.at_most) json["at_most"] = *r.at_most;
  json["verdict"] = verdict_name(r.verdict());
  if (!r.note.empty()) json["note"] = r.note;
  return json;
}

inline int count_verdicts(const Relations& relations, Verdict verdict) {
  int count = 0;
  for (const Relation& r : relations) count += r.verdict() == verdict ? 1 : 0;
  return count;
}

// Takes relations as they are found.
using Report = std::function<void(Relation)>;

// A group of relations that is measured together.
struct Check {
  int number;
  const char* description;
  void (*run)(const Report&);
};

struct Reproduction {
  const char* name;
  const char* description;
  std::vector<Check> checks;
};

const std::vector<Reproduction>& reproductions();  // registry.cpp

// One file each.
std::vector<Check> sst_checks();
std::vector<Check> rtslc_checks();

}  // namespace lumigrove::bench
