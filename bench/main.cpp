// lumigrove-bench: runs measurements by name, prints a table, writes JSON.
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/nearest.h"
#include "bench.h"
#include "lumigrove/error.h"
#include "lumigrove/renderer.h"

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
  write_file_atomically(file, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

int run(int argc, char** argv) {
  Options options;
  std::vector<std::string> names;
  std::string json_file;
  int threads = 0;
  bool check = false;
  CLI::App app("Measures Lumigrove against what it must be compared with.");
  app.add_option("name", names, "benchmarks to run, all when none is named; 'list' prints them");
  app.add_option("--runs", options.runs, "repetitions of each side")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("-t,--threads", threads, "threads, 0 = all cores")->check(CLI::Range(0, 1024));
  app.add_option("--json", json_file, "also write the results to this file");
  app.add_flag("--check", check, "exit status 1 when a value is above its limit");
  CLI11_PARSE(app, argc, argv);

  if (names == std::vector<std::string>{"list"}) {
    print_list();
    return 0;
  }
  if (names.empty()) {
    for (const Benchmark& benchmark : benchmarks()) names.emplace_back(benchmark.name);
  }
  std::vector<const Benchmark*> chosen;
  for (const std::string& name : names) chosen.push_back(&find(name));

  const int workers = threads > 0 ? threads : tbb::this_task_arena::max_concurrency();
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(workers));
  tbb::task_arena arena(workers);
  bool all_within = true;
  arena.execute([&] {
    nlohmann::ordered_json results = nlohmann::ordered_json::array();
    for (const Benchmark* benchmark : chosen) {
      const Result result = benchmark->run(options);
      print_result(*benchmark, result);
      results.push_back(to_json(*benchmark, result));
      all_within = all_within && !exceeds_limit(*benchmark, result);
    }
    if (!json_file.empty()) write_json(json_file, options, results);
  });
  return check && !all_within ? 1 : 0;
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
