// lumigrove audit SCENE: holds the light samplers of the methods to their word on a scene.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdio>
#include <set>

#include "audit_text.h"
#include "base/stopwatch.h"
#include "checks.h"
#include "commands.h"
#include "frame/audit_points.h"
#include "frame/audit_samplers.h"
#include "lights/emitter.h"
#include "logging.h"
#include "render_job.h"
#include "scene_options.h"
#include "setting_options.h"
#include "view_options.h"

namespace lumigrove {
namespace {

constexpr int kClaimBroken = 3;
// Unless asked for: that many points, but fewer where they would weigh too many lights; and never more than fit memory.
constexpr int kPoints = 64, kLeastPoints = 4;
constexpr std::uint64_t kMostWeighed = 1u << 23, kMostKept = 1u << 27;

struct AuditCommandOptions {
  std::shared_ptr<SceneOptions> scene;
  std::shared_ptr<SettingOptions> settings;
  std::shared_ptr<ViewOptions> view;
  std::shared_ptr<LogOptions> log;
  std::vector<std::string> methods;
  std::string time;
  int points = 0;  // 0: as many as is sensible
  AuditOptions audit;
  bool json = false;
};

// --- what is audited -----------------------------------------------------------------------------------------

// One sampler, and the methods that have it.
struct AuditedMethod {
  std::vector<std::string> presets;
  Settings settings;
  bool vpls = false;  // the one of indirect light
};

// Settings that differ where samplers do.
std::string sampler_key(const Settings& settings, bool vpls) {
  std::string key;
  const bool joint = settings.indirect.joint;
  for (const SettingInfo& info : settings_table()) {
    const bool direct = info.key.starts_with("direct.") && info.key != "direct.mis";
    const bool indirect = info.key.starts_with("indirect.");
    if (vpls ? indirect : direct || (joint && indirect)) key += get_value(settings, info.key) + ' ';
  }
  return key;
}

std::vector<std::string> names_of_methods(const AuditCommandOptions& options) {
  if (!options.methods.empty()) return options.methods;
  if (!options.settings->preset.empty()) return {options.settings->preset};
  if (gives(*options.settings, "preset")) return {""};
  std::vector<std::string> names;
  for (const PresetInfo& preset : presets()) names.push_back(preset.name);
  return names;
}

class MethodList {
 public:
  explicit MethodList(const AuditCommandOptions& options) : options_(options) {
    const std::vector<std::string> names = names_of_methods(options);
    const bool chosen = names.size() < presets().size() || !options.methods.empty();
    for (const std::string& name : names) {
      try {
        add(name);
      } catch (const Error& error) {
        if (chosen) throw;
        notes.push_back(fmt::format("Left out: {}: {}.", name, error.what()));
      }
    }
    if (methods.empty())
      throw Error(notes.empty() ? fmt::format("{} draws no lights: it sums over all of them", fmt::join(names, ", "))
                                : "no method can be audited with these settings: " + notes.front());
  }

  std::vector<AuditedMethod> methods;
  std::vector<std::string> notes;

 private:
  void add(const std::string& name) {
    SettingOptions given = *options_.settings;
    given.preset = name;
    Settings settings = make_settings(given);
    if (!options_.time.empty()) set_value(settings, "time", options_.time);
    if (settings.direct.selection != Selection::kAll) add_sampler(settings, false);
    const IndirectSettings& indirect = settings.indirect;
    if (indirect.transport == Transport::kVpl && !indirect.joint && indirect.selection != Selection::kAll)
      add_sampler(settings, true);
  }

  void add_sampler(const Settings& settings, bool vpls) {
    const std::string key = sampler_key(settings, vpls);
    for (AuditedMethod& method : methods)
      if (method.vpls == vpls && sampler_key(method.settings, vpls) == key) {
        method.presets.push_back(settings.preset);
        return;
      }
    methods.push_back({{settings.preset}, settings, vpls});
  }

  const AuditCommandOptions& options_;
};

// --- the work ------------------------------------------------------------------------------------------------

int number_of_points(const AuditCommandOptions& options, std::uint64_t lights, std::vector<std::string>& notes) {
  const std::uint64_t fit = std::max<std::uint64_t>(1, kMostKept / std::max<std::uint64_t>(1, lights));
  if (options.points > 0) {
    if (static_cast<std::uint64_t>(options.points) <= fit) return options.points;
    throw Error(fmt::format("--points {} is too many: what {} lights send to each does not fit memory; at most {} are "
                            "possible",
                            options.points, lights, fit));
  }
  const std::uint64_t sensible = std::max<std::uint64_t>(kLeastPoints, kMostWeighed / std::max<std::uint64_t>(1, lights));
  if (sensible >= kPoints) return kPoints;
  notes.push_back(fmt::format("{} points instead of {}, because each of them weighs {} lights for every sampler; --points "
                              "asks for more.",
                              sensible, kPoints, lights));
  return static_cast<int>(sensible);
}

void add_never_found(const AuditedSampler& sampler, const AuditRow& row, AuditReport& report) {
  for (std::uint32_t light = 0; light < row.reached.size(); ++light) {
    if (row.reached[light]) continue;
    if (report.never_found_count++ < kNamedLights) report.never_found.push_back(sampler.describe(light));
  }
}

class Auditor {
 public:
  Auditor(const AuditCommandOptions& options, const Scene& scene, Settings settings, AuditReport& report)
      : scene_(scene), report_(report), world_(make_world(scene, settings_of_audited_world(settings), stats_)) {
    const std::uint32_t lights = light_count(world_->lights.view());
    report.emitters = lights;
    if (lights == 0) throw Error(fmt::format("nothing shines in '{}', so that there is no sampler to audit", scene.name));
    report.points = make_audit_points(*world_, settings, number_of_points(options, lights, report.notes));
    if (report.points.empty())
      throw Error(fmt::format("'{}' has no surface that a light could shine at", scene.name));
    cache_ = std::make_shared<LightCache>(report.points.size());
  }

  void audit(const AuditedMethod& method) {
    const Stopwatch watch;
    const std::string name = fmt::format("{}{}", fmt::join(method.presets, ", "), method.vpls ? " (VPLs)" : "");
    const Settings settings = settings_of_audited_world(method.settings);
    build_lights(*world_, settings, stats_);
    trace_vpls(*world_, settings, 0, stats_);
    const bool of_vpls = method.vpls || settings.indirect.joint;
    if (of_vpls && world_->vpls.view().vpls.empty()) {
      report_.notes.push_back(fmt::format("Left out: {}: no light leaves virtual point lights.", name));
      return;
    }
    const auto cache = of_vpls ? std::make_shared<LightCache>(report_.points.size()) : cache_;
    const AuditedSampler sampler = method.vpls ? audit_of_vpls(scene_, *world_, settings, name, cache)
                                               : audit_of_direct(scene_, *world_, settings, name, cache);
    report_.rows.push_back(audit_sampler(sampler, report_.points, report_.options));
    report_.methods.push_back(method.presets);
    if (!of_vpls && !std::exchange(knows_reached_, true)) add_never_found(sampler, report_.rows.back(), report_);
    spdlog::info("{}: {:.0f} ms", name, watch.ms());
  }

 private:
  const Scene& scene_;
  AuditReport& report_;
  RenderStats stats_;
  std::unique_ptr<World> world_;
  std::shared_ptr<LightCache> cache_;
  bool knows_reached_ = false;
};

void print_audit(const AuditReport& report, bool json) {
  fmt::print("{}", json ? audit_json(report) : audit_text(report));
  std::fflush(stdout);
  for (const AuditRow& row : report.rows)
    for (const std::string& failure : row.failures) fmt::print(stderr, "lumigrove: {}\n", failure);
  if (!report.holds()) throw ExitCode{kClaimBroken};
}

void run(const AuditCommandOptions& options) {
  start_logging(*options.log);
  MethodList list(options);
  const Scene scene = open_scene(options.scene->full_name(), options.scene->environment);
  for (AuditedMethod& method : list.methods) apply_view_options(*options.view, scene, method.settings);
  const Settings& first = list.methods.front().settings;
  std::unique_ptr<tbb::global_control> limit;
  if (first.threads > 0)
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(first.threads));
  AuditReport report;
  report.scene = scene.name;
  report.options = options.audit;
  report.options.seed = first.seed;
  report.notes = list.notes;
  Auditor auditor(options, scene, first, report);
  for (const AuditedMethod& method : list.methods) auditor.audit(method);
  judge(report.rows, report.points, report.options);
  print_audit(report, options.json);
}

}  // namespace

void add_audit_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("audit", "Hold the light samplers of all methods to their word on a scene");
  auto options = std::make_shared<AuditCommandOptions>();
  options->scene = add_scene_options(*command);
  command->add_option("--methods", options->methods, "Methods of `list methods`, separated by commas (default all)")
      ->delimiter(',')
      ->check(not_empty())
      ->allow_extra_args(false)
      ->type_name("A,B,...");
  command
      ->add_option("--points", options->points,
                   "Points of the scene, half seen by the camera, half anywhere (default 64; fewer where there are very "
                   "many lights)")
      ->type_name("N")
      ->check(CLI::Range(1, 1 << 16));
  command->add_option("--draws", options->audit.draws, "Lights drawn at each point by each sampler (default 32768)")
      ->type_name("N")
      ->check(CLI::Range(64, 1 << 24));
  command
      ->add_option("--significance", options->audit.significance,
                   "Probability that honest samplers fail, all tests together (default 0.001)")
      ->type_name("P")
      ->check(number_in(1e-12, 0.5));
  command->add_flag("--json", options->json, "Print JSON instead of a table");
  command->add_option("--time", options->time, "Moment of the animation (s, default 0)")->type_name("SECONDS");
  options->settings = add_setting_options(*command);
  command->get_option("--preset")->description("Audit one method only")->excludes("--methods");
  options->view = add_view_options(*command);
  options->log = add_log_options(*command);
  command->footer("Exit status: 0 every claim holds, 1 error, 2 wrong usage, 3 a claim is broken.");
  command->callback([options] { run(*options); });
}

}  // namespace lumigrove
