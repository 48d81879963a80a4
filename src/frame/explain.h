// Why a pixel's indirect light comes from the virtual point light that it comes from: walks down the substitute tree,
// step by step, beside the light that every virtual point light really sends. Host only, for people who look at the
// method; src/methods/vpl_sampling does the same work for images.
#pragma once

#include <optional>
#include <vector>

#include "frame/frame.h"

namespace lumigrove {

// --- surfaces ----------------------------------------------------------------------------------------------

// What the camera's rays of sample 0 meet, in the order of pixel_of_index.
struct SeenSurfaces {
  std::vector<Surface> surfaces;
  std::vector<std::uint32_t> pixels;  // rng_pixel
};
SeenSurfaces see_surfaces(const World& world, const Settings& settings, const PixelWindow& window, bool jitter);

// --- lights drawn ------------------------------------------------------------------------------------------

// One sample at a surface; its numbers start at `dimension`.
struct WalkStart {
  const Surface* surface;
  std::uint32_t pixel, dimension;
};
// First number of sample `sample` of indirect light.
inline std::uint32_t walk_dimension(int sample) {
  return kDimIndirect + kDimensionsPerVplSample * static_cast<std::uint32_t>(sample);
}

// What it draws: a light, or a point of a substitute.
struct DrawnLight {
  WalkResult walk;
  Lobes lobe = Lobes::kDiffuse;
  float lobe_probability = 1;
  VplPoint light;        // intensity divided by the walk's probability, not by the lobe's
  bool boxed = false;    // a substitute's point was moved to the box
  bool clamped = false;  // cos / d^2 was above G_max
};

// `lobe`: kDiffuse or kGloss to light that lobe only, with probability 1; otherwise as an image does. A sample has
// the numbers that an image's has, so that it is the same sample. The correction by leaves is left out.
void draw_lights(const IndirectLighting& lighting, std::span<const WalkStart> starts, std::optional<Lobes> lobe,
                 std::span<DrawnLight> drawn);

// Radiance that leaves the surface towards its viewer if nothing is between; 0 for a dead walk.
vec3 unoccluded_light(const IndirectLighting& lighting, const Surface& surface, const DrawnLight& drawn);

// --- many walks --------------------------------------------------------------------------------------------

struct WalkStatistics {
  std::uint64_t walks = 0;                                         // one a surface
  std::uint64_t leaves = 0, substitutes = 0, dead = 0, gloss = 0;  // how they ended; which followed the gloss lobe
  double mean_steps = 0;
  int max_steps = 0;
  std::uint64_t boxed = 0;     // of the substitutes
  std::uint64_t clamped = 0;   // of all that ended
  std::uint64_t dark = 0;      // ended where the light or the surface faces away
  std::uint64_t occluded = 0;  // of the rest
  // Of the substitutes' points, those inside geometry: a ray from the point along the substitute's normal, as long as
  // the diagonal of its box, meets the back of a triangle first.
  std::uint64_t inside = 0;
  std::uint64_t inside_beyond_offset = 0;  // farther away than what the shadow rays skip
};
WalkStatistics measure_walks(const World& world, const IndirectLighting& lighting, const SeenSurfaces& seen);

// --- one walk ----------------------------------------------------------------------------------------------

// A child of a node as the walk sees it, and what is true of it.
struct WeighedChild {
  std::uint32_t number = 0;  // of the leaf or inner node
  bool leaf = false, usable = false;
  std::uint32_t first = 0, last = 0;  // leaves below it
  float intensity = 0;                // Y, W/sr
  float distance = 0;                 // to the mean, metres
  float bound = 0;                    // M: of the cosine, times the gloss lobe
  float weight = 0;                   // equation (5); NaN where Yuksel's rules form none
  float probability = 0;              // 0 on a dead branch
  double true_share = 0;              // of the unoccluded light that all lights below the node send
  double visible_share = 0;           // of the light that arrives
};
struct WalkStep {
  std::uint32_t node = 0;
  float random = 0;
  WeighedChild child[2];
  int taken = -1;  // -1: dead
};

// What every light sends to the viewer by way of a surface, Y of the radiance, clamped by G_max.
struct TrueLight {
  std::vector<double> unoccluded, visible;  // running sums over the leaves, N + 1 entries; visible may be empty
  vec3 unoccluded_sum = vec3(0), visible_sum = vec3(0);

  bool has_visibility() const { return !visible.empty(); }
};
// Shadow rays to all lights are traced when there are at most so many.
inline constexpr std::uint32_t kMostTrueShadowRays = 1u << 20;
TrueLight true_light(const World& world, const IndirectLighting& lighting, const Surface& surface, Lobes lobe);

struct ExplainedWalk {
  std::vector<WalkStep> steps;
  DrawnLight drawn;
  vec3 unoccluded = vec3(0);
  bool occluded = false;
  vec3 contribution() const { return occluded ? vec3(0) : unoccluded; }
};
// Sample number `sample` of the pixel along `lobe`.
ExplainedWalk explain_walk(const World& world, const IndirectLighting& lighting, const Surface& surface,
                           std::uint32_t pixel, int sample, Lobes lobe, const TrueLight& truth);

struct SampleSummary {
  int samples = 0, dead = 0, occluded = 0, substitutes = 0;
  vec3 mean = vec3(0);
  double mean_y = 0, standard_error = 0;          // Y of the radiance
  double unoccluded_y = 0, unoccluded_error = 0;  // likewise, without shadow rays
};
// Samples 0 to samples - 1 of the pixel along `lobe`.
SampleSummary summarise_walks(const World& world, const IndirectLighting& lighting, const Surface& surface,
                              std::uint32_t pixel, int samples, Lobes lobe);

}  // namespace lumigrove
