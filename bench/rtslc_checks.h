// Groups of relations of real-time stochastic lightcuts, numbered as the acceptance checks of the reproduction; 0: not
// among these.
#pragma once

#include "reproduce.h"

namespace lumigrove::bench {

void check_light_tree_builds(const Report& report);  // 0: rtslc_tree_checks.cpp
void check_strategies(const Report& report);         // 10: rtslc_error_checks.cpp
void check_tree_splitting(const Report& report);     // 10
void check_means(const Report& report);              // 11: rtslc_mean_checks.cpp
void check_cut_sharing(const Report& report);        // 12: rtslc_cut_checks.cpp
void check_distance_weights(const Report& report);   // 12
void check_two_levels(const Report& report);         // 12
void check_interleaving(const Report& report);       // 13
void check_presets(const Report& report);            // 0: rtslc_preset_checks.cpp

}  // namespace lumigrove::bench
