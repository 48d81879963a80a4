// What the measurements of stochastic substitute trees share: a scene with its lights traced, single camera samples,
// light at fixed surfaces, converged references, and means with their errors.
#pragma once

#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "frame/explain.h"
#include "frame/frame.h"
#include "metrics/metrics.h"

namespace lumigrove::bench {

// The scenes in which the paper's relations are looked for.
inline constexpr const char* kStudyScenes[] = {"colonnade", "living-room"};

// Where errors are measured, and where times are.
inline constexpr int kErrorWidth = 256, kErrorHeight = 144, kTimeWidth = 1280, kTimeHeight = 720;

inline Settings sized(Settings settings, int width, int height) {
  settings.width = width;
  settings.height = height;
  return settings;
}

Settings sst_settings(bool diffuse);
Settings slc_settings(bool diffuse);
Settings path_settings(bool diffuse, int bounces);

// --- means ---------------------------------------------------------------------------------------------------

struct Estimate {
  double value = 0, error = 0;  // standard error
};

// Welford 1962.
class Mean {
 public:
  void add(double x) {
    ++count_;
    const double before = x - mean_;
    mean_ += before / count_;
    moment2_ += before * (x - mean_);
  }
  double mean() const { return mean_; }
  double variance() const { return count_ > 1 ? moment2_ / (count_ - 1) : 0; }
  Estimate estimate() const;

 private:
  int count_ = 0;
  double mean_ = 0, moment2_ = 0;
};

// Mean of a over mean of b, which were measured together.
Estimate ratio_of_means(std::span<const double> a, std::span<const double> b);
// And its root: of two mean squared errors.
Estimate root(Estimate square);

// --- a scene -------------------------------------------------------------------------------------------------

// A scene and its world, as `settings` ask for: its light tree and camera.
struct Study {
  Scene scene;
  std::unique_ptr<World> world;

  Study(Scene study_scene, const Settings& settings);
  Study(const std::string& scene_name, const Settings& settings) : Study(load_scene(scene_name), settings) {}
  Study(const Study&) = delete;  // the world points into the scene
  Study& operator=(const Study&) = delete;

  // Virtual point lights and their tree; the seed is that of the settings.
  void trace(const Settings& settings);
  // The tree alone, with other bounds of its substitutes.
  void build_substitutes(float min_nu, float max_sigma);
};

// One camera sample, whose virtual point lights have been traced.
struct SampleImage {
  RgbImage beauty, indirect;
};
SampleImage render_one(const Study& study, const Settings& settings);

// Running mean of images.
class ImageMean {
 public:
  void add(const SampleImage& image);
  SampleImage mean() const;

 private:
  int count_ = 0;
  SampleImage last_;
  std::vector<double> beauty_, indirect_;
};

double mean_value(const RgbImage& image);
// Of the tone-mapped images.
double tone_mapped_ssim(const RgbImage& reference, const RgbImage& test);

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

// Time of the named passes of one camera sample: the threads' sum over their number.
double pass_ms(const Study& study, const Settings& settings, std::initializer_list<const char*> passes);
// Choosing virtual point lights and tracing their shadow rays.
double sampling_ms(const Study& study, const Settings& settings);
// All that paths do beyond the first surface.
double path_ms(const Study& study, const Settings& settings);

}  // namespace lumigrove::bench
