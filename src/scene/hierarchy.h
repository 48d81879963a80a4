// The node hierarchy as an order of visits: shared by validation (cycles) and evaluation (world transforms).
#pragma once

#include <string>
#include <vector>

#include "lumigrove/scene.h"

namespace lumigrove {

// Indices of all nodes, every parent before its children. Throws Error when parents form a cycle; parent
// indices must be in range.
std::vector<int> parents_first(const Scene& scene);

// "node 3 ('lamp')": how messages name a thing.
std::string label(const char* kind, std::size_t index, const std::string& name);

}  // namespace lumigrove
