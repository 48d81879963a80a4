// What the measurements of stochastic substitute trees share: their settings, converged references, and light of virtual
// point lights at fixed surfaces.
#pragma once

#include <vector>

#include "frame/explain.h"
#include "study.h"

namespace lumigrove::bench {

// The scenes in which the paper's relations are looked for.
inline constexpr const char* kStudyScenes[] = {"colonnade", "living-room"};

// Where errors are measured, and where times are.
inline constexpr int kErrorWidth = 256, kErrorHeight = 144, kTimeWidth = 1280, kTimeHeight = 720;

Settings sst_settings(bool diffuse);
Settings slc_settings(bool diffuse);
Settings path_settings(bool diffuse, int bounces);

// --- references ------------------------------------------------------------------------------------------------

// Path tracing of 7 bounces, the paper's reference.
struct Reference {
  SampleImage image;
  double beauty_variance = 0, indirect_variance = 0;  // of a value of these layers: squared standard error
};
Reference make_reference(const Scene& scene, bool diffuse, int spp);

// Squared error of an image, without the reference's own.
double squared_error(const Reference& reference, const RgbImage& beauty);
double squared_indirect_error(const Reference& reference, const RgbImage& indirect);

// --- light at fixed surfaces -----------------------------------------------------------------------------------

// What a camera sees through the centres of its pixels.
struct SeenImage : SeenSurfaces {
  int width, height;

  SeenImage(const World& world, const Settings& settings)
      : SeenSurfaces(see_surfaces(world, settings, {0, 0, settings.width, settings.height}, false)),
        width(settings.width),
        height(settings.height) {}
};

// Light of the virtual point lights at every surface, of which samples of the settings' indirect.spp are averaged.
std::vector<vec3> light_surfaces(const IndirectLighting& lighting, const SeenSurfaces& seen);
// Of one sample.
std::vector<VplTrace> trace_walks(const IndirectLighting& lighting, const SeenSurfaces& seen);
// Mean number of steps of a walk.
double mean_steps(const std::vector<VplTrace>& traces);
// Mean over rows of lanes of their longest walk: lanes wait for it.
double mean_longest_steps(const std::vector<VplTrace>& traces);

// --- time ------------------------------------------------------------------------------------------------------

// Choosing virtual point lights and tracing their shadow rays.
double sampling_ms(const Study& study, const Settings& settings);
// All that paths do beyond the first surface.
double path_ms(const Study& study, const Settings& settings);

}  // namespace lumigrove::bench
