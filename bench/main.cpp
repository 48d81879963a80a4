// lumigrove-bench: runs measurements by name or looks for the relations of a paper, prints a table, writes JSON.
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/nearest.h"
#include "base/stopwatch.h"
#include "bench.h"
#include "lumigrove/error.h"
#include "lumigrove/renderer.h"
#include "page.h"
#include "reproduce.h"

namespace lumigrove::bench {
namespace {

void print_list() {
  for (const Benchmark& benchmark : benchmarks()) {
    const std::string limit = benchmark.limit ? fmt::format("at most {}", *benchmark.limit) : "";
    fmt::print("{:<28} {:<6} {:<12} {}\n", benchmark.name, benchmark.unit, limit, benchmark.description);
  }
}

const Benchmark& find(const std::string& name) {
  std::vector<std::string> names;
  for (const Benchmark& benchmark : benchmarks()) {
    if (benchmark.name == name) return benchmark;
    names.emplace_back(benchmark.name);
  }
  throw Error(fmt::format("There is no benchmark '{}'; did you mean '{}'?", name, nearest(name, names)));
}

bool exceeds_limit(const Benchmark& benchmark, const Result& result) {
  return benchmark.limit && !(result.value <= *benchmark.limit);
}

void print_result(const Benchmark& benchmark, const Result& result) {
  std::string verdict;
  if (benchmark.limit) {
    verdict =
        fmt::format("{} limit {}", exceeds_limit(benchmark, result) ? "ABOVE" : "within", *benchmark.limit);
  }
  fmt::print("{:<28} {:>9.3f} {:<6} {}\n", benchmark.name, result.value, benchmark.unit, verdict);
  for (const auto& [name, value] : result.details) fmt::print("    {:<40} {:.6g}\n", name, value);
  std::fflush(stdout);
}

nlohmann::ordered_json to_json(const Benchmark& benchmark, const Result& result) {
  nlohmann::ordered_json json = {{"name", benchmark.name},
                                 {"description", benchmark.description},
                                 {"unit", benchmark.unit},
                                 {"value", result.value}};
  if (benchmark.limit) json["limit"] = *benchmark.limit;
  for (const auto& [name, value] : result.details) json["details"][name] = value;
  return json;
}

void write_json(const std::string& file, const Options& options, const nlohmann::ordered_json& results) {
  const nlohmann::ordered_json json = {{"version", version()},
                                       {"commit", commit()},
                                       {"threads", tbb::this_task_arena::max_concurrency()},
                                       {"runs", options.runs},
                                       {"results", results}};
  const std::string text = json.dump(2) + "\n";
  write_text_atomically(file, text);
}

struct Command {
  Options options;
  std::vector<std::string> names;
  std::string reproduction;
  std::vector<int> checks;
  std::string json_file, html_file;
  int threads = 0;
  bool check = false;
};

// Exit status.
int measure(const Command& command) {
  std::vector<const Benchmark*> chosen;
  for (const std::string& name : command.names) chosen.push_back(&find(name));
  if (chosen.empty())
    for (const Benchmark& benchmark : benchmarks()) chosen.push_back(&benchmark);
  bool all_within = true;
  nlohmann::ordered_json results = nlohmann::ordered_json::array();
  for (const Benchmark* benchmark : chosen) {
    const Result result = benchmark->run(command.options);
    print_result(*benchmark, result);
    results.push_back(to_json(*benchmark, result));
    all_within = all_within && !exceeds_limit(*benchmark, result);
  }
  if (!command.json_file.empty()) write_json(command.json_file, command.options, results);
  return command.check && !all_within ? 1 : 0;
}

const Reproduction& find_reproduction(const std::string& name) {
  std::vector<std::string> names;
  for (const Reproduction& reproduction : reproductions()) {
    if (reproduction.name == name) return reproduction;
    names.emplace_back(reproduction.name);
  }
  throw Error(fmt::format("There is no reproduction '{}'; there are: {}", name, fmt::join(names, ", ")));
}

// Exit status. Rows are printed as they are found.
int reproduce(const Command& command) {
  const Reproduction& reproduction = find_reproduction(command.reproduction);
  const std::vector<int>& wanted = command.checks;
  Relations relations;
  Table table = relation_table(reproduction.description);
  const std::vector<int> widths = text_widths(table);
  fmt::print("{}\n{}", reproduction.description, heading_text(table, widths));
  for (const Check& check : reproduction.checks) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), check.number) == wanted.end()) continue;
    fmt::print(stderr, "check {}: {}\n", check.number, check.description);
    const Stopwatch watch;
    check.run([&](Relation relation) {
      table.rows.push_back(relation_row(relation));
      fmt::print("{}", row_text(table, table.rows.back(), widths));
      std::fflush(stdout);
      relations.push_back(std::move(relation));
    });
    fmt::print(stderr, "check {}: {:.0f} s\n", check.number, watch.ms() * 1e-3);
  }
  const int failed = count_verdicts(relations, Verdict::kFails);
  const std::string sums =
      fmt::format("{} hold, {} within {} standard errors, {} do not hold, {} reported only",
                  count_verdicts(relations, Verdict::kHolds), count_verdicts(relations, Verdict::kWithinError), kSigmas,
                  failed, count_verdicts(relations, Verdict::kReported));
  fmt::print("{}\n", sums);
  if (!command.html_file.empty())
    write_table_page(command.html_file, fmt::format("Reproduction: {}", reproduction.name),
                     fmt::format("{}. Lumigrove {} ({}).", sums, version(), commit()), table);
  if (!command.json_file.empty()) {
    nlohmann::ordered_json results = nlohmann::ordered_json::array();
    for (const Relation& relation : relations) results.push_back(to_json(relation));
    write_json(command.json_file, command.options, results);
  }
  return command.check && failed > 0 ? 1 : 0;
}

int run(int argc, char** argv) {
  Command command;
  CLI::App app("Measures Lumigrove against what it must be compared with.");
  app.add_option("name", command.names, "benchmarks to run, all when none is named; 'list' prints them");
  app.add_option("--runs", command.options.runs, "repetitions of each side")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("-t,--threads", command.threads, "threads, 0 = all cores")->check(CLI::Range(0, 1024));
  app.add_option("--json", command.json_file, "also write the results to this file");
  app.add_flag("--check", command.check, "exit status 1 when a value is above its limit or a relation does not hold");
  CLI::App* again = app.add_subcommand("reproduce", "Look for the relations that a paper reports");
  again->add_option("paper", command.reproduction, "sst or rtslc")->required();
  again->add_option("--only", command.checks, "numbers of the groups of relations to look for, all when none is given");
  again->add_option("--html", command.html_file, "also write the table as a page that needs nothing else");
  again->fallthrough();
  CLI11_PARSE(app, argc, argv);

  if (command.names == std::vector<std::string>{"list"}) {
    print_list();
    return 0;
  }
  const int workers = command.threads > 0 ? command.threads : tbb::this_task_arena::max_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(workers));
  tbb::task_arena arena(workers);
  return arena.execute([&] { return again->parsed() ? reproduce(command) : measure(command); });
}

}  // namespace
}  // namespace lumigrove::bench

int main(int argc, char** argv) {
  try {
    return lumigrove::bench::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "lumigrove-bench: {}\n", error.what());
    return 1;
  }
}
