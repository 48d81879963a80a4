// Groups of relations of stochastic substitute trees, numbered as the acceptance checks of the reproduction.
#pragma once

#include "reproduce.h"

namespace lumigrove::bench {

void check_tree_invariants(const Report& report);  // 1: sst_tree_checks.cpp
void check_substitutes(const Report& report);      // 2
void check_build(const Report& report);            // 8
void check_selection(const Report& report);        // 3: sst_light_checks.cpp
void check_energy(const Report& report);           // 4
void check_depths(const Report& report);           // 5
void check_weights(const Report& report);          // 9
void check_peers(const Report& report);            // 6: sst_image_checks.cpp
void check_paths(const Report& report);            // 7

}  // namespace lumigrove::bench
