// lumigrove tree SCENE: the substitute tree of a frame, in numbers, at one pixel, as a file, or drawn over the image.
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <filesystem>

#include "base/atomic_file.h"
#include "commands.h"
#include "frame/explain.h"
#include "frame/overlay.h"
#include "frame/tree_export.h"
#include "image/difference.h"
#include "logging.h"
#include "output.h"
#include "render_job.h"
#include "scene_options.h"
#include "setting_options.h"
#include "tree_text.h"
#include "view_options.h"

namespace lumigrove {
namespace {

struct TreeOptions {
  std::shared_ptr<SceneOptions> scene;
  std::shared_ptr<SettingOptions> settings;
  std::shared_ptr<ViewOptions> view;
  std::shared_ptr<OutputOptions> output;
  std::shared_ptr<LogOptions> log;
  std::string time, overlay;
  std::vector<std::string> exports;
  int samples = 0;
  bool json = false, gloss = false;

  bool explains_pixel() const { return !settings->pixel.empty(); }
  bool prints_statistics() const { return !explains_pixel() && overlay.empty() && exports.empty(); }
};

Settings make_tree_settings(const TreeOptions& options) {
  SettingOptions given = *options.settings;
  if (given.preset.empty() && !gives(given, "preset")) given.preset = "sst";
  const bool sized = gives(given, "width") || gives(given, "height");
  if (options.prints_statistics() && !sized) {
    given.values.emplace_back("width", "320");  // enough surfaces for a share to two digits
    given.values.emplace_back("height", "180");
  }
  if (!options.overlay.empty() && !gives(given, "spp")) given.values.emplace_back("spp", "4");
  Settings settings = make_settings(given);
  if (!options.time.empty()) set_value(settings, "time", options.time);
  const IndirectSettings& indirect = settings.indirect;
  if (indirect.transport != Transport::kVpl || indirect.joint || indirect.selection != Selection::kRoot ||
      indirect.hierarchy != Hierarchy::kSubstitute)
    throw Error(fmt::format("this explains the substitute tree, but '{}' walks none; use --preset sst or slc",
                            settings.preset));
  const bool needs_substitutes = options.overlay == "ellipses" || options.overlay == "size";
  if (needs_substitutes && settings.indirect.stop != Stop::kSubstitute)
    throw Error(fmt::format("--overlay {} shows substitutes, but indirect.stop 'leaf' uses none", options.overlay));
  if (options.gloss && !settings.indirect.gloss)
    throw Error("--gloss explains a walk that indirect.gloss = false leaves out");
  return settings;
}

// --- the world ---------------------------------------------------------------------------------------------

std::unique_ptr<World> grow_tree(const Scene& scene, const Settings& settings) {
  RenderStats stats;
  std::unique_ptr<World> world = make_world(scene, settings, stats);
  // Twice: the second build has its buffers, as all but the first of a sequence.
  for (int k = 0; k < 2; ++k) trace_vpls(*world, settings, 0, stats);
  if (world->substitutes.view().count == 0)
    throw Error(
        fmt::format("'{}' leaves no virtual point lights: nothing shines, or no light meets a surface that "
                    "reflects it",
                    scene.name));
  return world;
}

PixelWindow seen_window(const Settings& settings) {
  if (!settings.pixel_bounds) return {0, 0, settings.width, settings.height};
  const auto& b = *settings.pixel_bounds;
  return {std::clamp(b[0], 0, settings.width), std::clamp(b[2], 0, settings.height),
          std::clamp(b[1], 0, settings.width), std::clamp(b[3], 0, settings.height)};
}

// --- what is asked for -------------------------------------------------------------------------------------

void print_statistics(const TreeOptions& options, const Settings& settings, const World& world,
                      const std::string& scene) {
  const IndirectLighting lighting = make_indirect_lighting(world, settings, 0);
  const PixelWindow window = seen_window(settings);
  TreeReport report;
  report.scene = scene;
  report.preset = settings.preset;
  report.width = window.width();
  report.height = window.height();
  report.tree = describe(world.substitutes.view());
  report.walks = measure_walks(world, lighting, see_surfaces(world, settings, window, settings.jitter));
  report.diagonal = world.vpls.view().diagonal;
  report.substitute_offset = lighting.sampler.substitute_offset;
  report.tree_bytes = world.substitutes.bytes();
  report.vpl_bytes = world.vpls.bytes();
  report.trace_ms = world.vpls.trace_ms();
  report.build_ms = world.substitutes.build_ms();
  fmt::print("{}", options.json ? tree_report_json(report) : tree_report_text(report));
}

void print_pixel(const TreeOptions& options, const Settings& settings, const World& world) {
  const IndirectLighting lighting = make_indirect_lighting(world, settings, 0);
  const SeenSurfaces seen = see_surfaces(world, settings, seen_window(settings), settings.jitter);
  PixelReport report;
  report.x = (*settings.pixel_bounds)[0];
  report.y = (*settings.pixel_bounds)[2];
  report.surface = seen.surfaces.at(0);
  const std::uint32_t pixel = seen.pixels.at(0);
  if (report.surface.instance == kNoId)
    throw Error(fmt::format("no surface is seen at pixel {},{}", report.x, report.y));
  if (options.gloss && !lights_gloss(lighting.sampler, report.surface))
    throw Error(fmt::format("the surface at pixel {},{} has no gloss lobe that walks would light", report.x, report.y));
  report.lobe = options.gloss ? Lobes::kGloss : Lobes::kDiffuse;
  const float diffuse = diffuse_walk_probability(lighting.sampler, report.surface);
  report.lobe_probability = options.gloss ? 1 - diffuse : diffuse;
  if (settings.indirect.correction > 0) report.left_out.emplace_back("indirect.correction");
  if (settings.indirect.compensate) report.left_out.emplace_back("indirect.compensate");
  report.truth = true_light(world, lighting, report.surface, report.lobe);
  report.walk = explain_walk(world, lighting, report.surface, pixel, 0, report.lobe, report.truth);
  if (options.samples > 0)
    report.samples = summarise_walks(world, lighting, report.surface, pixel, options.samples, report.lobe);
  fmt::print("{}", options.json ? pixel_report_json(report) : pixel_report_text(report));
}

// Boxes in a .glb; more are a blur in any viewer.
constexpr std::size_t kMostBoxes = 2000;

void export_tree(const std::string& file, const World& world, bool quiet) {
  if (lower_extension(file) == ".json") {
    const std::string text = tree_json(world);
    write_text_atomically(file, text);
    const std::uint32_t lights = world.substitutes.view().count;
    if (!quiet) fmt::print("wrote {} ({} inner nodes, {} VPLs)\n", file, lights - 1, lights);
    return;
  }
  TreeSceneParts parts;
  const Scene scene = tree_scene(world, kMostBoxes, parts);
  for (const std::string& loss : export_gltf(scene, file)) spdlog::warn("{}", loss);
  if (!quiet)
    fmt::print("wrote {} (boxes of {} of {} substitutes, {} VPLs)\n", file, parts.boxes, parts.all_boxes, parts.lights);
}

void write_overlay(const TreeOptions& options, const Settings& settings, const Scene& scene, const World& world) {
  const ToneMap tone = options.output->tone();
  const Image rendered = render(scene, settings);
  const OverlayPicture overlay = draw_overlay(world, settings, rendered, tone, overlay_from_name(options.overlay));
  for (const std::string& file : options.output->files) {
    write_picture(overlay.picture, settings.width, settings.height, file);
    if (!options.log->quiet) fmt::print("wrote {} ({}x{})\n", file, settings.width, settings.height);
  }
  if (options.log->quiet) return;
  for (const std::string& line : overlay.legend) fmt::print("  {}\n", line);
}

// Before any work is done.
void check_options(const TreeOptions& options) {
  const std::vector<std::string>& pictures = options.output->files;
  if (!options.overlay.empty()) overlay_from_name(options.overlay);
  if (!options.overlay.empty() && pictures.empty()) throw Error("--overlay needs -o FILE to write its picture to");
  if (options.overlay.empty() && !pictures.empty())
    throw Error("-o writes the picture of --overlay, which is not given");
  if (!options.overlay.empty() && options.explains_pixel())
    throw Error("--overlay shows the whole image, not a --pixel");
  if (options.json && !options.overlay.empty()) throw Error("--json prints statistics or a --pixel, not an --overlay");
  if ((options.gloss || options.samples > 0) && !options.explains_pixel())
    throw Error(fmt::format("{} needs --pixel X Y", options.gloss ? "--gloss" : "--samples"));
  for (const std::string& file : pictures) require_writable(file, {".png", ".jpg", ".jpeg"});
  for (const std::string& file : options.exports) require_writable(file, {".json", ".glb", ".gltf"});
  std::vector<std::string> files = pictures;
  files.insert(files.end(), options.exports.begin(), options.exports.end());
  require_distinct(files);
}

void run(const TreeOptions& options) {
  start_logging(*options.log);
  check_options(options);
  Settings settings = make_tree_settings(options);
  const Scene scene = open_scene(options.scene->full_name(), options.scene->environment);
  apply_view_options(*options.view, scene, settings);
  std::unique_ptr<tbb::global_control> limit;
  if (settings.threads > 0)
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(settings.threads));
  const std::unique_ptr<World> world = grow_tree(scene, settings);
  if (options.prints_statistics()) print_statistics(options, settings, *world, scene.name);
  if (options.explains_pixel()) print_pixel(options, settings, *world);
  for (const std::string& file : options.exports) export_tree(file, *world, options.log->quiet || options.json);
  if (!options.overlay.empty()) write_overlay(options, settings, scene, *world);
}

}  // namespace

void add_tree_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("tree", "Explain the substitute tree that lights a frame indirectly");
  auto options = std::make_shared<TreeOptions>();
  options->scene = add_scene_options(*command);
  options->output = add_output_options(*command);
  command->get_option("--output")->description("Picture of --overlay: .png or .jpg; may be repeated");
  command->add_flag("--gloss", options->gloss, "--pixel: explain the walk for the gloss lobe, not the diffuse one");
  command->add_option("--samples", options->samples, "--pixel: also sum up N walks and compare them with the truth")
      ->check(CLI::Range(2, 1 << 20))
      ->type_name("N");
  command
      ->add_option("--overlay", options->overlay,
                   "Draw over the image: vpls, ellipses (substitutes), steps (of the walks), size (of the "
                   "substitutes)")
      ->type_name("NAME");
  command
      ->add_option("--export", options->exports,
                   "Write the tree: .json (every node and VPL), .glb or .gltf (boxes and VPLs as meshes); may be "
                   "repeated")
      ->allow_extra_args(false)
      ->type_name("FILE");
  command->add_flag("--json", options->json, "Print JSON");
  command->add_option("--time", options->time, "Moment of the animation (s, default 0)")->type_name("SECONDS");
  options->settings = add_setting_options(*command);
  command->get_option("--preset")->description("Method, sst or slc (default sst)");
  command->get_option("--pixel")->description("Explain the walk of this pixel");
  options->view = add_view_options(*command);
  options->log = add_log_options(*command);
  command->callback([options] { run(*options); });
}

}  // namespace lumigrove
