// Builder `agglomerative`: merges mutually nearest clusters from the bottom up (Walter et al. 2008), the pairs of a round
// at once. light_bvh.h says what is exact.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <vector>

#include "methods/light_bvh/light_bvh_build.h"

namespace lumigrove {
namespace {

constexpr std::uint32_t kNobody = 0xffffffffu;
constexpr std::uint32_t kGroup = 4;  // clusters below a leaf of the search tree

// Bounds from below what any pair with one of some clusters costs.
struct SearchBounds {
  vec3 least_hi = vec3(kInfinity), most_lo = vec3(-kInfinity);
  float least_intensity = kInfinity, least_spread = kInfinity;
};

SearchBounds unite(const SearchBounds& a, const SearchBounds& b) {
  return {glm::min(a.least_hi, b.least_hi), glm::max(a.most_lo, b.most_lo),
          std::min(a.least_intensity, b.least_intensity), std::min(a.least_spread, b.least_spread)};
}

// A cluster's nearest. Of equal costs the one whose number differs in the lowest bits: coincident lights then pair off
// all at once. The order is the same from both sides, so that the least pair of all is always mutual.
struct Nearest {
  float cost = kInfinity;
  std::uint32_t slot = kNobody;
};

class Agglomeration {
 public:
  explicit Agglomeration(const BvhInput& input)
      : input_(input),
        diagonal2_(input.scene_diagonal * input.scene_diagonal),
        clusters_(input.clusters.begin(), input.clusters.end()),
        spreads_(clusters_.size()),
        nearest_(clusters_.size()),
        parts_(clusters_.size()),
        changed_(clusters_.size(), 0) {
    for (std::uint32_t slot = 0; slot < clusters_.size(); ++slot) {
      spreads_[slot] = cone_spread(clusters_[slot].cone.angle);
      parts_[slot] = slot;
      active_.push_back(slot);
    }
  }

  // Pairs in the order of their merging: places of the input, and beyond them earlier pairs.
  struct Merge {
    std::uint32_t left, right;
  };
  std::vector<Merge> run() {
    while (active_.size() > 1) {
      build_search_tree();
      find_nearest();
      if (merge_mutual() == 0) merge_cheapest();
      drop_merged();
    }
    return std::move(merges_);
  }

 private:
  SearchBounds bounds_of(std::uint32_t slot) const {
    const EmitterCluster& c = clusters_[slot];
    return {c.box.hi, c.box.lo, c.intensity, spreads_[slot]};
  }

  // A perfect binary tree over the active clusters, which stay near Morton order as a merged one keeps the first's slot.
  void build_search_tree() {
    const auto count = static_cast<std::uint32_t>(active_.size());
    leaves_ = std::bit_ceil((count + kGroup - 1) / kGroup);
    tree_.assign(std::size_t{2} * leaves_, {});
    tbb::parallel_for(tbb::blocked_range<std::uint32_t>(0, count, 1024 * kGroup),
                      [&](const tbb::blocked_range<std::uint32_t>& range) {
                        const std::uint32_t end = (range.end() + kGroup - 1) / kGroup;
                        for (std::uint32_t leaf = (range.begin() + kGroup - 1) / kGroup; leaf < end; ++leaf)
                          for (std::uint32_t i = leaf * kGroup; i < std::min(count, (leaf + 1) * kGroup); ++i)
                            tree_[leaves_ + leaf] = unite(tree_[leaves_ + leaf], bounds_of(active_[i]));
                      });
    for (std::uint32_t node = leaves_; node-- > 1;) tree_[node] = unite(tree_[2 * node], tree_[2 * node + 1]);
  }

  void find_nearest() {
    searching_.clear();
    for (const std::uint32_t slot : active_)
      if (nearest_[slot].slot == kNobody) searching_.push_back(slot);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, searching_.size(), 16),
                      [&](const tbb::blocked_range<std::size_t>& range) {
                        for (std::size_t i = range.begin(); i != range.end(); ++i)
                          nearest_[searching_[i]] = search(searching_[i]);
                      });
  }

  float least_cost(std::uint32_t slot, const SearchBounds& bounds) const {
    const EmitterCluster& c = clusters_[slot];
    const vec3 extent = glm::max(c.box.hi, bounds.least_hi) - glm::min(c.box.lo, bounds.most_lo);
    return (c.intensity + bounds.least_intensity) *
           (length_squared(glm::max(extent, vec3(0))) + std::max(spreads_[slot], bounds.least_spread) * diagonal2_);
  }

  Nearest search(std::uint32_t slot) const {
    struct Waiting {
      std::uint32_t node;
      float cost;
    };
    constexpr float kRounding = 1 - 1e-6f;
    Waiting stack[40];
    int size = 0;
    stack[size++] = {1, 0};
    Nearest best;
    while (size > 0) {
      const Waiting next = stack[--size];
      if (next.cost * kRounding > best.cost) continue;
      if (next.node >= leaves_) {
        search_group(slot, (next.node - leaves_) * kGroup, best);
        continue;
      }
      Waiting a{2 * next.node, least_cost(slot, tree_[2 * next.node])};
      Waiting b{2 * next.node + 1, least_cost(slot, tree_[2 * next.node + 1])};
      if (a.cost < b.cost) std::swap(a, b);  // the cheaper on top
      if (!(a.cost * kRounding > best.cost)) stack[size++] = a;
      if (!(b.cost * kRounding > best.cost)) stack[size++] = b;
    }
    return best;
  }

  void search_group(std::uint32_t slot, std::uint32_t first, Nearest& best) const {
    const auto end = std::min(static_cast<std::uint32_t>(active_.size()), first + kGroup);
    for (std::uint32_t i = first; i < end; ++i) {
      const std::uint32_t other = active_[i];
      if (other == slot || least_cost(slot, bounds_of(other)) * (1 - 1e-6f) > best.cost) continue;
      const float cost = pair_cost(clusters_[slot], clusters_[other], diagonal2_);
      const bool nearer = cost < best.cost || best.slot == kNobody ||
                          (cost == best.cost && (other ^ slot) < (best.slot ^ slot));
      if (nearer) best = {cost, other};
    }
  }

  void merge(std::uint32_t a, std::uint32_t b) {
    merges_.push_back({parts_[a], parts_[b]});
    parts_[a] = static_cast<std::uint32_t>(clusters_.size() + merges_.size() - 1);
    clusters_[a] = unite(clusters_[a], clusters_[b]);
    spreads_[a] = cone_spread(clusters_[a].cone.angle);
    changed_[a] = 1;
    changed_[b] = 2;  // gone
  }

  int merge_mutual() {
    int merged = 0;
    for (const std::uint32_t slot : active_) {
      const std::uint32_t other = nearest_[slot].slot;
      if (other < slot || nearest_[other].slot != slot) continue;
      merge(slot, other);
      ++merged;
    }
    return merged;
  }

  // Rounding can make a pair cheaper than those that it was merged from: then no pair need be mutual.
  void merge_cheapest() {
    std::uint32_t cheapest = active_[0];
    for (const std::uint32_t slot : active_)
      if (nearest_[slot].cost < nearest_[cheapest].cost) cheapest = slot;
    const std::uint32_t other = nearest_[cheapest].slot;
    merge(std::min(cheapest, other), std::max(cheapest, other));
  }

  // A cluster whose nearest is unchanged keeps it: merged ones have only become dearer.
  void drop_merged() {
    for (const std::uint32_t slot : active_)
      if (changed_[slot] != 0 || changed_[nearest_[slot].slot] != 0) nearest_[slot] = {};
    std::erase_if(active_, [&](std::uint32_t slot) { return changed_[slot] == 2; });
    for (const std::uint32_t slot : active_) changed_[slot] = 0;
  }

  const BvhInput& input_;
  const float diagonal2_;
  // By slot: a cluster keeps the slot of its first emitter.
  std::vector<EmitterCluster> clusters_;
  std::vector<float> spreads_;
  std::vector<Nearest> nearest_;
  std::vector<std::uint32_t> parts_;
  std::vector<std::uint8_t> changed_;
  std::vector<std::uint32_t> active_, searching_;
  std::vector<SearchBounds> tree_;  // node k has children 2k and 2k + 1
  std::uint32_t leaves_ = 1;
  std::vector<Merge> merges_;
};

}  // namespace

BvhPart build_agglomerative(const BvhInput& input, const BvhOutput& output) {
  const auto count = static_cast<std::uint32_t>(input.emitters.size());
  const std::vector<Agglomeration::Merge> merges = Agglomeration(input).run();

  // Parts from the leaves up, then their places from the root down; no recursion, as the tree may be deep.
  std::vector<BvhPart> parts(count + merges.size());
  for (std::uint32_t i = 0; i < count; ++i) parts[i] = leaf_part(input, i);
  for (std::size_t m = 0; m < merges.size(); ++m)
    parts[count + m] = unite(parts[merges[m].left], parts[merges[m].right]);
  std::vector<std::uint32_t> first(parts.size(), 0);
  if (!merges.empty()) parts.back().link = 1;
  for (std::size_t m = merges.size(); m-- > 0;) {
    const BvhPart& both = parts[count + m];
    BvhPart &left = parts[merges[m].left], &right = parts[merges[m].right];
    if (left.count > 1) left.link = both.link + 1;
    if (right.count > 1) right.link = both.link + left.count;
    first[merges[m].left] = first[count + m];
    first[merges[m].right] = first[count + m] + left.count;
    store_parts(output.nodes[both.link], left, right, first[count + m]);
  }
  for (std::uint32_t i = 0; i < count; ++i) output.leaf_places[first[i]] = i;
  return parts.back();
}

}  // namespace lumigrove
