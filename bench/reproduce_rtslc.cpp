// The relations that D. Lin and C. Yuksel, "Real-Time Stochastic Lightcuts", I3D 2020, report, looked for in built-in
// scenes on a CPU. Where the paper's settings are not the program's defaults, both are measured.
#include "rtslc_checks.h"

namespace lumigrove::bench {

std::vector<Check> rtslc_checks() {
  return {
      {0, "build of the trees (table 1)", check_light_tree_builds},
      {10, "uniform, trees, cuts: equal samples and equal time (table 3, figures 7 and 8)", check_strategies},
      {10, "adaptive tree splitting (table 2)", check_tree_splitting},
      {11, "all estimators have the mean of the sum over all lights", check_means},
      {12, "shared cuts (figures 3 and 9)", check_cut_sharing},
      {12, "weights of children (figure 12)", check_distance_weights},
      {12, "two levels (figure 10)", check_two_levels},
      {13, "interleaved cuts (figure 11)", check_interleaving},
      {0, "presets rtslc and tree (not published)", check_presets}};
}

}  // namespace lumigrove::bench
