// What a comparison measured: the contents of results.json, from which the report is made. Units are in the names or
// beside them; NaN: not measured, or not defined (null in the file).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "metrics/metrics.h"

namespace lumigrove {

inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

// One value for each row of metrics(), in that order.
using Errors = std::array<double, 4>;
inline constexpr Errors kNoErrors = {kNotMeasured, kNotMeasured, kNotMeasured, kNotMeasured};

// What a run is stopped at to be looked at: every method has had the same time, or the same number of camera samples.
enum class Budget : std::uint8_t { kTime, kSamples };
inline constexpr std::array<Budget, 2> kBudgets = {Budget::kTime, Budget::kSamples};
const char* budget_key(Budget budget);    // "time", "samples"; in file names and JSON
const char* budget_label(Budget budget);  // "equal time", "equal samples"

// One moment of a run. Seconds are the method's own: building its structures over lights, and camera samples.
struct CurvePoint {
  int spp = 0;  // camera samples a pixel
  double seconds = 0;
  double rays = 0;
  double rmse = kNotMeasured, rel_mse = kNotMeasured;
};

// A run at a budget.
struct Stage {
  int spp = 0;  // 0: never reached
  double seconds = 0;
  double rays = 0;
  Errors errors = kNoErrors;
  std::string file;  // EXR, relative to the folder of the results
};

struct PassTime {
  std::string name;
  double ms = 0;    // wall time of one camera sample
  double rays = 0;  // of one camera sample
};

struct StructureSize {
  std::string name;
  double build_ms = 0;
  double bytes = 0;
};

// One method with one seed in one frame.
struct Run {
  int method = 0;  // index into Results::methods
  int seed = 0;    // number of the seed from 0; the settings' seed is added to it
  int frame = 0;   // number of the frame as Results::frames lists it
  bool complete = false;  // reached both budgets
  double build_ms = 0;    // structures over the scene's lights, built once
  double sample_ms = 0, sample_low_ms = 0, sample_high_ms = 0;  // one camera sample: median, quartiles
  std::vector<PassTime> passes;
  std::vector<StructureSize> structures;  // without the acceleration structure, which all methods share
  std::vector<CurvePoint> curve;          // at 1, 2, 4, ... samples and at the budgets, in the order of samples
  std::array<Stage, 2> stages;            // by Budget
  const Stage& stage(Budget budget) const { return stages[static_cast<std::size_t>(budget)]; }
};

struct Contender {
  std::string name;         // as --methods named it: "tree", "tree:direct.spp=4"; unique
  std::string description, citation;  // of the preset
  std::string light;        // what it is measured on: "all light", "direct light", or the layer asked for
  std::string estimator;    // "unbiased", "consistent" or "biased"
  std::string why;          // for the label; may be empty
  std::string settings;     // TOML
  std::array<std::string, 2> commands;  // reproduces the picture of the first seed and frame, by Budget
  std::string failure;      // why there is nothing to show; empty when there is
};

// What the errors of one group of methods, in one frame, are measured against.
struct Reference {
  std::string light;   // as Contender::light
  int frame = 0;
  std::string file;    // EXR of one beauty layer, relative to the folder; what "light" says
  std::string origin;  // "path, 1024 spp in two halves, 61 s", or the file that was given
  Errors errors = kNoErrors;  // its own, estimated; NaN: unknown. SSIM: how far below 1
};

// Between two neighbouring frames of one run, on tone-mapped sRGB in [0,1]; a the method, r the reference.
struct FrameChange {
  int method = 0, seed = 0, frame = 0;  // the later one
  Budget budget = Budget::kTime;
  double error = kNotMeasured;    // mean |(a' - a) - (r' - r)|
  double flicker = kNotMeasured;  // mean |a' - a| - mean |r' - r|
};

struct Machine {
  std::string processor, system;
  int cores = 0, threads = 0;
  double memory_bytes = 0;
};

struct Results {
  std::string version;  // of the program
  std::string date;     // UTC, ISO 8601, of the start
  std::string command;  // that made this
  Machine machine;
  std::string scene, scene_hash, environment;
  std::string scene_summary;  // "211,000 triangles, 100,000 emitters"
  int width = 0, height = 0;
  double exposure_ev = 0;     // before SSIM, FLIP and pictures
  std::string tone = "filmic";
  double pixels_per_degree = kPixelsPerDegree;
  double budget_s = 0;        // equal time
  int budget_spp = 0;         // equal samples
  int seeds = 0;
  std::uint32_t first_seed = 0;
  std::vector<int> frames;    // at least one
  double fps = 0;             // of a sequence
  bool complete = false;      // false: interrupted; the rest can be resumed
  std::vector<Contender> methods;
  std::vector<Reference> references;
  std::vector<Run> runs;
  std::vector<FrameChange> changes;
};

// results.json in `folder`: written atomically; reading throws Error naming the file and what is wrong with it.
void write_results(const Results& results, const std::filesystem::path& folder);
Results read_results(const std::filesystem::path& folder);

}  // namespace lumigrove
