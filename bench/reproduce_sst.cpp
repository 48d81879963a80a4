// The relations that W. Tatzgern et al., "Stochastic Substitute Trees for Real-Time Global Illumination", I3D 2020,
// report, looked for in built-in scenes. The paper measured denoised images on a GPU; these are not denoised.
#include "sst_checks.h"

namespace lumigrove::bench {

std::vector<Check> sst_checks() {
  return {{1, "the tree holds its lights", check_tree_invariants},
          {2, "substitutes of a plane and of a corner", check_substitutes},
          {3, "selection of leaves is unbiased; bias of substitutes", check_selection},
          {4, "energy of bounces, and light in closed boxes", check_energy},
          {5, "light of k bounces against k-bounce paths", check_depths},
          {6, "sst against slc: error, steps, time", check_peers},
          {7, "sst against paths of 1 to 3 bounces", check_paths},
          {8, "build of the tree", check_build},
          {9, "variance of the weights", check_weights}};
}

}  // namespace lumigrove::bench
