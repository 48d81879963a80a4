// Pictures of how an image differs from its reference.
#pragma once

#include <vector>

#include "lumigrove/image.h"
#include "lumigrove/vec.h"
#include "metrics/metrics.h"

namespace lumigrove {

// All pictures are display-ready: sRGB-encoded RGB in [0,1], three floats a pixel, as tone_map returns. Both
// images must have the same size (Error).

// Blue where `test` is darker, red where it is brighter, white where both have the same luminance; full
// colour where one of them is black. t = (Y_test - Y_reference) / (Y_test + Y_reference), and 0 where both
// are black.
std::vector<float> signed_difference(const RgbImage& reference, const RgbImage& test);

// |test - reference| in linear RGB, tone-mapped as the images themselves are shown.
std::vector<float> absolute_difference(const RgbImage& reference, const RgbImage& test, const ToneMap& tone);

// Errors in [0,1] (a FLIP map) from black over purple and orange to pale yellow.
std::vector<float> heat_map(const std::vector<float>& errors);

// Colours of the two scales, sRGB-encoded: t in [-1,1] and t in [0,1], clamped.
vec3 blue_white_red(float t);
vec3 magma(float t);

// Writes a display-ready picture as it is. Throws Error.
void write_picture(const std::vector<float>& picture, int width, int height,
                   const std::filesystem::path& file);

}  // namespace lumigrove
