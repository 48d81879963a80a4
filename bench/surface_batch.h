// Surfaces that a camera sees, and light samples at all of them: what a light sample costs by itself.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "device/device.h"
#include "frame/frame.h"
#include "methods/light_sampling/direct_lighting_kernel.h"
#include "scene/surface_kernel.h"

namespace lumigrove::bench {

// A batch of surfaces as a camera sees them, and room for one light sample each.
struct SurfaceBatch {
  Scene scene;
  Settings settings = make_preset("tree");
  std::unique_ptr<World> world;
  std::vector<Surface> surfaces;
  std::vector<std::uint32_t> pixels;
  std::vector<Ray> shadow;
  std::vector<vec3> contribution;

  explicit SurfaceBatch(const std::string& scene_name, Hierarchy hierarchy = Hierarchy::kPerfect)
      : scene(load_scene(scene_name)) {
    settings.direct.hierarchy = hierarchy;
    RenderStats stats;
    world = make_world(scene, settings, stats);
    const CameraView camera = make_camera_view(world->camera, settings.width, settings.height);
    const PixelWindow window{0, 0, settings.width, settings.height};
    const auto n = static_cast<std::size_t>(window.count());
    std::vector<Ray> rays(n);
    std::vector<Hit> hits(n);
    std::vector<Surface> all(n);
    std::vector<std::uint32_t> numbers(n);
    launch(window.count(), CameraKernel{camera, window, rays, numbers, 0, 0, true});
    world->tracer.closest(rays, hits, Coherence::kCoherent);
    launch(window.count(), SurfaceKernel{world->arrays.view(), rays, hits, all});
    for (const Surface& surface : all) {
      if (surface.instance == kNoId) continue;
      pixels.push_back(static_cast<std::uint32_t>(surfaces.size()));
      surfaces.push_back(surface);
    }
    shadow.resize(surfaces.size());
    contribution.resize(surfaces.size());
  }

  // One light sample at every surface: choice, point, shading, shadow ray; nothing is traced.
  void sample() {
    const DirectLighting direct = make_direct_lighting(*world, settings, 0);
    launch(
        walk_batches(static_cast<int>(surfaces.size())),
        DirectLightKernel{
            direct.sampler, direct.rng, kDimLight, 1.0f, false, surfaces, pixels, shadow, contribution, {}},
        kLaunchGrain / kWalkBatch);
  }
};

}  // namespace lumigrove::bench
