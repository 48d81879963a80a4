// Surfaces that a camera sees, and light samples at all of them: what a light sample costs by itself.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "device/device.h"
#include "frame/explain.h"
#include "frame/frame.h"
#include "methods/light_sampling/direct_lighting_kernel.h"

namespace lumigrove::bench {

// The surfaces of an image, without pixels that see none, and room for one light sample each.
struct SampleBatch {
  SeenSurfaces seen;
  std::vector<Ray> shadow;
  std::vector<vec3> contribution;

  SampleBatch(const World& world, const Settings& settings) {
    const SeenSurfaces all = see_surfaces(world, settings, {0, 0, settings.width, settings.height}, true);
    for (std::size_t i = 0; i < all.surfaces.size(); ++i) {
      if (all.surfaces[i].instance == kNoId) continue;
      seen.surfaces.push_back(all.surfaces[i]);
      seen.pixels.push_back(all.pixels[i]);
    }
    shadow.resize(size());
    contribution.resize(size());
  }

  std::size_t size() const { return seen.surfaces.size(); }

  // One light sample at every surface: choice, point, shading, shadow ray; nothing is traced.
  void sample(const DirectLighting& direct) {
    launch(walk_batches(static_cast<int>(size())),
           DirectLightKernel{
               direct.sampler, direct.rng, kDimLight, 1.0f, false, seen.surfaces, seen.pixels, shadow, contribution},
           kLaunchGrain / kWalkBatch);
  }
};

// A scene, its light tree and what its camera sees.
struct SurfaceBatch {
  Scene scene;
  Settings settings;
  RenderStats stats;
  std::unique_ptr<World> world;
  SampleBatch batch;

  explicit SurfaceBatch(const std::string& scene_name, const Settings& asked = make_preset("tree"))
      : scene(load_scene(scene_name)),
        settings(asked),
        world(make_world(scene, settings, stats)),
        batch(*world, settings) {}

  std::size_t size() const { return batch.size(); }
  void sample() { batch.sample(make_direct_lighting(*world, settings, 0)); }
};

}  // namespace lumigrove::bench
