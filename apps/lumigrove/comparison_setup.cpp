#include "comparison_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "contestant.h"
#include "frame/estimator.h"
#include "frame/receipt.h"
#include "machine.h"
#include "shell.h"

namespace lumigrove {
namespace {

bool is_alphanumeric(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

Contender describe_method(const ComparisonJob& job, const ComparedMethod& method) {
  Contender result;
  result.name = method.spec.name;
  for (const PresetInfo& preset : presets()) {
    if (preset.name != method.settings.preset) continue;
    result.description = preset.description;
    result.citation = preset.citation;
  }
  result.light = measured_light(job, method.settings);
  const EstimatorLabel label = estimator_label(method.settings);
  result.estimator = bias_name(label.kind);
  result.why = label.reason;
  result.settings = to_toml(method.settings);
  result.failure = method.failure;
  return result;
}

}  // namespace

std::string measured_light(const ComparisonJob& job, const Settings& settings) {
  if (!job.layer.empty()) return job.layer;
  return settings.indirect.transport == Transport::kNone ? kDirectLight : kAllLight;
}

std::string slug(const std::string& name) {
  std::string text;
  for (const char c : name) text += is_alphanumeric(c) || c == '.' || c == '-' ? c : '_';
  return text;
}

Settings settings_at(const ComparisonJob& job, const Scene& scene, Settings settings, int frame) {
  if (!job.frames.empty()) {
    settings.frame = frame;
    settings.time = frame / job.fps;
  }
  apply_view_options(job.view, scene, settings);
  return settings;
}

std::string render_command(const ComparisonJob& job, Settings settings, int spp, const std::string& file) {
  settings.spp = spp;
  settings.threads = 0;  // changes no pixel
  std::string command = "lumigrove render " + shell_quoted(job.scene);
  if (!job.environment.empty()) command += " --environment " + shell_quoted(job.environment);
  for (const auto& [key, value] : parse_settings(to_toml(settings), "settings"))
    command += key == "preset" ? " --preset " + value : " --set " + shell_quoted(key + "=" + value);
  return command + " -o " + shell_quoted(file);
}

Results describe_job(const ComparisonJob& job, const Scene& scene) {
  const Settings& any = job.methods.front().settings;
  Results r;
  r.version = version_text();
  r.date = utc_now();
  r.command = job.command;
  r.machine = this_machine(any.threads);
  r.scene = job.scene;
  r.scene_hash = content_hash(scene);
  r.environment = job.environment;
  r.width = any.width;
  r.height = any.height;
  r.exposure_ev = static_cast<double>(job.metrics.tone.exposure_ev);
  r.tone = job.tone;
  r.pixels_per_degree = static_cast<double>(job.metrics.pixels_per_degree);
  r.budget_s = job.budget.seconds;
  r.budget_spp = job.budget.spp;
  r.seeds = job.seeds;
  r.first_seed = static_cast<int>(any.seed);
  r.frames = job.frames.empty() ? std::vector<int>{any.frame} : job.frames;
  r.fps = job.frames.empty() ? 0 : job.fps;
  for (const ComparedMethod& method : job.methods) r.methods.push_back(describe_method(job, method));
  return r;
}

void take_up(Results& now, Results old, const std::string& folder) {
  const auto same = [&](const char* what, const auto& was, const auto& is) {
    if (was != is) throw Error(fmt::format("{}: cannot be resumed: {} was '{}' and is '{}'", folder, what, was, is));
  };
  const bool measures_more = !old.complete || now.seeds > old.seeds;
  if (measures_more) {
    same("the program", old.version, now.version);
    same("the processor", old.machine.processor, now.machine.processor);
    same("the number of threads", old.machine.threads, now.machine.threads);
  }
  same("the scene's hash", old.scene_hash, now.scene_hash);
  same("the environment", old.environment, now.environment);
  same("the width", old.width, now.width);
  same("the height", old.height, now.height);
  same("the exposure", old.exposure_ev, now.exposure_ev);
  same("the tone curve", old.tone, now.tone);
  same("the resolution of FLIP", old.pixels_per_degree, now.pixels_per_degree);
  same("the first seed", old.first_seed, now.first_seed);
  same("the number of frames", old.frames.size(), now.frames.size());
  same("the first frame", old.frames.front(), now.frames.front());
  same("the last frame", old.frames.back(), now.frames.back());
  same("the number of frames a second", old.fps, now.fps);
  same("the number of methods", old.methods.size(), now.methods.size());
  for (std::size_t i = 0; i < old.methods.size(); ++i) {
    same("a method", old.methods[i].name, now.methods[i].name);
    same("the settings of a method", old.methods[i].settings, now.methods[i].settings);
    same("the light of a method", old.methods[i].light, now.methods[i].light);
    now.methods[i].commands = old.methods[i].commands;
    if (!measures_more) now.methods[i].failure = old.methods[i].failure;  // else it may try again
  }
  if (now.budget_s > 0) same("the budget of seconds", old.budget_s, now.budget_s);
  if (now.budget_spp > 0) same("the budget of samples", old.budget_spp, now.budget_spp);
  now.date = old.date;
  now.version = old.version;
  now.machine = old.machine;
  now.command = old.command;
  now.seeds = std::max(now.seeds, old.seeds);
  now.budget_s = old.budget_s;
  now.budget_spp = old.budget_spp;
  now.scene_summary = old.scene_summary;
  now.references = std::move(old.references);
  now.runs = std::move(old.runs);
  std::erase_if(now.runs, [](const Run& run) { return !run.complete; });
}

}  // namespace lumigrove
