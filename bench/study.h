// What measurements of reproductions share: means with their errors, a scene with its world, single camera samples.
#pragma once

#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "frame/frame.h"
#include "metrics/metrics.h"

namespace lumigrove::bench {

inline Settings sized(Settings settings, int width, int height) {
  settings.width = width;
  settings.height = height;
  return settings;
}

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
Estimate mean_of(std::span<const double> values);
// Mean of a - b, which were measured together.
Estimate mean_difference(std::span<const double> a, std::span<const double> b);

// Of the values of several images, one for one.
void add_to(std::vector<Mean>& values, const RgbImage& image);
// Variance of the mean of these images, for one of their values.
double mean_variance(const std::vector<Mean>& values);

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

struct SampleImage {
  RgbImage beauty, indirect;
};
// The means of a film.
SampleImage layers_of(const Film& film, int samples);
// One camera sample, whose virtual point lights have been traced.
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
double tone_mapped_ssim(const RgbImage& reference, const RgbImage& test, const ToneMap& tone = {});

// --- time ------------------------------------------------------------------------------------------------------

// Time of the named passes of one camera sample: the threads' sum over their number.
double pass_ms(const Study& study, const Settings& settings, std::initializer_list<const char*> passes);

}  // namespace lumigrove::bench
