// lumigrove render SCENE -o FILE
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <filesystem>

#include "base/vec.h"
#include "checks.h"
#include "commands.h"
#include "devices.h"
#include "frame/value_text.h"
#include "logging.h"
#include "output.h"
#include "render_job.h"
#include "scene_options.h"
#include "sequence.h"
#include "setting_options.h"
#include "stats_table.h"
#include "view_options.h"

namespace lumigrove {
namespace {

struct RenderOptions {
  std::shared_ptr<SceneOptions> scene;
  std::shared_ptr<OutputOptions> output;
  std::shared_ptr<SettingOptions> settings;
  std::shared_ptr<ViewOptions> view;
  std::shared_ptr<LogOptions> log;
  std::string frames, time, fps = "24", progress = "auto", device = "cpu";
  bool skip_existing = false, stats = false, print_camera = false;
};

// One image to render.
struct Task {
  Settings settings;
  std::vector<std::string> files;
};

Task make_task(const RenderOptions& options, const Settings& settings, std::optional<int> frame) {
  Task task{settings, options.output->files};
  if (!frame) return task;
  task.settings.frame = *frame;
  task.settings.time = *frame / parse_double("--fps", options.fps, {0, 1e6, true});
  for (std::string& file : task.files) file = frame_file(file, *frame);
  return task;
}

std::vector<Task> make_tasks(const RenderOptions& options, const Settings& settings) {
  if (options.frames.empty()) return {make_task(options, settings, {})};
  std::vector<Task> tasks;
  for (const int frame : parse_frames(options.frames)) {
    Task task = make_task(options, settings, frame);
    const auto exists = [](const std::string& file) { return std::filesystem::exists(file); };
    const bool done = options.skip_existing && std::all_of(task.files.begin(), task.files.end(), exists);
    if (!done) tasks.push_back(std::move(task));
  }
  return tasks;
}

void warn_beyond_animation(const Scene& scene, const std::vector<Task>& tasks) {
  const double end = duration(scene);
  const double last = tasks.back().settings.time;
  constexpr double kRounding = 1e-6;
  if (end > 0 && last > end + kRounding)
    spdlog::warn("frames after {:.3f} s show the last pose, because the animation of '{}' ends there", end,
                 scene.name);
}

bool shines(const Scene& scene) {
  const auto is_bright = [](const PunctualLight& light) { return max_component(light.color) > 0; };
  const auto emits = [&](const Mesh& mesh) {
    return max_component(scene.materials[static_cast<std::size_t>(mesh.material)].emission) > 0;
  };
  return max_component(scene.environment.radiance) > 0 ||
         std::any_of(scene.lights.begin(), scene.lights.end(), is_bright) ||
         std::any_of(scene.meshes.begin(), scene.meshes.end(), emits);
}

// A black image without a word would leave its maker to search for the reason.
void warn_if_black(const Scene& scene) {
  if (scene.meshes.empty()) spdlog::warn("'{}' holds no triangles", scene.name);
  if (!shines(scene)) spdlog::warn("nothing in '{}' shines; --environment adds light", scene.name);
}

// Files first: no scene is loaded and nothing rendered for an output that cannot be written.
void check_outputs(const RenderOptions& options, const std::vector<Task>& tasks) {
  if (options.output->files.empty()) throw CLI::RequiredError("-o,--output");
  require_distinct(options.output->files);
  for (const Task& task : tasks)
    for (const std::string& file : task.files) require_writable(file);
}

void render_tasks(const RenderOptions& options, const Scene& scene, std::vector<Task>& tasks) {
  const InterruptGuard guard;
  RenderStats total;
  {
    const ProgressStyle style = options.log->quiet ? ProgressStyle::kSilent : progress_style(options.progress);
    ProgressPrinter progress(style, static_cast<int>(tasks.size()));
    Receipt receipt = make_receipt(scene, options.scene->full_name());
    receipt.environment = options.scene->environment;
    History history;
    for (Task& task : tasks) {
      apply_view_options(*options.view, scene, task.settings);
      const Image image = render_frame(scene, task.settings, receipt, progress, guard, &history);
      progress.end_line();
      write_files(image, task.files, options.output->tone(), receipt, options.log->quiet);
      accumulate(total, receipt.stats);
      if (guard.interrupted()) break;
    }
  }
  if (options.stats) fmt::print("{}", stats_table(total, static_cast<int>(tasks.size())));
  if (!guard.interrupted()) return;
  spdlog::warn("interrupted; the last image holds {} of {} samples a pixel", total.spp_done,
               tasks[0].settings.spp);
  throw ExitCode{guard.exit_status()};
}

void run(const RenderOptions& options) {
  start_logging(*options.log);
  require_device(options.device);
  Settings settings = make_settings(*options.settings);
  if (!options.time.empty()) set_value(settings, "time", options.time);
  std::vector<Task> tasks = make_tasks(options, settings);
  if (!options.print_camera) check_outputs(options, tasks);
  if (tasks.empty()) {
    spdlog::info("every frame exists already");
    return;
  }
  const Scene scene = open_scene(options.scene->full_name(), options.scene->environment);
  if (options.print_camera) {
    apply_view_options(*options.view, scene, tasks[0].settings);
    fmt::print("{}\n", camera_as_options(scene, tasks[0].settings));
    return;
  }
  warn_if_black(scene);
  warn_beyond_animation(scene, tasks);
  render_tasks(options, scene, tasks);
}

// Needs no scene, hence ends the program before the scene is asked for.
void print_devices_and_exit() {
  fmt::print("{}", device_list());
  throw ExitCode{0};
}

void add_time_options(CLI::App& command, RenderOptions& options) {
  auto* time = command.add_option("--time", options.time, "Moment of the animation (s, default 0)");
  time->type_name("SECONDS")->check(not_empty());
  auto* frames =
      command.add_option("--frames", options.frames,
                         "Render frames A to B, every S-th: A, A-B or A-BxS; frame f shows the time f / fps "
                         "and its number goes into the file name: out.####.exr, out_%04d.exr, or before "
                         "the extension");
  frames->type_name("A-BxS")->check(not_empty())->excludes(time);
  command.add_option("--fps", options.fps, "Frames a second of --frames (default 24)")
      ->type_name("N")
      ->needs(frames);
  command.add_flag("--skip-existing", options.skip_existing, "Leave out frames whose files exist")
      ->needs(frames);
}

}  // namespace

void add_render_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("render", "Render a scene to image files");
  auto options = std::make_shared<RenderOptions>();
  options->scene = add_scene_options(*command);
  options->output = add_output_options(*command);
  add_time_options(*command, *options);
  options->settings = add_setting_options(*command);
  options->view = add_view_options(*command);
  command->add_flag("--print-camera", options->print_camera, "Print the camera as options and exit")
      ->group("View");
  command->add_option("--device", options->device, "Where to render, one of `list devices` (default cpu)");
  command->add_flag_callback("--list-devices", print_devices_and_exit, "List devices and exit");
  add_stats_option(*command, options->stats);
  add_progress_option(*command, options->progress);
  options->log = add_log_options(*command);
  command->callback([options] { run(*options); });
}

}  // namespace lumigrove
