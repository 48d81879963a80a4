// Small comparisons with pictures of known colours, for tests of the report.
#pragma once

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <string>

#include "lumigrove/image.h"
#include "results.h"

namespace lumigrove::fixtures {

inline constexpr int kWidth = 160, kHeight = 90;
inline constexpr int kSquareX = 112, kSquareY = 24, kSquareSide = 16;  // white of 2 in every picture

// Linear colours of the plain parts. "dark" is half the reference, "same" the reference, "red" wrong everywhere.
inline constexpr std::array<float, 3> kReferenceColor = {0.2f, 0.4f, 0.1f};
inline constexpr std::array<std::array<float, 3>, 3> kMethodColors = {
    {{0.1f, 0.2f, 0.05f}, {0.2f, 0.4f, 0.1f}, {0.8f, 0.1f, 0.1f}}};
inline constexpr std::array<const char*, 3> kMethodNames = {"dark", "same", "red"};

// `gain` multiplies the plain part.
inline void write_picture_of(const std::filesystem::path& file, const std::array<float, 3>& color, float gain) {
  Image image{kWidth, kHeight, {{"", {"R", "G", "B"}, {}, {}}}, {}};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool inside = x >= kSquareX && x < kSquareX + kSquareSide && y >= kSquareY && y < kSquareY + kSquareSide;
      for (const float value : color) image.layers[0].values.push_back(inside ? 2 : gain * value);
    }
  write_image(image, file);
}

inline Results plain_results() {
  Results r;
  r.version = "0.1.0 (test)";
  r.date = "2026-01-01T00:00:00Z";
  r.command = "lumigrove compare scene.glb --methods dark,same,red --budget 1s";
  r.machine = {"a processor", "a system", 2, 4, 8e9};
  r.scene = "scene <of> \"tests\" & co";
  r.scene_hash = "0123456789abcdef";
  r.scene_summary = "12 triangles, 2 emitters";
  r.width = kWidth;
  r.height = kHeight;
  r.tone = "srgb";
  r.budget_s = 1;
  r.budget_spp = 4;
  r.seeds = 3;
  r.frames = {0};
  r.complete = true;
  for (const char* name : kMethodNames) {
    Contender method;
    method.name = name;
    method.description = fmt::format("The method {}.", name);
    method.light = "all light";
    method.estimator = method.name == "red" ? "biased" : "unbiased";
    method.why = method.name == "red" ? "it paints everything red" : "";
    method.settings = fmt::format("preset = \"{}\"\n", name);
    for (const Budget budget : kBudgets)
      method.commands[static_cast<std::size_t>(budget)] = fmt::format("lumigrove render scene.glb --preset {} --spp 4", name);
    r.methods.push_back(std::move(method));
  }
  return r;
}

// Frames from a multiple of ten are brighter by a tenth each; seeds differ by a hundredth.
inline float gain_of(int frame, int seed) {
  return (1 + 0.1f * static_cast<float>(frame % 10)) * (1 + 0.01f * static_cast<float>(seed));
}

inline void add_run(Results& r, const std::filesystem::path& folder, int method, int seed, int frame) {
  Run run;
  run.method = method;
  run.seed = seed;
  run.frame = frame;
  run.complete = true;
  run.build_ms = 2 + method;
  run.sample_ms = 100 + 10 * method;
  run.sample_low_ms = run.sample_ms - 2;
  run.sample_high_ms = run.sample_ms + 3;
  run.passes = {{"camera rays", 10, 14400}, {"shadow rays", 60, 57600}};
  run.structures = {{"perfect tree", run.build_ms, 4096}};
  const double error = std::array<double, 3>{0.15, 0.02, 0.4}[static_cast<std::size_t>(method)] * (1 + 0.02 * seed);
  for (const int spp : {1, 2, 4, 8}) run.curve.push_back({spp, 0.1 * spp, 7e4 * spp, error * std::sqrt(8.0 / spp), error * error * 8 / spp});
  for (const Budget budget : kBudgets) {
    const int spp = budget == Budget::kTime ? 8 : 4;
    const double scale = budget == Budget::kTime ? 1 : std::sqrt(2.0);
    Stage& stage = run.stages[static_cast<std::size_t>(budget)];
    stage = {spp, 0.1 * spp, 7e4 * spp, {error * scale, error * error * scale, 1 - error, error}, {}};
    stage.file = fmt::format("{}-{}-{}-{}.exr", kMethodNames[static_cast<std::size_t>(method)], seed, frame, budget_key(budget));
    // Equal samples are a little darker, so that pictures of the budgets can be told apart.
    const float gain = gain_of(frame, seed) * (budget == Budget::kTime ? 1.0f : 0.8f);
    write_picture_of(folder / stage.file, kMethodColors[static_cast<std::size_t>(method)], gain);
  }
  r.runs.push_back(std::move(run));
}

inline void add_reference(Results& r, const std::filesystem::path& folder, int frame) {
  const std::string file = fmt::format("reference-{}.exr", frame);
  write_picture_of(folder / file, kReferenceColor, gain_of(frame, 0));
  r.references.push_back({"all light", frame, file, "path, 1024 spp in two halves, 61 s", {0.004, 1e-5, 0.01, 0.003}});
}

// Everything there.
inline Results still(const std::filesystem::path& folder) {
  Results r = plain_results();
  add_reference(r, folder, 0);
  for (int method = 0; method < 3; ++method)
    for (int seed = 0; seed < 3; ++seed) add_run(r, folder, method, seed, 0);
  return r;
}

// Three frames.
inline Results sequence(const std::filesystem::path& folder) {
  Results r = plain_results();
  r.frames = {10, 11, 12};
  r.fps = 24;
  r.seeds = 2;
  for (const int frame : r.frames) {
    add_reference(r, folder, frame);
    for (int method = 0; method < 3; ++method)
      for (int seed = 0; seed < 2; ++seed) {
        add_run(r, folder, method, seed, frame);
        if (frame == r.frames.front()) continue;
        for (const Budget budget : kBudgets)
          r.changes.push_back({method, seed, frame, budget, 0.01 * (method + 1), 0.002 * (method + 1 + 0.1 * seed)});
      }
  }
  return r;
}

// Interrupted: one seed, a method that failed, one that was not reached, a file that is gone.
inline Results partial(const std::filesystem::path& folder) {
  Results r = plain_results();
  r.complete = false;
  r.methods[2].failure = "it needs a light that the scene does not have";
  add_reference(r, folder, 0);
  add_run(r, folder, 0, 0, 0);
  std::filesystem::remove(folder / r.runs[0].stage(Budget::kSamples).file);
  return r;
}

}  // namespace lumigrove::fixtures
