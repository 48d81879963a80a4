// What a comparison measures against: rendered in two halves, or read from a file.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "comparison.h"
#include "contestant.h"

namespace lumigrove {

struct ReferenceImage {
  RgbImage image;     // with its emission
  RgbImage emission;  // seen directly; stands in the images of all methods too. Empty: they show their own, or none
  Errors errors = kNoErrors;  // its own; NaN: unknown
  std::string origin;
};
using ReferenceImages = std::map<std::string, ReferenceImage>;  // by light

// Images of what is measured by this light show emission too; a layer is shown as it is.
bool shows_emission(const std::string& light);
// `emission` may be empty.
RgbImage with_emission(RgbImage image, const RgbImage& emission);

// Called after every sample with the seconds so far; false ends it early.
using KeepGoing = std::function<bool(double seconds)>;

// Both halves have at least one sample, or the map is empty.
ReferenceImages render_reference(const Scene& scene, const std::shared_ptr<Geometry>& geometry, const Settings& settings,
                                 const BudgetSpec& budget, const std::vector<std::string>& lights,
                                 const MetricSettings& metrics, const KeepGoing& keep_going);

// Throws Error when the file cannot be read, has another size, or lacks a layer.
ReferenceImages read_reference(const std::string& file, int width, int height, const std::vector<std::string>& lights);

}  // namespace lumigrove
