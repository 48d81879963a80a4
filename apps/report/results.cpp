#include "results.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"

namespace lumigrove {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;  // of results.json; another number is refused

// --- numbers that may be missing -----------------------------------------------------------------------------

Json number(double value) { return value - value == 0 ? Json(value) : Json(nullptr); }
double number(const Json& json) { return json.is_null() ? kNotMeasured : json.get<double>(); }

Json to_json(const Errors& errors) {
  Json json = Json::object();
  for (std::size_t i = 0; i < errors.size(); ++i) json[metrics()[i].key] = number(errors[i]);
  return json;
}
Errors errors_of(const Json& json) {
  Errors errors = kNoErrors;
  for (std::size_t i = 0; i < errors.size(); ++i) errors[i] = number(json.at(metrics()[i].key));
  return errors;
}

// Declared before the template that calls them.
Json to_json(const CurvePoint& point);
Json to_json(const PassTime& pass);
Json to_json(const StructureSize& structure);
Json to_json(const Run& run);
Json to_json(const Contender& contender);
Json to_json(const Reference& reference);
Json to_json(const FrameChange& change);

template <class T>
Json list_of(const std::vector<T>& items) {
  Json list = Json::array();
  for (const T& item : items) list.push_back(to_json(item));
  return list;
}

template <class T, class Read>
std::vector<T> read_list(const Json& list, const Read& read) {
  std::vector<T> items;
  for (const Json& item : list) items.push_back(read(item));
  return items;
}

// --- parts -------------------------------------------------------------------------------------------------------

Json to_json(const Stage& s) {
  return {{"spp", s.spp}, {"seconds", s.seconds}, {"rays", s.rays}, {"errors", to_json(s.errors)}, {"file", s.file}};
}
Stage stage_of(const Json& j) {
  return {j.at("spp"), j.at("seconds"), j.at("rays"), errors_of(j.at("errors")), j.at("file")};
}

Json to_json(const CurvePoint& p) {
  return {{"spp", p.spp}, {"seconds", p.seconds}, {"rays", p.rays}, {"rmse", number(p.rmse)}, {"relmse", number(p.rel_mse)}};
}
CurvePoint curve_point_of(const Json& j) {
  return {j.at("spp"), j.at("seconds"), j.at("rays"), number(j.at("rmse")), number(j.at("relmse"))};
}

Json to_json(const PassTime& p) { return {{"name", p.name}, {"ms", p.ms}, {"rays", p.rays}}; }
PassTime pass_of(const Json& j) { return {j.at("name"), j.at("ms"), j.at("rays")}; }

Json to_json(const StructureSize& s) {
  return {{"name", s.name}, {"build_ms", s.build_ms}, {"bytes", s.bytes}};
}
StructureSize structure_of(const Json& j) { return {j.at("name"), j.at("build_ms"), j.at("bytes")}; }

Json to_json(const Run& r) {
  Json json = {{"method", r.method},
               {"seed", r.seed},
               {"frame", r.frame},
               {"complete", r.complete},
               {"build_ms", r.build_ms},
               {"sample_ms", r.sample_ms},
               {"sample_low_ms", r.sample_low_ms},
               {"sample_high_ms", r.sample_high_ms},
               {"passes", list_of(r.passes)},
               {"structures", list_of(r.structures)},
               {"curve", list_of(r.curve)}};
  for (Budget budget : kBudgets) json["stages"][budget_key(budget)] = to_json(r.stage(budget));
  return json;
}
Run run_of(const Json& j) {
  Run r;
  r.method = j.at("method");
  r.seed = j.at("seed");
  r.frame = j.at("frame");
  r.complete = j.at("complete");
  r.build_ms = j.at("build_ms");
  r.sample_ms = j.at("sample_ms");
  r.sample_low_ms = j.at("sample_low_ms");
  r.sample_high_ms = j.at("sample_high_ms");
  r.passes = read_list<PassTime>(j.at("passes"), pass_of);
  r.structures = read_list<StructureSize>(j.at("structures"), structure_of);
  r.curve = read_list<CurvePoint>(j.at("curve"), curve_point_of);
  for (Budget budget : kBudgets)
    r.stages[static_cast<std::size_t>(budget)] = stage_of(j.at("stages").at(budget_key(budget)));
  return r;
}

Json to_json(const Contender& c) {
  Json json = {{"name", c.name},           {"description", c.description}, {"citation", c.citation},
               {"light", c.light},         {"estimator", c.estimator},     {"why", c.why},
               {"settings", c.settings},   {"failure", c.failure}};
  for (Budget budget : kBudgets) json["commands"][budget_key(budget)] = c.commands[static_cast<std::size_t>(budget)];
  return json;
}
Contender contender_of(const Json& j) {
  Contender c{j.at("name"),      j.at("description"), j.at("citation"), j.at("light"),  j.at("estimator"),
              j.at("why"),       j.at("settings"),    {},               j.at("failure")};
  for (Budget budget : kBudgets)
    c.commands[static_cast<std::size_t>(budget)] = j.at("commands").at(budget_key(budget));
  return c;
}

Json to_json(const Reference& r) {
  return {{"light", r.light}, {"frame", r.frame}, {"file", r.file}, {"origin", r.origin}, {"errors", to_json(r.errors)}};
}
Reference reference_of(const Json& j) {
  return {j.at("light"), j.at("frame"), j.at("file"), j.at("origin"), errors_of(j.at("errors"))};
}

Json to_json(const FrameChange& c) {
  return {{"method", c.method},           {"seed", c.seed},           {"frame", c.frame},
          {"budget", budget_key(c.budget)}, {"error", number(c.error)}, {"flicker", number(c.flicker)}};
}
FrameChange change_of(const Json& j) {
  const Budget budget = j.at("budget") == budget_key(Budget::kTime) ? Budget::kTime : Budget::kSamples;
  return {j.at("method"), j.at("seed"), j.at("frame"), budget, number(j.at("error")), number(j.at("flicker"))};
}

Json to_json(const Machine& m) {
  return {{"processor", m.processor},
          {"system", m.system},
          {"cores", m.cores},
          {"threads", m.threads},
          {"memory_bytes", m.memory_bytes}};
}
Machine machine_of(const Json& j) {
  return {j.at("processor"), j.at("system"), j.at("cores"), j.at("threads"), j.at("memory_bytes")};
}

Json to_json(const Results& r) {
  Json json = {{"format", kFormat},
               {"version", r.version},
               {"date", r.date},
               {"command", r.command},
               {"complete", r.complete},
               {"machine", to_json(r.machine)},
               {"scene", r.scene},
               {"scene_hash", r.scene_hash},
               {"environment", r.environment},
               {"scene_summary", r.scene_summary},
               {"width", r.width},
               {"height", r.height},
               {"exposure_ev", r.exposure_ev},
               {"tone", r.tone},
               {"pixels_per_degree", r.pixels_per_degree},
               {"budget_s", r.budget_s},
               {"budget_spp", r.budget_spp},
               {"seeds", r.seeds},
               {"first_seed", r.first_seed},
               {"frames", r.frames},
               {"fps", r.fps}};
  for (const MetricInfo& info : metrics()) json["formulas"][info.key] = info.formula;
  json["methods"] = list_of(r.methods);
  json["references"] = list_of(r.references);
  json["runs"] = list_of(r.runs);
  json["changes"] = list_of(r.changes);
  return json;
}

Results results_of(const Json& j) {
  Results r;
  r.version = j.at("version");
  r.date = j.at("date");
  r.command = j.at("command");
  r.complete = j.at("complete");
  r.machine = machine_of(j.at("machine"));
  r.scene = j.at("scene");
  r.scene_hash = j.at("scene_hash");
  r.environment = j.at("environment");
  r.scene_summary = j.at("scene_summary");
  r.width = j.at("width");
  r.height = j.at("height");
  r.exposure_ev = j.at("exposure_ev");
  r.tone = j.at("tone");
  r.pixels_per_degree = j.at("pixels_per_degree");
  r.budget_s = j.at("budget_s");
  r.budget_spp = j.at("budget_spp");
  r.seeds = j.at("seeds");
  r.first_seed = j.at("first_seed");
  r.frames = j.at("frames").get<std::vector<int>>();
  r.fps = j.at("fps");
  r.methods = read_list<Contender>(j.at("methods"), contender_of);
  r.references = read_list<Reference>(j.at("references"), reference_of);
  r.runs = read_list<Run>(j.at("runs"), run_of);
  r.changes = read_list<FrameChange>(j.at("changes"), change_of);
  return r;
}

// Indices that lead out of their lists would crash whoever follows them.
void check_indices(const Results& r) {
  const auto in_methods = [&](int method) { return method >= 0 && method < static_cast<int>(r.methods.size()); };
  for (const Run& run : r.runs)
    if (!in_methods(run.method)) throw Error(fmt::format("a run names method number {}", run.method));
  for (const FrameChange& change : r.changes)
    if (!in_methods(change.method)) throw Error(fmt::format("a frame change names method number {}", change.method));
  if (r.width < 1 || r.height < 1) throw Error("the image has no pixels");
  if (r.frames.empty()) throw Error("there are no frames");
}

}  // namespace

const char* budget_key(Budget budget) { return budget == Budget::kTime ? "time" : "samples"; }
const char* budget_label(Budget budget) { return budget == Budget::kTime ? "equal time" : "equal samples"; }

void write_results(const Results& results, const std::filesystem::path& folder) {
  // File names need not be UTF-8, JSON strings must be.
  const std::string text = to_json(results).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  write_text_atomically(folder / "results.json", text);
}

Results read_results(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "results.json";
  std::ifstream stream(file);
  if (!stream) throw Error(fmt::format("{}: cannot be read; the folder holds no comparison", file.string()));
  try {
    const Json json = Json::parse(stream);
    if (json.at("format") != kFormat) throw Error("it was written by another version of this program");
    Results results = results_of(json);
    check_indices(results);
    return results;
  } catch (const std::exception& error) {
    throw Error(fmt::format("{}: not a comparison: {}", file.string(), error.what()));
  }
}

}  // namespace lumigrove
