// Metrics of image files against a reference, difference pictures, limits for automatic tests.
#pragma once

#include <string>
#include <vector>

#include "metrics/metrics.h"

namespace lumigrove {

struct ImageComparison {
  std::string reference;
  std::vector<std::string> images, fail_above, fail_below;  // limits: METRIC=VALUE
  std::string layer, curve = "filmic", folder;              // folder of the pictures; empty: none
  MetricSettings metrics;
  bool json = false;
};

// Prints a table or JSON. Throws ExitCode 3 when an image breaks a limit.
void compare_image_files(ImageComparison& options);

}  // namespace lumigrove
