#include "stats_table.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>

namespace lumigrove {
namespace {

template <class Entry>
Entry& entry_named(std::vector<Entry>& entries, const std::string& name) {
  const auto found =
      std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.name == name; });
  if (found != entries.end()) return *found;
  entries.emplace_back().name = name;
  return entries.back();
}

double peak_megabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024 * 1e-6;  // Linux counts in KiB
}

std::string pass_line(const std::string& name, double ms, std::uint64_t rays) {
  std::string line = fmt::format("{:<28}{:>12.2f}", name, ms);
  if (rays == 0) return line + fmt::format("{:>15}{:>12}\n", "-", "-");
  return line + fmt::format("{:>15}{:>12.2f}\n", rays, ms > 0 ? static_cast<double>(rays) / (ms * 1e3) : 0);
}

std::string structure_line(const StructureStats& s, std::uint64_t lights) {
  const bool serves_lights = s.name != kAccelerationStructure && lights > 0;
  const std::string per_light =
      serves_lights ? fmt::format("{:.1f}", static_cast<double>(s.bytes) / static_cast<double>(lights)) : "-";
  return fmt::format("{:<28}{:>12.2f}{:>15}{:>12}\n", s.name, s.build_ms, s.bytes, per_light);
}

// Those that serve emitters or those that serve virtual point lights, and their sum.
std::string structure_lines(const RenderStats& stats, bool of_vpls, std::uint64_t lights, const char* sum_name) {
  StructureStats sum{sum_name, 0, 0, lights, of_vpls};
  std::string text;
  for (const StructureStats& structure : stats.structures) {
    if (structure.name == kAccelerationStructure || structure.of_vpls != of_vpls) continue;
    text += structure_line(structure, lights);
    sum.build_ms += structure.build_ms;
    sum.bytes += structure.bytes;
  }
  return text.empty() ? text : text + structure_line(sum, lights);
}

}  // namespace

void add_stats_option(CLI::App& command, bool& stats) {
  command.add_flag("--stats", stats, "Print times and rays of passes, times and sizes of structures");
}

void accumulate(RenderStats& total, const RenderStats& frame) {
  total.spp_done = frame.spp_done;
  total.total_ms += frame.total_ms;
  total.emitters = frame.emitters;
  for (const PassStats& pass : frame.passes) {
    PassStats& sum = entry_named(total.passes, pass.name);
    sum.ms += pass.ms;
    sum.rays += pass.rays;
  }
  for (const StructureStats& structure : frame.structures) {
    StructureStats& sum = entry_named(total.structures, structure.name);
    sum.build_ms += structure.build_ms;
    sum.bytes = structure.bytes;
    sum.elements = structure.elements;
    sum.of_vpls = structure.of_vpls;
  }
}

std::string stats_table(const RenderStats& stats, int frames) {
  std::uint64_t rays = 0;
  std::string text = fmt::format("{:<28}{:>12}{:>15}{:>12}\n", "pass", "ms", "rays", "Mrays/s");
  for (const PassStats& pass : stats.passes) {
    text += pass_line(pass.name, pass.ms, pass.rays);
    rays += pass.rays;
  }
  text += pass_line("total", stats.total_ms, rays);
  text += fmt::format("\n{:<28}{:>12}{:>15}{:>12}\n", "structure", "build ms", "bytes", "bytes/light");
  std::uint64_t vpls = 0;
  for (const StructureStats& structure : stats.structures) {
    if (structure.name == kAccelerationStructure) text += structure_line(structure, 0);
    if (structure.of_vpls) vpls = std::max(vpls, structure.elements);
  }
  text += structure_lines(stats, false, stats.emitters, "all that serve lights");
  text += structure_lines(stats, true, vpls, "all that serve VPLs");
  text += fmt::format("\n{} emitters, {} spp, peak memory {:.1f} MB\n", stats.emitters, stats.spp_done,
                      peak_megabytes());
  if (frames > 1)
    text += fmt::format("times and rays are sums over {} frames; sizes are those of the last one\n", frames);
  return text;
}

}  // namespace lumigrove
