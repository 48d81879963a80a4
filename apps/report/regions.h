// Parts of an image where methods are worst, or differ most, found from their FLIP maps.
#pragma once

#include <string>
#include <vector>

namespace lumigrove {

struct Region {
  int x = 0, y = 0, width = 0, height = 0;  // pixels
  std::string why;           // "worst 1", "methods differ most"
  std::vector<double> flip;  // mean of each map
};

// Squares of about a tenth of the width that do not overlap: the `worst` ones by the mean of all maps, and with
// several maps the one with the largest difference between two of them. Maps have width*height values; none: no regions.
std::vector<Region> find_regions(const std::vector<std::vector<float>>& maps, int width, int height, int worst);

}  // namespace lumigrove
