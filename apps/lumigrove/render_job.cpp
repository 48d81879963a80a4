#include "render_job.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "base/stopwatch.h"
#include "frame/settings_file.h"
#include "scene/set_environment.h"

namespace lumigrove {

Scene open_scene(const std::string& name, const std::string& environment) {
  const Stopwatch watch;
  Scene scene = load_scene(name);
  if (!environment.empty()) set_environment(scene, environment);
  spdlog::info("loaded '{}' in {:.1f} ms: {} nodes, {} meshes, {} materials, {} lights", name,
               watch.ms(), scene.nodes.size(), scene.meshes.size(), scene.materials.size(),
               scene.lights.size());
  for (const std::string& warning : scene.warnings) spdlog::warn("{}", warning);
  return scene;
}

Image render_frame(const Scene& scene, const Settings& settings, Receipt& receipt, ProgressPrinter& progress,
                   const InterruptGuard& guard, History* history) {
  spdlog::debug("settings:\n{}", to_toml(settings));
  progress.begin_frame(settings.frame);
  RenderStats stats;
  const auto report = [&](const Progress& now) {
    progress.update(now);
    return !guard.interrupted();
  };
  Image image = render(scene, settings, &stats, report, history);
  complete_receipt(receipt, settings, stats);
  write_receipt(receipt, image.metadata);
  return image;
}

void write_files(const Image& image, const std::vector<std::string>& files, const ToneMap& tone,
                 const Receipt& receipt, bool quiet) {
  for (const std::string& file : files) {
    write_image(image, file, tone);
    if (!quiet)
      fmt::print("wrote {} ({}x{}, {} spp, {:.2f} s)\n", file, image.width, image.height, receipt.spp_done,
                 receipt.stats.total_ms * 1e-3);
  }
  std::fflush(stdout);
}

}  // namespace lumigrove
