// What `lumigrove tree` prints, as text or JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "frame/explain.h"
#include "methods/substitute_tree/substitute_tree_statistics.h"

namespace lumigrove {

struct TreeReport {
  std::string scene, preset;
  int width = 0, height = 0;
  SubstituteTreeStatistics tree;
  WalkStatistics walks;
  float diagonal = 1;           // D, metres
  float substitute_offset = 0;  // metres
  std::size_t tree_bytes = 0, vpl_bytes = 0;
  double trace_ms = 0, build_ms = 0;
};
std::string tree_report_text(const TreeReport& report);
std::string tree_report_json(const TreeReport& report);

struct PixelReport {
  int x = 0, y = 0;
  Surface surface;
  Lobes lobe = Lobes::kDiffuse;
  float lobe_probability = 1;  // with which an image lights this lobe here
  ExplainedWalk walk;
  TrueLight truth;
  std::optional<SampleSummary> samples;
  std::vector<std::string> left_out;  // settings that add light of which the report says nothing
};
std::string pixel_report_text(const PixelReport& report);
std::string pixel_report_json(const PixelReport& report);

}  // namespace lumigrove
