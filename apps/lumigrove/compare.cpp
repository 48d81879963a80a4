// lumigrove compare: methods on a scene, or images against a reference.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "checks.h"
#include "commands.h"
#include "comparison.h"
#include "frame/value_text.h"
#include "image_comparison.h"
#include "interrupt.h"
#include "logging.h"
#include "output.h"
#include "page.h"
#include "render_job.h"
#include "scene_options.h"
#include "sequence.h"
#include "setting_options.h"
#include "summary.h"
#include "summary_tables.h"
#include "view_options.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

struct CompareOptions {
  ImageComparison images;  // whose `images` are the command's words: image files, or one scene
  std::vector<std::string> methods, budget, reference_budget;
  std::string reference_method, seeds = "4", frames, fps = "24", time, progress = "auto";
  std::string command;  // line of it
  bool resume = false, force = false;
  std::shared_ptr<SceneOptions> scene = std::make_shared<SceneOptions>();
  std::shared_ptr<SettingOptions> settings;
  std::shared_ptr<ViewOptions> view;
  std::shared_ptr<LogOptions> log;
};

// --- methods on a scene ------------------------------------------------------------------------------------------

// Settings that all have are given like those of `render`, but for what a comparison decides itself.
void check_common_settings(const SettingOptions& given) {
  if (!given.preset.empty()) throw Error("--preset has no place in a comparison; --methods names its methods");
  for (const auto& [key, value] : given.values)
    if (key == "spp") throw Error(fmt::format("--spp has no place in a comparison; write --budget {}spp", value));
  if (!given.crop_window.empty() || !given.pixel.empty())
    throw Error("a comparison measures whole images; leave --cropwindow, --pixelbounds and --pixel out");
}

bool is_of_method(const std::string& key) { return key.starts_with("direct.") || key.starts_with("indirect."); }

// What all methods share; for the reference.
SettingOptions without_methods(SettingOptions given) {
  std::erase_if(given.assignments, [](const std::string& assignment) { return is_of_method(assignment); });
  return given;
}

ComparedMethod make_method(const CompareOptions& options, const MethodSpec& spec, SettingOptions given) {
  ComparedMethod method{spec, make_preset(spec.preset), {}};
  given.preset = spec.preset;
  // The number of bounces is for those that have any.
  if (method.settings.indirect.transport == Transport::kNone)
    std::erase_if(given.values, [](const auto& value) { return value.first == "indirect.max_bounces"; });
  for (const auto& [key, value] : spec.values) given.assignments.push_back(key + "=" + value);
  try {
    method.settings = make_settings(given);
    if (!options.time.empty()) set_value(method.settings, "time", options.time);
  } catch (const Error& error) {
    method.failure = error.what();
  }
  return method;
}

std::string reference_preset() {
  for (const PresetInfo& preset : presets())
    if (preset.reference) return preset.name;
  throw std::logic_error("no preset is the reference");
}

bool finds_indirect(const ComparedMethod& method) {
  return method.failure.empty() && method.settings.indirect.transport != Transport::kNone;
}

// What the methods find is what the reference must find; more of it would only cost time.
void make_references(const CompareOptions& options, ComparisonJob& job) {
  const bool chosen = !options.reference_method.empty();
  for (const MethodSpec& spec : parse_methods({chosen ? options.reference_method : reference_preset()})) {
    ComparedMethod method = make_method(options, spec, without_methods(*options.settings));
    if (!method.failure.empty()) throw Error(fmt::format("--reference-method: {}", method.failure));
    job.reference_methods.push_back(std::move(method));
  }
  const bool wanted = std::any_of(job.methods.begin(), job.methods.end(), finds_indirect);
  if (!wanted && !chosen) job.reference_methods.front().settings.indirect.max_bounces = 0;
  if (wanted && std::none_of(job.reference_methods.begin(), job.reference_methods.end(), finds_indirect))
    throw Error(fmt::format("--reference-method {} finds direct light only, but a method that is compared finds more",
                            options.reference_method));
}

std::string default_folder(const std::string& scene) {
  const std::string stem = is_builtin_scene(scene) ? scene.substr(0, scene.find('?')) : fs::path(scene).stem().string();
  return "compare-" + stem;
}

ComparisonJob make_job(const CompareOptions& options) {
  if (options.images.images.size() != 1) throw Error("--methods compares methods on one scene; name one");
  check_common_settings(*options.settings);
  ComparisonJob job;
  options.scene->name = options.images.images.front();
  job.scene = options.scene->full_name();
  job.environment = options.scene->environment;
  for (const MethodSpec& spec : parse_methods(options.methods))
    job.methods.push_back(make_method(options, spec, *options.settings));
  job.budget = parse_budget("--budget", options.budget);
  if (!(job.budget.seconds > 0) && job.budget.spp < 1)
    throw Error("a comparison needs a --budget: a time or a number of samples, 10s or 64spp");
  job.seeds = static_cast<int>(parse_integer("--seeds", options.seeds, {1, 1000}));
  job.reference_file = options.images.reference;
  job.reference_budget = parse_budget("--reference-budget", options.reference_budget);
  if (job.reference_file.empty()) make_references(options, job);
  job.layer = options.images.layer;
  if (!options.frames.empty()) {
    job.frames = parse_frames(options.frames);
    job.fps = parse_double("--fps", options.fps, {0, 1e6, true});
  }
  job.view = *options.view;
  job.metrics = options.images.metrics;
  job.metrics.tone.curve = tone_curve_from_name(options.images.curve);
  job.tone = options.images.curve;
  job.folder = options.images.folder.empty() ? default_folder(job.scene) : options.images.folder;
  job.resume = options.resume;
  job.force = options.force;
  job.command = options.command;
  job.progress = options.log->quiet ? ProgressStyle::kSilent : progress_style(options.progress);
  return job;
}

// A method that cannot be rendered at all is a slip of the command line unless others remain.
void check_methods(const ComparisonJob& job) {
  const auto fails = [](const ComparedMethod& method) { return !method.failure.empty(); };
  if (std::all_of(job.methods.begin(), job.methods.end(), fails)) throw Error(job.methods.front().failure);
}

void print_results(const CompareOptions& options, const ComparisonJob& job, const Results& results) {
  if (options.images.json) {
    nlohmann::ordered_json json = {{"folder", job.folder.string()}, {"complete", results.complete}};
    for (const Budget budget : kBudgets) json[budget_key(budget)] = to_json(summary_table(results, budget));
    fmt::print("{}\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    return;
  }
  if (options.log->quiet) return;
  for (const Budget budget : kBudgets) fmt::print("{}\n", to_text(summary_table(results, budget)));
  fmt::print("{}\n", to_text(cost_table(results)));
  for (const std::string& sentence : cautions(results)) fmt::print("{}\n", sentence);
  fmt::print("wrote {}\n", (job.folder / "report.html").string());
}

void compare_methods(CompareOptions& options) {
  start_logging(*options.log);
  const ComparisonJob job = make_job(options);
  check_methods(job);
  const InterruptGuard guard;
  const Results results = run_comparison(job, guard);
  print_results(options, job, results);
  std::fflush(stdout);
  if (guard.interrupted()) throw ExitCode{guard.exit_status()};
}

// --- the command ---------------------------------------------------------------------------------------------------

bool is_image_file(const std::string& name) {
  const std::string extension = lower_extension(name);
  return std::find(kImageExtensions.begin(), kImageExtensions.end(), extension) != kImageExtensions.end();
}

// Without --methods it is about image files.
void compare_images(CompareOptions& options) {
  const std::vector<std::string>& words = options.images.images;
  if (words.size() == 1 && !is_image_file(words.front()) && (is_builtin_scene(words.front()) || options.images.reference.empty()))
    throw Error(fmt::format("{} is not an image; --methods tree,pool compares methods on a scene (see `lumigrove list methods`)",
                            words.front()));
  if (options.images.reference.empty()) throw CLI::RequiredError("-r,--reference");
  const auto refuse = [&](bool given, const char* option) {
    if (given) throw Error(fmt::format("{} is for comparing methods; give --methods too", option));
  };
  refuse(!options.budget.empty(), "--budget");
  refuse(!options.frames.empty(), "--frames");
  refuse(options.resume, "--resume");
  refuse(!options.reference_method.empty(), "--reference-method");
  refuse(!options.reference_budget.empty(), "--reference-budget");
  compare_image_files(options.images);
}

void run(CompareOptions& options) { options.methods.empty() ? compare_images(options) : compare_methods(options); }

constexpr const char* kMethods = "Methods";

void add_method_options(CLI::App& command, const std::shared_ptr<CompareOptions>& options) {
  const auto list = [&](const char* name, std::vector<std::string>& value, const char* type, const char* description) {
    command.add_option(name, value, description)->allow_extra_args(false)->type_name(type)->check(not_empty())->group(kMethods);
  };
  const auto text = [&](const char* name, std::string& value, const char* type, const char* description) {
    return command.add_option(name, value, description)->type_name(type)->check(not_empty())->group(kMethods);
  };
  list("--methods", options->methods, "A,B,...",
       "Methods of `list methods` to compare on the scene; tree:direct.spp=4 is one with another setting, four=tree:direct.spp=4 calls it so");
  list("--budget", options->budget, "10s|64spp",
       "Time and number of samples that every method has with every seed; of one alone the other follows");
  text("--seeds", options->seeds, "N", "Runs of every method, for 95 % intervals (default 4)");
  text("--reference-method", options->reference_method, "NAME[,NAME]",
       "What renders the reference (default path); a second one without indirect light that of direct light");
  list("--reference-budget", options->reference_budget, "60s|512spp",
       "Of the reference (default: as long as all methods together)");
  auto* frames = text("--frames", options->frames, "A-BxS", "Frames of a sequence to compare, each with its reference");
  text("--fps", options->fps, "N", "Frames a second of --frames (default 24)")->needs(frames);
  text("--time", options->time, "SECONDS", "Moment of the animation (s, default 0)")->excludes(frames);
  command.add_flag("--resume", options->resume, "Go on with the comparison in the folder, given the same options; more --seeds add to it")
      ->group(kMethods);
  command.add_flag("--force", options->force, "Replace the comparison in the folder")->group(kMethods);
}

void add_image_options(CLI::App& command, ImageComparison& images) {
  command.add_option("-r,--reference", images.reference, "The reference image; methods: instead of rendering one")
      ->check(not_empty())
      ->type_name("FILE");
  command.add_option("SCENE_OR_IMAGES,-t,--test", images.images, "Images to measure; with --methods, one scene")
      ->required()
      ->type_name("NAME");
  command
      .add_option("--layer", images.layer,
                  "Layer with R, G and B to compare, such as direct (default beauty; methods: what they find)")
      ->type_name("NAME");
  command
      .add_option("-o,--output", images.folder,
                  "Folder for pictures of the difference: NAME-signed.png (blue darker, red brighter), "
                  "NAME-absolute.png, NAME-flip.png; methods: for everything (default compare-SCENE)")
      ->check(not_empty())
      ->type_name("FOLDER");
  command.add_flag("--json", images.json, "Print JSON instead of a table");
}

void add_limits(CLI::App& command, ImageComparison& images) {
  command
      .add_option("--fail-above", images.fail_above,
                  "Exit with status 3 when rmse, relmse or flip of an image is above VALUE; may be repeated")
      ->allow_extra_args(false)
      ->type_name("METRIC=VALUE");
  command
      .add_option("--fail-below", images.fail_below,
                  "Exit with status 3 when ssim of an image is below VALUE; may be repeated")
      ->allow_extra_args(false)
      ->type_name("METRIC=VALUE");
}

void add_tone(CLI::App& command, ImageComparison& images) {
  command
      .add_option("--exposure", images.metrics.tone.exposure_ev,
                  "Exposure before SSIM, FLIP and pictures (EV, default 0; +1 doubles)")
      ->type_name("EV")
      ->check(number_in(-100, 100));
  command
      .add_option("--tone,--curve", images.curve, "Tone curve before SSIM, FLIP and pictures (default filmic)")
      ->check(CLI::IsMember({"filmic", "srgb"}));
  command
      .add_option("--pixels-per-degree", images.metrics.pixels_per_degree,
                  "Pixels in a degree of the viewer's visual angle, for FLIP (default 67.02)")
      ->type_name("N")
      ->check(number_in(1, 1000));
}

}  // namespace

void add_compare_command(CLI::App& app, const std::string& command_line) {
  CLI::App* command = app.add_subcommand(
      "compare", "Compare methods on a scene at equal time and equal samples, or images with a reference");
  auto options = std::make_shared<CompareOptions>();
  options->command = command_line;
  add_image_options(*command, options->images);
  add_tone(*command, options->images);
  add_limits(*command, options->images);
  add_method_options(*command, options);
  add_scene_parameters(*command, options->scene);
  options->settings = add_setting_options(*command, "--threads,--nthreads");
  options->view = add_view_options(*command);
  add_progress_option(*command, options->progress);
  options->log = add_log_options(*command);
  command->footer(
      "RMSE and relMSE are taken from linear RGB. Integer images are decoded from sRGB first; --tone srgb "
      "shows them as they are.\nExit status: 0 done, every limit kept, 1 error, 2 wrong usage, 3 a limit broken, 130 "
      "interrupted: the report then holds what was measured.");
  command->callback([options] { run(*options); });
}

}  // namespace lumigrove
