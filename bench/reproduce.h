// A reproduction: what a paper reports, one relation a row, beside what is measured here. Limits are data; whether a
// relation holds follows from them.
#pragma once

#include <fmt/format.h>

#include <array>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

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

// A line a relation, and its note under it.
inline std::string relation_header() {
  return fmt::format("{:<2} {:<14} {:<72} {:>14} {:>18} {:>14}  {}\n", "", "scene", "relation", "published", "ours",
                     "wanted", "");
}
inline std::string relation_text(const Relation& r) {
  std::string text = fmt::format("{:<2} {:<14} {:<72} {:>14} {:>18} {:>14}  {}\n", r.check, r.scene, r.what,
                                 r.published, ours_text(r), limit_text(r), verdict_name(r.verdict()));
  if (!r.note.empty()) text += fmt::format("{:<18}{}\n", "", r.note);
  return text;
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
