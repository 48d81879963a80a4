#include "methods/substitute_tree/substitute_tree.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <functional>

#include "base/direction_code.h"
#include "base/morton.h"
#include "light_fixtures.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

struct Lights {
  std::vector<Vpl> vpls;

  void add(vec3 position, vec3 normal, vec3 intensity = vec3(1)) {
    vpls.push_back({position, 1e-4f, normal, intensity});
  }
  VplView view() const {
    VplView view{vpls, {}, 1};
    for (const Vpl& vpl : vpls) view.bounds = unite(view.bounds, vpl.position);
    if (!vpls.empty()) view.diagonal = view.bounds.diagonal();
    return view;
  }
};

// On a floor, a ball and in the air; a few dark ones, a few coincident ones, intensities over three magnitudes.
Lights mixed_lights(int count, std::uint32_t seed = 1) {
  Lights lights;
  Stream random(seed);
  for (int i = 0; i < count; ++i) {
    const vec4 u = random.next(), v = random.next();
    const vec3 intensity = vec3(v) * std::pow(10.0f, 3 * v.w - 2) * (i % 17 == 0 ? 0.0f : 1.0f);
    const vec3 direction = random.direction();
    if (i % 29 == 1) {
      lights.vpls.push_back(lights.vpls[static_cast<std::size_t>(i) / 2]);
    } else if (u.w < 0.4f) {
      lights.add(vec3(u.x * 7, 0, u.z * 5), vec3(0, 1, 0), intensity);
    } else if (u.w < 0.8f) {
      lights.add(vec3(2, 1.5f, 3) + direction, direction, intensity);
    } else {
      lights.add(vec3(u) * vec3(7, 3, 5), direction, intensity);
    }
  }
  return lights;
}

constexpr SubstituteTree::Options kRadix{Topology::kRadix, 0.5f, 0.1f, kInfinity};
constexpr SubstituteTree::Options kPerfect{Topology::kPerfect, 0.5f, 0.1f, kInfinity};

SubstituteTree build(const Lights& lights, const SubstituteTree::Options& options = kRadix) {
  SubstituteTree tree;
  tree.build(lights.view(), options);
  return tree;
}

struct Range {
  std::uint32_t first = 0, last = 0;
  int depth = 0;  // of the deepest leaf below
};

bool is_leaf(const ChildRecord& child) { return (child.mean & ChildRecord::kLeaf) != 0; }
bool is_usable(const ChildRecord& child) { return (child.mean & ChildRecord::kUsable) != 0; }

// Calls visit(number, its leaves) of every inner node, children first.
using Visit = std::function<void(std::uint32_t, const Range&)>;
Range walk(const SubstituteTreeView& tree, std::uint32_t number, const Visit& visit) {
  const SubstituteNode& node = tree.nodes[number];
  std::array<Range, 2> below;
  for (std::uint32_t c = 0; c < 2; ++c) {
    const std::uint32_t child = node.split() + c;
    below[c] = is_leaf(node.child[c]) ? Range{child, child, 0} : walk(tree, child, visit);
  }
  EXPECT_EQ(below[0].last, node.split());
  EXPECT_EQ(below[1].first, node.split() + 1);
  const Range all{below[0].first, below[1].last, 1 + std::max(below[0].depth, below[1].depth)};
  visit(number, all);
  return all;
}

// The moments of leaves first..last, one after another in double.
struct Moments {
  double weight = 0, mean[3] = {}, covariance[6] = {};
  Box3 box;
};
Moments moments_of(const SubstituteTreeView& tree, std::uint32_t first, std::uint32_t last) {
  Moments m;
  for (std::uint32_t i = first; i <= last; ++i) {
    const Vpl& vpl = tree.leaf(i);
    const double w = luminance(vpl.intensity);
    m.weight += w;
    for (int k = 0; k < 3; ++k) m.mean[k] += w * static_cast<double>(vpl.position[k]);
    m.box = unite(m.box, vpl.position);
  }
  for (double& x : m.mean) x /= m.weight;
  constexpr int kRow[6] = {0, 1, 2, 0, 0, 1}, kColumn[6] = {0, 1, 2, 1, 2, 2};
  for (std::uint32_t i = first; i <= last; ++i) {
    const Vpl& vpl = tree.leaf(i);
    const double w = luminance(vpl.intensity) / m.weight;
    for (int k = 0; k < 6; ++k) {
      m.covariance[k] += w * (static_cast<double>(vpl.position[kRow[k]]) - m.mean[kRow[k]]) *
                         (static_cast<double>(vpl.position[kColumn[k]]) - m.mean[kColumn[k]]);
    }
  }
  return m;
}

void expect_distribution(const Distribution& d, const Moments& m) {
  const float size = m.box.diagonal();
  EXPECT_NEAR(luminance(d.intensity), m.weight, 1e-4 * m.weight);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(d.mean[k], m.mean[k], 1e-5f * size + 1e-6f);
    EXPECT_GE(d.mean[k], m.box.lo[k]);
    EXPECT_LE(d.mean[k], m.box.hi[k]);
  }
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(d.covariance[k], m.covariance[k], 1e-5f * size * size + 1e-12f);
  EXPECT_NEAR(glm::length(d.normal), 1, 1e-5);
}

void expect_record_holds(const SubstituteTreeView& tree, const ChildRecord& child, const Range& leaves) {
  const Moments m = moments_of(tree, leaves.first, leaves.last);
  const Box3 box = unpack_box(child);
  EXPECT_EQ(box.lo, m.box.lo);
  EXPECT_TRUE(glm::all(glm::greaterThanEqual(box.hi, m.box.hi)));
  const vec3 extent = unpack_extent(child), exact = m.box.extent();
  for (int k = 0; k < 3; ++k) {
    EXPECT_LE(extent[k], exact[k] * (1 + 1.0f / 64));
    EXPECT_NEAR(unpack_mean(child)[k], m.mean[k], extent[k] * (0.501f / ChildRecord::kMeanSteps) + 1e-5f);
  }
  EXPECT_NEAR(child.intensity, m.weight, 1e-4 * m.weight);
  for (std::uint32_t i = leaves.first; i <= leaves.last; ++i)
    EXPECT_LE(glm::length(tree.leaf(i).normal - child.cone.axis()), child.cone.width());
}

void expect_flag(bool usable, const Distribution& d, const Box3& box, const SubstituteTree::Options& options) {
  const float sigma = std::sqrt(std::max(0.0f, d.variance_along(d.normal)));
  const auto near = [](float a, float b) { return std::abs(a - b) < 1e-4f * b; };
  if (near(d.nu, options.min_nu) || near(sigma, options.max_sigma)) return;  // rounding may decide
  EXPECT_EQ(usable, d.nu >= options.min_nu && sigma <= options.max_sigma && box.diagonal() <= options.max_diagonal);
}

// Everything that must hold of every node; returns the depth.
int expect_sound(const SubstituteTreeView& tree, const SubstituteTree::Options& options) {
  std::vector<int> inner(tree.count, 0), leaves(tree.count, 0);
  std::vector<Range> ranges(tree.count);
  const Range all = walk(tree, 0, [&](std::uint32_t number, const Range& range) {
    ++inner[number];
    ranges[number] = range;
    const SubstituteNode& node = tree.nodes[number];
    const Distribution& d = tree.distributions[number];
    const Moments moments = moments_of(tree, range.first, range.last);
    expect_distribution(d, moments);
    EXPECT_GE(d.nu, 0);
    for (std::uint32_t c = 0; c < 2; ++c) {
      const std::uint32_t child = node.split() + c;
      const bool leaf = is_leaf(node.child[c]);
      if (leaf) ++leaves[child];
      const Range below = leaf ? Range{child, child, 0} : ranges[child];
      expect_record_holds(tree, node.child[c], below);
      EXPECT_LE(d.nu, leaf ? 1 : tree.distributions[child].nu);
      EXPECT_FALSE(leaf && is_usable(node.child[c]));
      if (!leaf) {
        const Box3 box = moments_of(tree, below.first, below.last).box;
        expect_flag(is_usable(node.child[c]), tree.distributions[child], box, options);
      }
    }
    if (number == 0) expect_flag(tree.root_usable, d, moments.box, options);
  });
  EXPECT_EQ(all.first, 0u);
  EXPECT_EQ(all.last, tree.count - 1);
  EXPECT_EQ(std::count(leaves.begin(), leaves.end(), 1), tree.count);
  EXPECT_EQ(std::count(inner.begin(), inner.end() - 1, 1), tree.count - 1);
  const Moments total = moments_of(tree, 0, tree.count - 1);
  EXPECT_NEAR(tree.intensity, total.weight, 1e-4 * total.weight);
  EXPECT_EQ(tree.bounds.lo, total.box.lo);
  EXPECT_EQ(tree.bounds.hi, total.box.hi);
  return all.depth;
}

TEST(SubstituteTree, EveryNodeHoldsItsLeavesAndTheirMoments) {
  // Of four, two shine.
  for (const int count : {4, 5, 7, 100, 1500}) {
    const Lights lights = mixed_lights(count);
    for (const SubstituteTree::Options& options : {kRadix, kPerfect}) {
      const SubstituteTree tree = build(lights, options);
      expect_sound(tree.view(), options);
    }
  }
}

TEST(SubstituteTree, LightsOfNoFinitePositiveIntensityAreLeftOut) {
  Lights lights = mixed_lights(500);
  lights.vpls[3].intensity = vec3(kInfinity, 1, 1);
  lights.vpls[4].intensity = vec3(std::numeric_limits<float>::quiet_NaN());
  lights.vpls[5].intensity = vec3(-1);
  const SubstituteTree tree = build(lights);
  std::vector<int> seen(lights.vpls.size(), 0);
  for (std::uint32_t i = 0; i < tree.view().count; ++i) ++seen[tree.view().leaves[i]];
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const float y = luminance(lights.vpls[i].intensity);
    EXPECT_EQ(seen[i], y > 0 && is_finite(y) ? 1 : 0) << i;
  }
  expect_sound(tree.view(), kRadix);
}

// Codes of all leaves, as the paper concatenates them: Morton code, direction, and the place in the order.
std::vector<std::uint64_t> codes_in_order(const Lights& lights, std::vector<std::uint32_t>& order) {
  struct Key {
    std::uint64_t code;
    std::uint32_t index;
  };
  const Box3 box = lights.view().bounds;
  std::vector<Key> keys;
  for (std::uint32_t i = 0; i < lights.vpls.size(); ++i) {
    const Vpl& vpl = lights.vpls[i];
    if (!(luminance(vpl.intensity) > 0)) continue;
    const std::uint64_t morton = morton30((vpl.position - box.lo) * inverse_extent(box));
    keys.push_back({morton << kDirectionBits | direction_code(vpl.normal), i});
  }
  std::stable_sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) { return a.code < b.code; });
  std::vector<std::uint64_t> codes;
  for (const Key& key : keys) {
    order.push_back(key.index);
    codes.push_back(key.code << 25 | codes.size());
  }
  return codes;
}

// Oracle: Karras' tree by recursion. Returns the splits of all inner nodes by number.
void split_serially(const std::vector<std::uint64_t>& codes, std::uint32_t first, std::uint32_t last,
                    std::uint32_t number, std::vector<std::uint32_t>& splits) {
  if (first == last) return;
  const int common = std::countl_zero(codes[first] ^ codes[last]);
  std::uint32_t split = first;
  while (std::countl_zero(codes[first] ^ codes[split + 1]) > common) ++split;
  splits[number] = split;
  split_serially(codes, first, split, split, splits);
  split_serially(codes, split + 1, last, split + 1, splits);
}

TEST(SubstituteTree, TopologyIsThatOfASerialRecursiveSplit) {
  for (const int count : {4, 5, 31, 200, 5000}) {
    const Lights lights = mixed_lights(count, 7);
    std::vector<std::uint32_t> order;
    std::vector<std::uint64_t> codes = codes_in_order(lights, order);
    for (const SubstituteTree::Options& options : {kRadix, kPerfect}) {
      if (options.topology == Topology::kPerfect)
        for (std::size_t i = 0; i < codes.size(); ++i) codes[i] = i;
      const SubstituteTree built = build(lights, options);
      const SubstituteTreeView tree = built.view();
      ASSERT_EQ(tree.count, order.size());
      EXPECT_TRUE(std::equal(order.begin(), order.end(), tree.leaves));
      std::vector<std::uint32_t> expected(order.size() - 1), actual;
      split_serially(codes, 0, tree.count - 1, 0, expected);
      for (std::uint32_t i = 0; i + 1 < tree.count; ++i) actual.push_back(tree.nodes[i].split());
      EXPECT_EQ(actual, expected);
    }
  }
}

TEST(SubstituteTree, PerfectTopologyIsAsShallowAsCanBe) {
  Stream random(3);
  Lights lights;
  for (std::uint32_t count = 1; count <= 300; ++count) {
    const vec3 x(random.next());
    lights.add(x * x * x, vec3(0, 1, 0));  // uneven
    if (count < 2) continue;
    const SubstituteTree tree = build(lights, kPerfect);
    EXPECT_EQ(walk(tree.view(), 0, [](std::uint32_t, const Range&) {}).depth, std::bit_width(count - 1)) << count;
  }
}

TEST(SubstituteTree, FlatLightsAreOneSubstitute) {
  for (const vec3 normal : {vec3(0, 1, 0), glm::normalize(vec3(1, -2, 0.5f))}) {
    Lights lights;
    const Frame frame = make_frame(normal);
    Stream random(4);
    for (int i = 0; i < 2000; ++i) {
      const vec4 u = random.next();
      lights.add(frame.x * (4 * u.x) + frame.y * u.y, normal, vec3(u.z, u.w, 0.2f));
    }
    const SubstituteTree tree = build(lights, {Topology::kRadix, 0.99f, 1e-3f, kInfinity});
    const SubstituteTreeView view = tree.view();
    EXPECT_TRUE(view.root_usable);
    const Distribution& root = view.distributions[0];
    EXPECT_LE(std::sqrt(std::max(0.0f, root.variance_along(root.normal))), 1e-3f);
    EXPECT_NEAR(root.nu, 1, 1e-3);
    expect_distribution(root, moments_of(view, 0, view.count - 1));
    // Their variances along the plane, of uniform coordinates over 4 m and 1 m with independent weights.
    EXPECT_NEAR(root.variance_along(frame.x), 16.0 / 12, 0.06);
    EXPECT_NEAR(root.variance_along(frame.y), 1.0 / 12, 0.004);
    // A cone of one normal does not grow on the way up.
    EXPECT_LE(view.nodes[0].child[0].cone.width(), 0.02f);
  }
}

TEST(SubstituteTree, PerpendicularWallsAreTwoSubstitutes) {
  Lights lights;
  Stream random(5);
  for (int i = 0; i < 1000; ++i) {
    const vec4 u = random.next();
    lights.add(vec3(0, u.y, u.z), vec3(1, 0, 0), vec3(u.w + 0.1f));
    lights.add(vec3(0.6f + 0.4f * u.x, 0, u.z), vec3(0, 1, 0), vec3(u.w + 0.1f));
  }
  const SubstituteTree tree = build(lights);
  EXPECT_FALSE(tree.view().root_usable);
  EXPECT_EQ(tree.view().distributions[0].nu, 0);
  EXPECT_TRUE(is_usable(tree.view().nodes[0].child[0]));
  EXPECT_TRUE(is_usable(tree.view().nodes[0].child[1]));
}

// Two planes of the same normal, one above the other: only sigma_z tells that they are not one surface.
TEST(SubstituteTree, DeviationFromThePlaneAndSizeBoundSubstitutes) {
  Lights lights;
  Stream random(6);
  for (int i = 0; i < 1000; ++i) {
    const vec4 u = random.next();
    lights.add(vec3(u.x, u.w < 0.5f ? 0 : 0.2f, u.z), vec3(0, 1, 0));
  }
  EXPECT_FALSE(build(lights, {Topology::kRadix, 0.5f, 0.09f, kInfinity}).view().root_usable);  // sigma_z = 0.1
  EXPECT_TRUE(build(lights, {Topology::kRadix, 0.5f, 0.11f, kInfinity}).view().root_usable);
  EXPECT_FALSE(build(lights, {Topology::kRadix, 0.5f, 0.11f, 1.3f}).view().root_usable);  // diagonal 1.43
  EXPECT_FALSE(build(lights, {Topology::kRadix, 1.5f, 0.11f, kInfinity}).view().root_usable);
}

TEST(SubstituteTree, NoLightAndOneLight) {
  SubstituteTree tree;
  tree.build(VplView{}, kRadix);
  EXPECT_EQ(tree.view().count, 0u);
  EXPECT_EQ(tree.view().intensity, 0);
  EXPECT_TRUE(tree.view().bounds.empty());
  Lights lights;
  lights.add(vec3(1, 2, 3), vec3(0, 1, 0), vec3(0));
  tree.build(lights.view(), kRadix);
  EXPECT_EQ(tree.view().count, 0u);
  lights.add(vec3(4, 5, 6), vec3(0, 1, 0), vec3(2));
  tree.build(lights.view(), kRadix);
  ASSERT_EQ(tree.view().count, 1u);
  EXPECT_EQ(tree.view().leaf(0).position, vec3(4, 5, 6));
  EXPECT_NEAR(tree.view().intensity, 2, 1e-5);
  EXPECT_FALSE(tree.view().root_usable);
  EXPECT_EQ(tree.view().bounds.lo, vec3(4, 5, 6));
}

TEST(SubstituteTree, CoincidentOpposedAndFaintLightsAreSafe) {
  Lights coincident, opposed, faint;
  for (int i = 0; i < 1000; ++i) {
    coincident.add(vec3(1, 2, 3), vec3(0, 0, 1));
    opposed.add(vec3(static_cast<float>(i % 7), 0, 0), vec3(0, i % 2 == 0 ? 1 : -1, 0));
    faint.add(vec3(static_cast<float>(i % 10), static_cast<float>(i / 10), 0), vec3(0, 0, 1), vec3(1e-44f));
  }
  const SubstituteTree a = build(coincident), b = build(opposed), c = build(faint);
  EXPECT_EQ(expect_sound(a.view(), kRadix), 10);  // ties are split by position: a balanced tree
  EXPECT_TRUE(a.view().root_usable);
  expect_sound(b.view(), kRadix);
  EXPECT_FALSE(b.view().root_usable);
  EXPECT_EQ(b.view().distributions[0].nu, 0);
  EXPECT_EQ(c.view().count, 1000u);
  for (std::uint32_t i = 0; i + 1 < c.view().count; ++i) {
    EXPECT_TRUE(is_finite(c.view().distributions[i].mean));
    EXPECT_TRUE(is_finite(c.view().distributions[i].variance_along(vec3(1, 0, 0))));
  }
}

template <class T>
bool same_bits(const T* a, const T* b, std::size_t count) {
  return std::memcmp(a, b, count * sizeof(T)) == 0;
}
void expect_same(const SubstituteTreeView& a, const SubstituteTreeView& b) {
  ASSERT_EQ(a.count, b.count);
  EXPECT_TRUE(same_bits(a.nodes, b.nodes, a.count - 1));
  EXPECT_TRUE(same_bits(a.distributions, b.distributions, a.count - 1));
  EXPECT_TRUE(same_bits(a.leaves, b.leaves, a.count));
  EXPECT_EQ(a.root_usable, b.root_usable);
  EXPECT_EQ(a.intensity, b.intensity);
}

TEST(SubstituteTree, SameBitsForAnyThreadCount) {
  const Lights lights = mixed_lights(60000);
  for (const SubstituteTree::Options& options : {kRadix, kPerfect}) {
    std::vector<SubstituteTree> trees;
    for (const std::size_t threads : {1u, 2u, 4u}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      trees.push_back(build(lights, options));
    }
    expect_same(trees[0].view(), trees[1].view());
    expect_same(trees[0].view(), trees[2].view());
  }
}

TEST(SubstituteTree, BuildingAgainLeavesNoTraces) {
  const Lights many = mixed_lights(3000), few = mixed_lights(700, 9);
  SubstituteTree again = build(many, kPerfect);
  again.build(few.view(), kRadix);
  expect_same(again.view(), build(few).view());
  again.build(many.view(), kRadix);
  expect_same(again.view(), build(many).view());
}

TEST(SubstituteTree, ScalingTheLightsChangesNoSplitAndNoFlag) {
  constexpr float kScale = 1024;  // a power of two: exact in floating point
  const Lights lights = mixed_lights(2000);
  Lights scaled = lights;
  for (Vpl& vpl : scaled.vpls) {
    vpl.position *= kScale;
    vpl.intensity *= kScale * kScale;
  }
  const SubstituteTree a = build(lights);
  const SubstituteTree b = build(scaled, {Topology::kRadix, 0.5f, 0.1f * kScale, kInfinity});
  ASSERT_EQ(a.view().count, b.view().count);
  for (std::uint32_t i = 0; i + 1 < a.view().count; ++i) {
    EXPECT_EQ(a.view().nodes[i].split(), b.view().nodes[i].split());
    for (int c = 0; c < 2; ++c) EXPECT_EQ(a.view().nodes[i].child[c].mean, b.view().nodes[i].child[c].mean);
  }
}

TEST(SubstituteTree, StaysWithinItsBytes) {
  const SubstituteTree tree = build(mixed_lights(5000));
  EXPECT_LE(tree.bytes(), (64 + 64 + 4) * std::size_t{tree.view().count});
}

TEST(ChildRecord, PackedBoxesHoldTheExactOnes) {
  Stream random(10);
  std::vector<Box3> boxes = {{vec3(-1), vec3(std::ldexp(1.0f, -30))}, {vec3(5), vec3(5)},
                             {vec3(0), vec3(1e-40f)},                 {vec3(-1e30f), vec3(1e30f)}};
  for (int i = 0; i < 20000; ++i) {
    const vec3 p = random.in_box(vec3(-10), vec3(10));
    const vec3 q = p * (1 + 0.1f * random.next().x) + random.in_box(vec3(-1), vec3(1)) * random.next().y;
    boxes.push_back(unite(Box3{p, p}, q));
  }
  for (const Box3& box : boxes) {
    const vec3 mean = glm::mix(box.lo, box.hi, vec3(random.next()));
    ChildRecord child;
    pack_child(box, mean, {1, 2, 3, 4}, 5, ChildRecord::kUsable, 0xabcd, child);
    const Box3 held = unpack_box(child);
    EXPECT_EQ(held.lo, box.lo);
    EXPECT_TRUE(glm::all(glm::greaterThanEqual(held.hi, box.hi)));
    for (int k = 0; k < 3; ++k) {
      const float extent = box.hi[k] - box.lo[k];
      EXPECT_LE(unpack_extent(child)[k], extent * (1 + 1.0f / 64) + 1e-39f);
      const float rounding = 2e-6f * std::max(std::abs(box.lo[k]), std::abs(box.hi[k]));
      EXPECT_NEAR(unpack_mean(child)[k], mean[k], extent * (0.51f / ChildRecord::kMeanSteps) + rounding + 1e-39f);
    }
    EXPECT_EQ(child.extent_z & 0xffffu, 0xabcdu);
    EXPECT_TRUE(is_usable(child) && !is_leaf(child));
    EXPECT_EQ(child.cone.z, 3);
  }
}

TEST(PackedCone, UnionHoldsBothAndRepeatedUnionDoesNotGrow) {
  Stream random(11);
  for (int i = 0; i < 20000; ++i) {
    const vec3 n = random.direction();
    const float spread = random.next().x;
    std::vector<vec3> normals;
    for (int k = 0; k < 8; ++k) normals.push_back(glm::normalize(n + random.direction() * (spread * 1.5f)));
    PackedCone cones[8];
    for (int k = 0; k < 8; ++k) cones[k] = pack_normal(normals[static_cast<std::size_t>(k)]);
    for (int step = 4; step > 0; step /= 2)
      for (int k = 0; k < step; ++k) cones[k] = unite(cones[2 * k], cones[2 * k + 1]);
    for (const vec3 normal : normals) EXPECT_LE(glm::length(normal - cones[0].axis()), cones[0].width());
    const PackedCone one = pack_normal(n);
    EXPECT_EQ(unite(one, one).radius, one.radius);
    EXPECT_LE(one.width(), 0.02f);
  }
}

}  // namespace
}  // namespace lumigrove
