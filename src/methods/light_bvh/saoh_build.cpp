// Builder `saoh`: top-down binned surface-area-orientation heuristic (Conty Estevez & Kulla 2018).
#include <tbb/blocked_range.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "methods/light_bvh/light_bvh_build.h"

namespace lumigrove {
namespace {

constexpr int kBins = 12;
constexpr std::uint32_t kTaskSize = 1024;    // smaller subtrees are built by one thread
constexpr std::uint32_t kReduceGrain = 4096;

struct Bin {
  EmitterCluster cluster;
  std::uint32_t count = 0;

  void add(const Bin& other) {
    cluster = unite(cluster, other.cluster);
    count += other.count;
  }
};
using Bins = std::array<std::array<Bin, kBins>, 3>;  // by axis

// Where centres lie, in bins.
struct BinGrid {
  Box3 centres;
  vec3 scale = vec3(0);  // 0 on axes without extent

  explicit BinGrid(const Box3& box) : centres(box) {
    for (int axis = 0; axis < 3; ++axis) {
      const float scale_of_axis = kBins / (box.hi[axis] - box.lo[axis]);
      if (box.hi[axis] > box.lo[axis] && is_finite(scale_of_axis)) scale[axis] = scale_of_axis;
    }
  }
  int bin_of(vec3 centre, int axis) const {
    const float at = (centre[axis] - centres.lo[axis]) * scale[axis];
    return std::clamp(static_cast<int>(at), 0, kBins - 1);
  }
};

// Bins 0 .. bin of the axis go to the left.
struct Split {
  int axis = -1, bin = 0;
};

class SaohBuilder {
 public:
  SaohBuilder(const BvhInput& input, const BvhOutput& output) : input_(input), output_(output) {
    std::iota(output_.leaf_places.begin(), output_.leaf_places.end(), 0u);
  }

  // The leaves first, ..., first + count - 1, with `node` as the place of their root.
  BvhPart build(std::uint32_t first, std::uint32_t count, std::uint32_t node) {
    if (count == 1) return leaf_part(input_, output_.leaf_places[first]);
    const std::uint32_t left_count = split(first, count);
    BvhPart left, right;
    const auto build_left = [&] { left = build(first, left_count, node + 1); };
    const auto build_right = [&] { right = build(first + left_count, count - left_count, node + left_count); };
    if (count > kTaskSize) {
      tbb::parallel_invoke(build_left, build_right);
    } else {
      build_left();
      build_right();
    }
    store_parts(output_.nodes[node], left, right, first);
    BvhPart both = unite(left, right);
    both.link = node;
    return both;
  }

 private:
  vec3 centre(std::uint32_t place) const { return input_.clusters[place].box.centre(); }

  // Sums over leaves, split the same way for any number of threads.
  template <class Sum, class Add, class Join>
  Sum reduce(std::uint32_t first, std::uint32_t count, const Add& add, const Join& join) const {
    const auto over = [&](const tbb::blocked_range<std::uint32_t>& range, Sum sum) {
      for (std::uint32_t i = range.begin(); i != range.end(); ++i) add(sum, output_.leaf_places[i]);
      return sum;
    };
    const tbb::blocked_range<std::uint32_t> all(first, first + count, kReduceGrain);
    if (count <= kReduceGrain) return over(all, Sum{});
    return tbb::parallel_deterministic_reduce(all, Sum{}, over, join);
  }

  // Orders the leaves and returns how many go to the left, at least one and not all.
  std::uint32_t split(std::uint32_t first, std::uint32_t count) {
    if (count == 2) return 1;
    const Box3 centres = reduce<Box3>(
        first, count, [&](Box3& box, std::uint32_t place) { box = unite(box, centre(place)); },
        [](const Box3& a, const Box3& b) { return unite(a, b); });
    const BinGrid grid(centres);
    const Bins bins = reduce<Bins>(
        first, count, [&](Bins& sum, std::uint32_t place) { add_to_bins(grid, place, sum); },
        [](Bins a, const Bins& b) {
          for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t bin = 0; bin < kBins; ++bin) a[axis][bin].add(b[axis][bin]);
          return a;
        });
    const Split best = cheapest_split(grid, bins);
    if (best.axis < 0) return count / 2;  // all centres at one place
    const auto begin = output_.leaf_places.begin() + first;
    const auto middle = std::partition(begin, begin + count, [&](std::uint32_t place) {
      return grid.bin_of(centre(place), best.axis) <= best.bin;
    });
    return static_cast<std::uint32_t>(middle - begin);
  }

  void add_to_bins(const BinGrid& grid, std::uint32_t place, Bins& bins) const {
    const Bin one{input_.clusters[place], 1};
    for (int axis = 0; axis < 3; ++axis)
      if (grid.scale[axis] > 0)
        bins[static_cast<std::size_t>(axis)][static_cast<std::size_t>(grid.bin_of(centre(place), axis))].add(one);
  }

  static Split cheapest_split(const BinGrid& grid, const Bins& bins) {
    const vec3 extent = grid.centres.extent();
    const float longest = max_component(extent), margin = 1e-3f * longest;
    Split best;
    float least = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(grid.scale[axis] > 0)) continue;
      const auto& row = bins[static_cast<std::size_t>(axis)];
      std::array<Bin, kBins> right;  // bins b and beyond
      right[kBins - 1] = row[kBins - 1];
      for (std::size_t b = kBins - 1; b-- > 0;) {
        right[b] = row[b];
        right[b].add(right[b + 1]);
      }
      Bin left;
      for (std::size_t b = 0; b + 1 < kBins; ++b) {
        left.add(row[b]);
        if (left.count == 0 || right[b + 1].count == 0) continue;
        // K_r = longest / extent of the axis keeps boxes from becoming thin.
        const float cost = (saoh_cost(left.cluster, margin) + saoh_cost(right[b + 1].cluster, margin)) *
                           (longest / extent[axis]);
        if (best.axis >= 0 && !(cost < least)) continue;
        best = {axis, static_cast<int>(b)};
        least = cost;
      }
    }
    return best;
  }

  const BvhInput& input_;
  const BvhOutput& output_;
};

}  // namespace

BvhPart build_saoh(const BvhInput& input, const BvhOutput& output) {
  return SaohBuilder(input, output).build(0, static_cast<std::uint32_t>(input.emitters.size()), 1);
}

}  // namespace lumigrove
