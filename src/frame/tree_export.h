// The substitute tree as files for other programs. Host only.
#pragma once

#include <filesystem>
#include <string>

#include "frame/frame.h"

namespace lumigrove {

// Every inner node and every light as JSON: arrays of rows, whose columns are named beside them.
std::string tree_json(const World& world);

// What tree_scene left out.
struct TreeSceneParts {
  std::size_t boxes = 0, all_boxes = 0;
  std::size_t lights = 0;
};
// Boxes of the usable nodes nearest the root as thin bars, coloured by level, and every VPL as a small disc in its
// colour, seen by the world's camera; of very many boxes the `most_boxes` with the most intensity.
Scene tree_scene(const World& world, std::size_t most_boxes, TreeSceneParts& parts);

}  // namespace lumigrove
