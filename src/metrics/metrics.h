// How far an image is from a reference: RMSE and relMSE on linear RGB, SSIM and FLIP on tone-mapped sRGB.
#pragma once

#include <string>
#include <vector>

#include "lumigrove/image.h"
#include "lumigrove/vec.h"

namespace lumigrove {

// Three floats a pixel, interleaved, row 0 on top.
struct RgbImage {
  int width = 0, height = 0;
  std::vector<float> rgb;
  std::string name;  // file, for messages
};

// R,G,B of a layer ("" = beauty). Throws Error when the layer is absent or has no three colour channels.
RgbImage rgb_of(const Image& image, const std::string& layer, const std::string& name);

// Added to the squared reference in relMSE, so that black pixels count finitely.
inline constexpr double kRelMseEpsilon = 0.01;

// A 0.7 m wide display of 3840 pixels seen from 0.7 m, the default of the FLIP paper: 67.02.
inline constexpr float kPixelsPerDegree = 3840 * kPi / 180;

// Every metric below throws Error when the sizes differ, an image is empty, or a value is not finite (the
// sentence counts such pixels). Results have the same bits for any number of threads.

// sqrt(mean over pixels and channels of (test - reference)^2); linear RGB.
double rmse(const RgbImage& reference, const RgbImage& test);

// mean over pixels and channels of (test - reference)^2 / (reference^2 + kRelMseEpsilon); linear RGB.
double rel_mse(const RgbImage& reference, const RgbImage& test);

// Structural similarity (Wang et al. 2004) of sRGB-encoded images with values in [0,1]: 11x11 Gaussian window
// with sigma 1.5, K1 = 0.01, K2 = 0.03, L = 1, mean over the channels and over the pixels whose window lies
// inside. 1 means equal. Throws Error when a side is shorter than 11 pixels.
inline constexpr int kSsimWindow = 11;
double ssim(const RgbImage& reference, const RgbImage& test);

// LDR-FLIP (Andersson et al. 2020) of sRGB-encoded images with values in [0,1]: one error in [0,1] a pixel;
// see flip.cpp.
std::vector<float> flip_map(const RgbImage& reference, const RgbImage& test,
                            float pixels_per_degree = kPixelsPerDegree);

enum class Metric { kRmse, kRelMse, kSsim, kFlip };

struct MetricInfo {
  Metric metric;
  const char* key;      // "rmse"; on the command line
  const char* label;    // "RMSE"; in tables
  const char* formula;  // one line
  bool lower_is_better;
};
const std::vector<MetricInfo>& metrics();

struct MetricSettings {
  ToneMap tone;                                // before SSIM and FLIP
  float pixels_per_degree = kPixelsPerDegree;  // of FLIP
};

struct Comparison {
  double rmse = 0, rel_mse = 0;
  double ssim = 0;  // NaN when a side is shorter than kSsimWindow
  double flip = 0;  // mean of the map
  std::vector<float> flip_map;
  double value(Metric metric) const;
};

// All metrics of two linear images.
Comparison compare_images(const RgbImage& reference, const RgbImage& test, const MetricSettings& settings);

}  // namespace lumigrove
