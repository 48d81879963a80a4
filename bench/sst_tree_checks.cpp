// Checks 1, 2 and 8 of the reproduction of stochastic substitute trees: the tree itself and its build.
#include <algorithm>
#include <cmath>

#include "base/direction_code.h"
#include "base/morton.h"
#include "base/sampling.h"
#include "bench.h"
#include "sst_checks.h"
#include "sst_study.h"

namespace lumigrove::bench {
namespace {

// --- 1: invariants -------------------------------------------------------------------------------------------

// What a walk over the whole tree finds wrong.
struct TreeFaults {
  std::uint32_t missing_nodes = 0;  // of 2 N - 1, or met twice
  std::uint32_t outside = 0;        // pairs of a light and a box above it that does not hold the light
  std::uint32_t rising_nu = 0;      // nodes that agree less than their parent
};

class TreeInspection {
 public:
  explicit TreeInspection(const SubstituteTreeView& tree) : tree_(tree), met_(2 * tree.count) {
    visit(0, 0, tree.count - 1);
    for (std::uint32_t i = 0; i < 2 * tree.count; ++i)
      if (i != tree.count - 1 && met_[i] != 1) ++faults_.missing_nodes;
  }
  TreeFaults faults() const { return faults_; }

 private:
  // Inner node `number` over leaves first..last. Codes of 64 bits: never deeper than that and the index's bits.
  void visit(std::uint32_t number, std::uint32_t first, std::uint32_t last) {
    ++met_[number];
    const SubstituteNode& node = tree_.nodes[number];
    const std::uint32_t split = node.split();
    const std::uint32_t ends[2][2] = {{first, split}, {split + 1, last}};
    for (std::uint32_t side = 0; side < 2; ++side) {
      const ChildRecord& child = node.child[side];
      const std::uint32_t name = split + side;
      count_outside(unpack_box(child), ends[side][0], ends[side][1]);
      if ((child.mean & ChildRecord::kLeaf) != 0) {
        ++met_[tree_.count + name];
        continue;
      }
      if (tree_.distributions[name].nu < tree_.distributions[number].nu) ++faults_.rising_nu;
      visit(name, ends[side][0], ends[side][1]);
    }
  }

  void count_outside(const Box3& box, std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t i = first; i <= last; ++i) {
      const vec3 p = tree_.leaf(i).position;
      if (glm::min(glm::max(p, box.lo), box.hi) != p) ++faults_.outside;
    }
  }

  SubstituteTreeView tree_;
  std::vector<std::uint8_t> met_;  // inner nodes 0..N-2, then leaves from N
  TreeFaults faults_;
};

std::uint32_t count_unsorted(const SubstituteTreeView& tree, const VplView& lights) {
  const vec3 scale = inverse_extent(lights.bounds);
  const auto code = [&](std::uint32_t leaf) {
    const Vpl& vpl = tree.leaf(leaf);
    const std::uint64_t morton = morton30((vpl.position - lights.bounds.lo) * scale);
    return morton << kDirectionBits | direction_code(vpl.normal);
  };
  std::uint32_t unsorted = 0;
  for (std::uint32_t i = 0; i + 1 < tree.count; ++i) unsorted += code(i) > code(i + 1) ? 1 : 0;
  return unsorted;
}

double relative_root_error(const SubstituteTreeView& tree, const VplView& lights) {
  double sum = 0;
  for (const Vpl& vpl : lights.vpls) sum += static_cast<double>(luminance(vpl.intensity));
  return std::abs(static_cast<double>(tree.intensity) / sum - 1);
}

void report_invariants(const char* scene, const Report& report) {
  const Settings settings = sst_settings(true);
  Study study(scene, settings);
  study.trace(settings);
  const SubstituteTreeView tree = study.world->substitutes.view();
  const VplView lights = study.world->vpls.view();
  const TreeFaults faults = TreeInspection(tree).faults();
  const std::string note = fmt::format("{} VPLs", tree.count);
  report({1, scene, "|root intensity / sum of Y - 1|", "0", relative_root_error(tree, lights), 0, {}, 1e-4, note});
  report({1, scene, "nodes missing of 2N-1 or met twice", "0", double(faults.missing_nodes), 0, {}, 0});
  report({1, scene, "lights outside a box above them", "0", double(faults.outside), 0, {}, 0});
  report({1, scene, "neighbouring leaves with falling codes", "0", double(count_unsorted(tree, lights)), 0, {}, 0});
  report({1, scene, "inner nodes with a smaller nu than their parent", "0", double(faults.rising_nu), 0, {}, 0});
}

// --- 2: small sets of lights -----------------------------------------------------------------------------------

struct LightsAndTree {
  LargeArray<Vpl> vpls;
  VplView view;
  SubstituteTree tree;

  void add(vec3 position, vec3 normal, float intensity) {
    Vpl vpl{};
    vpl.position = position;
    vpl.normal = normal;
    vpl.intensity = vec3(intensity);
    vpls.push_back(vpl);
  }
  void build() {
    view = {vpls, {}, 1};
    for (const Vpl& vpl : vpls) view.bounds = unite(view.bounds, vpl.position);
    view.diagonal = view.bounds.diagonal();
    const IndirectSettings defaults;
    tree.build(view, {Topology::kRadix, defaults.min_nu, defaults.max_sigma * view.diagonal, kInfinity});
  }
};

// Lights of very different power on a slanted plane.
LightsAndTree flat_lights(const Frame& frame) {
  LightsAndTree lights;
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const vec4 u = Rng{1, 0, i}.uniform4(0);
    lights.add(vec3(1, 2, 3) + frame.x * (3 * u.x) + frame.y * u.y, frame.z, 0.01f + u.z * u.z);
  }
  lights.build();
  return lights;
}

LightsAndTree corner_lights() {
  LightsAndTree lights;
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const vec4 u = Rng{2, 0, i}.uniform4(0);
    const bool wall = i % 2 == 0;
    lights.add(wall ? vec3(0, u.x, u.y) : vec3(u.x, 0, u.y), wall ? vec3(1, 0, 0) : vec3(0, 1, 0), 1);
  }
  lights.build();
  return lights;
}

// Weighted variance of the lights' positions along `axis`, in double.
double variance_of(const LightsAndTree& lights, vec3 axis) {
  double weight = 0, first = 0, second = 0;
  for (const Vpl& vpl : lights.vpls) {
    const double w = static_cast<double>(luminance(vpl.intensity));
    const double x = glm::dot(glm::dvec3(vpl.position), glm::dvec3(axis));
    weight += w;
    first += w * x;
    second += w * x * x;
  }
  return second / weight - (first / weight) * (first / weight);
}

void report_substitutes(const Report& report) {
  const Frame frame = make_frame(glm::normalize(vec3(1, 2, -1)));
  const LightsAndTree flat = flat_lights(frame);
  const Distribution& root = flat.tree.view().distributions[0];
  report({2, "", "flat lights: root may stand for all", "1", flat.tree.view().root_usable ? 1.0 : 0.0, 0, 1, {}});
  const double sigma = std::sqrt(std::max(0.0f, root.variance_along(frame.z)));
  report({2, "", "flat lights: sigma_z / diagonal", "0", sigma / double(flat.view.diagonal), 0, {}, 1e-4});
  double worst = 0;
  for (const vec3 axis : {frame.x, frame.y})
    worst = std::max(worst, std::abs(double(root.variance_along(axis)) / variance_of(flat, axis) - 1));
  report({2, "", "flat lights: sigma_xy^2 / population variance - 1, worst", "0", worst, 0, {}, 1e-4});
  const LightsAndTree corner = corner_lights();
  report({2,
          "",
          "two perpendicular walls: root may stand for all",
          "0",
          corner.tree.view().root_usable ? 1.0 : 0.0,
          0,
          {},
          0});
}

// --- 8: build ------------------------------------------------------------------------------------------------

struct BuildTime {
  double ms, lights;
};

BuildTime build_time(const char* scene, int vpls) {
  constexpr int kRuns = 7;
  Settings settings = sst_settings(true);
  settings.indirect.vpls = vpls;
  Study study(scene, settings);
  study.trace(settings);
  const double ms =
      median_ms(kRuns, [&] { study.build_substitutes(settings.indirect.min_nu, settings.indirect.max_sigma); });
  return {ms, static_cast<double>(study.world->substitutes.view().count)};
}

}  // namespace

void check_tree_invariants(const Report& report) {
  for (const char* scene : kStudyScenes) report_invariants(scene, report);
}

void check_substitutes(const Report& report) { report_substitutes(report); }

void check_build(const Report& report) {
  constexpr int kVpls[] = {10000, 100000, 500000, 1000000};
  constexpr const char* kPublishedMs[] = {"0.57", "0.89", "2.4", "4.4"};
  std::vector<double> hundred_k_ns;
  for (const char* scene : kStudyScenes) {
    std::vector<BuildTime> times;
    for (std::size_t i = 0; i < std::size(kVpls); ++i) {
      times.push_back(build_time(scene, kVpls[i]));
      report({8,
              scene,
              fmt::format("tree build, at most {} VPLs: ms", kVpls[i]),
              kPublishedMs[i],
              times[i].ms,
              0,
              {},
              {},
              fmt::format("{} VPLs, {:.3g} ns each", times[i].lights, times[i].ms * 1e6 / times[i].lights)});
    }
    hundred_k_ns.push_back(times[1].ms / times[1].lights);
    report({8, scene, "time of a build of 1 M / of 100 k", "4.9", times[3].ms / times[1].ms, 0, {}, 10});
  }
  report({8,
          "",
          "time a VPL at 100 k: slower scene / faster",
          "1.0",
          std::ranges::max(hundred_k_ns) / std::ranges::min(hundred_k_ns),
          0,
          {},
          1.25});
}

}  // namespace lumigrove::bench
