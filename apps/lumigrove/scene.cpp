// lumigrove scene info|list|export
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>

#include "commands.h"
#include "frame/camera.h"
#include "logging.h"
#include "output.h"
#include "render_job.h"
#include "scene_info.h"
#include "scene_options.h"
#include "setting_options.h"

namespace lumigrove {
namespace {

// --- info
// ------------------------------------------------------------------------------------------------------

struct InfoOptions {
  std::shared_ptr<SceneOptions> scene;
  std::shared_ptr<LogOptions> log;
  double time = 0;
  bool json = false;
};

void run_info(const InfoOptions& options) {
  start_logging(*options.log);
  const Scene scene = open_scene(options.scene->full_name(), options.scene->environment);
  const SceneInfo info = describe_scene(scene, options.time);
  fmt::print("{}", options.json ? info_json(info) : info_text(info));
}

void add_info(CLI::App& scene) {
  CLI::App* command = scene.add_subcommand("info", "Counts, bounds, cameras, emitters and their flux");
  auto options = std::make_shared<InfoOptions>();
  options->scene = add_scene_options(*command);
  command->add_option("--time", options->time, "Moment of the animation (s, default 0)")
      ->type_name("SECONDS");
  command->add_flag("--json", options->json, "Print JSON");
  options->log = add_log_options(*command);
  command->callback([options] { run_info(*options); });
}

// --- export
// ----------------------------------------------------------------------------------------------------

struct ExportOptions {
  std::shared_ptr<SceneOptions> scene;
  std::shared_ptr<LogOptions> log;
  std::string file, camera;
  std::vector<std::string> size = {"1280", "720"};
  double time = 0;
  int spp = 64;
  bool force_diffuse = false;
};

// Number of the camera in node order; -1 when the scene has none.
int camera_index(const Scene& scene, const SceneState& state, const std::string& name) {
  const CameraInstance wanted = find_camera(scene, state, name);
  for (std::size_t i = 0; i < state.cameras.size(); ++i)
    if (state.cameras[i].node == wanted.node) return static_cast<int>(i);
  return -1;
}

// Writes the file; returns a sentence for each thing that the format cannot hold.
std::vector<std::string> export_scene(const ExportOptions& options, const Scene& scene) {
  if (lower_extension(options.file) != ".pbrt") return export_gltf(scene, options.file);
  Settings settings;
  set_value(settings, "width", options.size.at(0));
  set_value(settings, "height", options.size.at(1));
  check(settings);
  const SceneState state = evaluate(scene, options.time);
  return export_pbrt(scene, options.time, camera_index(scene, state, options.camera), settings.width,
                     settings.height, options.spp, options.file, options.force_diffuse);
}

void run_export(const ExportOptions& options) {
  start_logging(*options.log);
  require_writable(options.file, {".glb", ".gltf", ".pbrt"});
  const Scene scene = open_scene(options.scene->full_name(), options.scene->environment);
  for (const std::string& loss : export_scene(options, scene)) spdlog::warn("{}", loss);
  if (!options.log->quiet) fmt::print("wrote {}\n", options.file);
}

void add_export(CLI::App& scene) {
  CLI::App* command = scene.add_subcommand("export", "Write a scene as .glb, .gltf or .pbrt (pbrt-v4)");
  auto options = std::make_shared<ExportOptions>();
  options->scene = add_scene_options(*command);
  command
      ->add_option("-o,--output,--outfile", options->file,
                   "File to write; meshes and textures of .pbrt go to a folder beside it")
      ->required()
      ->type_name("FILE");
  command->add_option("--time", options->time, "Moment to write, .pbrt only (s, default 0)")
      ->type_name("SECONDS");
  command->add_option("--camera", options->camera, "Camera by name, .pbrt only (default the first)")
      ->type_name("NAME");
  command->add_option("--spp", options->spp, "Samples a pixel, .pbrt only (default 64)")
      ->check(CLI::Range(1, 1 << 24))
      ->type_name("N");
  const auto set_size = [options](const std::vector<std::string>& size) { options->size = size; };
  add_list_option(*command, "--size", 2, 'x', "W H", set_size,
                  "Width and height, also as WxH, .pbrt only (pixels, default 1280x720)");
  command->add_flag("--force-diffuse", options->force_diffuse,
                    "Write every material as diffuse, .pbrt only: pbrt's specular lobes differ from ours");
  options->log = add_log_options(*command);
  command->callback([options] { run_export(*options); });
}

void run_list() {
  for (const BuiltinScene& scene : builtin_scenes()) fmt::print("{:<16}{}\n", scene.name, scene.description);
}

}  // namespace

void add_scene_command(CLI::App& app) {
  CLI::App* scene = app.add_subcommand("scene", "Look into scenes and convert them");
  scene->require_subcommand(1);
  add_info(*scene);
  add_export(*scene);
  scene->add_subcommand("list", "Built-in scenes")->callback(run_list);
}

}  // namespace lumigrove
