// Names the emitter that each surface of a batch is, scales its emission, and collects what the ray sees
// directly: emission of the surface, or the environment where nothing was hit.
#pragma once

#include "lights/emitter.h"
#include "lights/environment.h"
#include "scene/surface.h"
#include "trace/ray.h"

namespace lumigrove {

struct EmissionKernel {
  SceneView scene;
  LightView lights;
  float light_scale;
  std::span<const Ray> rays;
  std::span<Surface> surfaces;
  std::span<vec3> seen;  // radiance along each ray

  LUMI_HD void operator()(int index) const {
    const std::size_t i = static_cast<std::size_t>(index);
    Surface& surface = surfaces[i];
    if (surface.instance == kNoId) {
      const bool sky = lights.environment.present() && rays[i].tmax >= rays[i].tmin;
      seen[i] =
          sky ? environment_radiance(scene, lights.environment, glm::normalize(rays[i].direction)) : vec3(0);
      return;
    }
    surface.emission *= light_scale;
    if (max_component(surface.emission) > 0)
      surface.emitter = emitter_of_triangle(lights, surface.instance, surface.triangle);
    seen[i] = surface.emission;
  }
};

}  // namespace lumigrove
