#include "methods/substitute_tree/substitute_walk_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "methods/vpl_sampling/vpl_sampler_kernel.h"
#include "statistics.h"
#include "substitute_fixtures.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

struct Config {
  Topology topology;
  Weights weight;
  bool cones, gloss, substitutes;
};

std::string name_of(const Config& c) {
  const char* weight = c.weight == Weights::kYuksel ? "yuksel" : c.weight == Weights::kInBox ? "in-box" : "distance-bounded";
  return std::string(c.topology == Topology::kRadix ? "radix, " : "perfect, ") + weight +
         (c.cones ? ", cones" : "") + (c.gloss ? ", gloss" : "") + (c.substitutes ? ", substitutes" : "");
}

std::vector<Config> configs(Topology topology, bool substitutes = false) {
  std::vector<Config> all;
  for (const Weights weight : {Weights::kDistanceBounded, Weights::kInBox, Weights::kYuksel})
    for (const bool cones : {false, true})
      for (const bool gloss : {false, true})
        if (!(gloss && substitutes)) all.push_back({topology, weight, cones, gloss, substitutes});
  return all;
}

// The walk's functions take the lobe as a template argument.
void walk_all(const SubstituteWalk& walk, bool gloss, const SubstituteWalkPoints& points, int count, WalkResult* out) {
  gloss ? walk_substitute_tree<true>(walk, points, count, out) : walk_substitute_tree<false>(walk, points, count, out);
}
float pdf_of_leaf(const SubstituteWalk& walk, bool gloss, const SubstituteWalkPoints& points, int i,
                  std::uint32_t leaf) {
  return gloss ? pdf_substitute_leaf<true>(walk, points, i, leaf) : pdf_substitute_leaf<false>(walk, points, i, leaf);
}
vec2 probabilities(const SubstituteWalk& walk, bool gloss, const SubstituteWalkPoints& points, int i,
                   std::uint32_t node) {
  return gloss ? child_probabilities<true>(walk, points, i, node) : child_probabilities<false>(walk, points, i, node);
}

struct Child {
  std::uint32_t number;
  bool leaf, usable;
};
Child child_of(const SubstituteTreeView& tree, std::uint32_t node, int side) {
  const SubstituteNode& n = tree.nodes[node];
  const std::uint32_t flags = n.child[side].mean;
  return {n.split() + static_cast<std::uint32_t>(side), (flags & ChildRecord::kLeaf) != 0,
          (flags & ChildRecord::kUsable) != 0};
}

// Where walks of a point can end, and how likely, by going down every branch. Leaves first, then inner nodes, then one
// entry for dead branches.
struct Ends {
  std::vector<double> probability;
  std::vector<int> depth;

  double total() const {
    double sum = 0;
    for (const double p : probability) sum += p;
    return sum;
  }
};

std::size_t end_index(const SubstituteTreeView& tree, const WalkResult& result) {
  if (result.end == WalkEnd::kDead) return 2 * std::size_t{tree.count};
  return result.node + (result.end == WalkEnd::kSubstitute ? std::size_t{tree.count} : 0);
}

Ends enumerate_ends(const SubstituteWalk& walk, bool gloss, const SubstituteWalkPoints& points, int i) {
  const SubstituteTreeView& tree = walk.tree;
  Ends ends{std::vector<double>(2 * std::size_t{tree.count} + 1, 0), std::vector<int>(2 * std::size_t{tree.count} + 1)};
  const bool stops = walk.substitutes && !gloss;
  if (tree.count == 1 || (stops && tree.root_usable)) {
    ends.probability[tree.count == 1 ? 0 : tree.count] = 1;
    return ends;
  }
  struct Place {
    std::uint32_t node;
    double probability;
    int depth;
  };
  std::vector<Place> open{{0, 1, 0}};
  while (!open.empty()) {
    const Place at = open.back();
    open.pop_back();
    const vec2 p = probabilities(walk, gloss, points, i, at.node);
    if (!(p.x + p.y > 0)) ends.probability.back() += at.probability;
    for (int side = 0; side < 2; ++side) {
      const Child child = child_of(tree, at.node, side);
      const double probability = at.probability * static_cast<double>(p[side]);
      if (child.leaf || (stops && child.usable)) {
        const std::size_t end = child.number + (child.leaf ? std::size_t{0} : std::size_t{tree.count});
        ends.probability[end] = probability;
        ends.depth[end] = at.depth + 1;
      } else {
        open.push_back({child.number, probability, at.depth + 1});
      }
    }
  }
  return ends;
}

// In one place: copied to several, products and sums of frames and mirror directions may be fused differently.
[[gnu::noipa]] void set_point(SubstituteWalkPoints& points, int i, const Surface& surface, vec3 numbers) {
  points.set(i, surface, numbers, true);
}

SubstituteWalkPoints points_of(std::span<const Surface> surfaces, Stream& random) {
  SubstituteWalkPoints points;
  for (std::size_t i = 0; i < surfaces.size(); ++i)
    set_point(points, static_cast<int>(i), surfaces[i], vec3(random.next()));
  return points;
}

// Every set of lights in every configuration.
template <class Claim>
void for_every_walk(bool substitutes, const Claim& claim) {
  for (const NamedVpls& set : vpl_sets()) {
    for (const Topology topology : {Topology::kRadix, Topology::kPerfect}) {
      const VplTree tree(set.vpls, topology);
      for (const Config& config : configs(topology, substitutes)) {
        SCOPED_TRACE(set.name + ", " + name_of(config));
        claim(tree.walk(config.weight, config.cones, substitutes), config.gloss);
      }
    }
  }
}

// --- probabilities -----------------------------------------------------------------------------------------------

TEST(SubstituteWalk, ProbabilitiesOfTheLeavesSumToOneLessDeadBranches) {
  const std::vector<Surface> surfaces = walk_surfaces(24);
  Stream random(1);
  const SubstituteWalkPoints points = points_of(surfaces, random);
  int whole = 0, dead = 0;
  RunningMean lost;
  for_every_walk(false, [&](const SubstituteWalk& walk, bool gloss) {
    for (int i = 0; i < 24; ++i) {
      const Ends ends = enumerate_ends(walk, gloss, points, i);
      double sum = 0;
      for (std::uint32_t leaf = 0; leaf < walk.tree.count; ++leaf) {
        const double p = pdf_of_leaf(walk, gloss, points, i, leaf);
        ASSERT_NEAR(p, ends.probability[leaf], 1e-5 * p + 1e-30) << "point " << i << ", leaf " << leaf;
        sum += p;
      }
      ASSERT_NEAR(sum + ends.probability.back(), 1, 1e-4) << "point " << i;
      whole += sum > 1 - 1e-4;
      dead += sum < 1e-4;
      if (sum > 1e-4) lost.add(1 - sum);
    }
  });
  // A box above the horizon may hold none but boxes below it: then a part is lost.
  EXPECT_GT(whole, 1000);
  EXPECT_GT(dead, 50);
  EXPECT_LT(lost.mean(), 0.15);
}

TEST(SubstituteWalk, FiveThousandLightsSumToOne) {
  const NamedVpls set = cloud(5000);
  Stream random(2);
  const std::vector<Surface> surfaces = walk_surfaces(6);
  const SubstituteWalkPoints points = points_of(surfaces, random);
  for (const Topology topology : {Topology::kRadix, Topology::kPerfect}) {
    const VplTree tree(set.vpls, topology);
    for (const Config& config : configs(topology)) {
      for (int i = 0; i < 6; ++i) {
        const Ends ends = enumerate_ends(tree.walk(config.weight, config.cones), config.gloss, points, i);
        EXPECT_NEAR(ends.total(), 1, 1e-4) << name_of(config) << ", point " << i;
      }
    }
  }
}

// Many walks from one point in batches, some of them partial.
struct Frequencies {
  std::vector<double> counts;
  int walks = 0;
};
template <class Check>
Frequencies count_ends(const SubstituteWalk& walk, bool gloss, const Surface& surface, int batches, Stream& random,
                       const Check& check) {
  Frequencies seen{std::vector<double>(2 * std::size_t{walk.tree.count} + 1, 0), 0};
  SubstituteWalkPoints points;
  std::array<WalkResult, kSubstituteWalks> results;
  for (int batch = 0; batch < batches; ++batch) {
    const int count = batch % 2 == 0 ? kSubstituteWalks : 1 + batch % kSubstituteWalks;
    for (int i = 0; i < count; ++i) set_point(points, i, surface, vec3(random.next()));
    walk_all(walk, gloss, points, count, results.data());
    for (int i = 0; i < count; ++i) {
      ++seen.counts[end_index(walk.tree, results[static_cast<std::size_t>(i)])];
      check(points, i, results[static_cast<std::size_t>(i)]);
    }
    seen.walks += count;
  }
  return seen;
}

// Frequencies, the probability that every walk reports, and its steps, against all ends enumerated.
void expect_ends_as_enumerated(bool substitutes) {
  int tested = 0;
  Stream random(3);
  for_every_walk(substitutes, [&](const SubstituteWalk& walk, bool gloss) {
    const std::vector<Surface> surfaces = walk_surfaces(3, 50 + static_cast<std::uint32_t>(tested++ % 5));
    for (const Surface& surface : surfaces) {
      SubstituteWalkPoints one;
      set_point(one, 0, surface, vec3(0));
      const Ends ends = enumerate_ends(walk, gloss, one, 0);
      const Frequencies seen =
          count_ends(walk, gloss, surface, 60, random, [&](const SubstituteWalkPoints&, int, const WalkResult& result) {
            const std::size_t end = end_index(walk.tree, result);
            if (result.end == WalkEnd::kDead) {
              ASSERT_EQ(result.pdf, 0.0f);
              return;
            }
            ASSERT_NEAR(result.pdf, ends.probability[end], 1e-5 * ends.probability[end]);
            ASSERT_EQ(result.steps, ends.depth[end]);
          });
      std::vector<double> expected;
      for (const double p : ends.probability) expected.push_back(p * seen.walks);
      // About 500 tests: one false alarm in two thousand such programs.
      ASSERT_GT(chi_square_p_value(seen.counts, expected), 1e-6);
    }
  });
}

TEST(SubstituteWalk, FrequenciesOfLeavesFollowTheirProbabilities) { expect_ends_as_enumerated(false); }
TEST(SubstituteWalk, FrequenciesOfSubstitutesFollowTheirProbabilities) { expect_ends_as_enumerated(true); }

TEST(SubstituteWalk, FrequenciesOverManyStepsFollowTheirProbabilities) {
  for (const Topology topology : {Topology::kRadix, Topology::kPerfect}) {
    const VplTree tree(cloud(5000).vpls, topology);
    const SubstituteWalk walk = tree.walk(Weights::kDistanceBounded);
    Stream random(5);
    for (const Surface& surface : walk_surfaces(3)) {
      SubstituteWalkPoints one;
      set_point(one, 0, surface, vec3(0));
      const Ends ends = enumerate_ends(walk, false, one, 0);
      const Frequencies seen =
          count_ends(walk, false, surface, 2500, random, [](const SubstituteWalkPoints&, int, const WalkResult&) {});
      std::vector<double> expected;
      for (const double p : ends.probability) expected.push_back(p * seen.walks);
      EXPECT_GT(chi_square_p_value(seen.counts, expected), 1e-4);
    }
  }
}

TEST(SubstituteWalk, ReportsThePdfOfItsLeafBitForBit) {
  const std::vector<Surface> surfaces = walk_surfaces(kSubstituteWalks);
  Stream random(6);
  const SubstituteWalkPoints points = points_of(surfaces, random);
  std::array<WalkResult, kSubstituteWalks> results;
  int compared = 0;
  for (const bool substitutes : {false, true}) {
    for_every_walk(substitutes, [&](const SubstituteWalk& walk, bool gloss) {
      walk_all(walk, gloss, points, kSubstituteWalks, results.data());
      for (int i = 0; i < kSubstituteWalks; ++i) {
        const WalkResult& result = results[static_cast<std::size_t>(i)];
        if (result.end != WalkEnd::kLeaf) continue;
        ASSERT_EQ(result.pdf, pdf_of_leaf(walk, gloss, points, i, result.node)) << i;
        ++compared;
      }
    });
  }
  EXPECT_GT(compared, 3000);
}

// --- nothing is left out -----------------------------------------------------------------------------------------

// Every other one has a light near its horizon, where rounding decides.
std::vector<Surface> surfaces_for(const NamedVpls& set, int n, vec3 origin) {
  std::vector<Surface> surfaces = walk_surfaces(n, 71);
  Stream random(72);
  for (int i = 0; i < n; ++i) {
    Surface& s = surfaces[static_cast<std::size_t>(i)];
    s.position += origin;
    if (i % 2 == 0) continue;
    const Vpl& vpl = set.vpls[static_cast<std::size_t>(i) % set.vpls.size()];
    const vec3 to_light = vpl.position - s.position;
    const vec3 across = glm::cross(to_light, random.direction());
    if (!(glm::length(across) > 0)) continue;
    s = glossy_surface(s.position, glm::normalize(glm::normalize(across) + glm::normalize(to_light) * 1e-7f),
                       to_light, s.roughness);
  }
  return surfaces;
}

void expect_nothing_left_out(const NamedVpls& set, const std::vector<Surface>& surfaces, int& lit, int& grazing) {
  Stream random(7);
  for (const Topology topology : {Topology::kRadix, Topology::kPerfect}) {
    const VplTree tree(set.vpls, topology);
    const SubstituteTreeView view = tree.view();
    for (const Config& config : configs(topology)) {
      SCOPED_TRACE(set.name + ", " + name_of(config));
      const SubstituteWalk walk = tree.walk(config.weight, config.cones);
      const Lobes lobe = config.gloss ? Lobes::kGloss : Lobes::kDiffuse;
      for (const Surface& surface : surfaces) {
        SubstituteWalkPoints points;
        set_point(points, 0, surface, vec3(random.next()));
        const Ends ends = enumerate_ends(walk, config.gloss, points, 0);
        for (std::uint32_t leaf = 0; leaf < view.count; ++leaf) {
          const Vpl& vpl = view.leaf(leaf);
          if (!(max_component(vpl_light(surface, exact_vpl(vpl, 1), kInfinity, lobe)) > 0)) continue;
          ++lit;
          const vec3 to_light = vpl.position - surface.position;
          grazing += glm::dot(to_light, surface.normal) < 1e-5f * glm::length(to_light);
          ASSERT_GT(ends.probability[leaf], 0) << "leaf " << leaf;
        }
      }
    }
  }
}

TEST(SubstituteWalk, EveryLightThatContributesHasAProbability) {
  int lit = 0, grazing = 0;
  for (const NamedVpls& set : vpl_sets())
    expect_nothing_left_out(set, surfaces_for(set, 60, vec3(0)), lit, grazing);
  EXPECT_GT(lit, 100000);
  EXPECT_GT(grazing, 500);
}

TEST(SubstituteWalk, EveryLightThatContributesHasAProbabilityFarFromTheOrigin) {
  int lit = 0, grazing = 0;
  const vec3 origin(1000, -2000, 500);
  for (NamedVpls set : {flat_plane(40), cloud(60)}) {
    for (Vpl& vpl : set.vpls) vpl.position += origin;
    expect_nothing_left_out(set, surfaces_for(set, 100, origin), lit, grazing);
  }
  EXPECT_GT(lit, 20000);
  EXPECT_GT(grazing, 100);
}

// --- lanes, batches, scale ---------------------------------------------------------------------------------------

void expect_same(const WalkResult& a, const WalkResult& b) {
  ASSERT_EQ(a.end, b.end);
  ASSERT_EQ(a.node, b.node);
  ASSERT_EQ(a.pdf, b.pdf);
  ASSERT_EQ(a.steps, b.steps);
}

TEST(SubstituteWalk, ResultDependsOnNeitherLaneNorBatch) {
  const std::vector<Surface> surfaces = walk_surfaces(kSubstituteWalks, 81);
  Stream random(8);
  std::vector<vec3> numbers;
  for (int i = 0; i < kSubstituteWalks; ++i) numbers.emplace_back(random.next());
  for (const bool substitutes : {false, true}) {
    for_every_walk(substitutes, [&](const SubstituteWalk& walk, bool gloss) {
      SubstituteWalkPoints all, turned, some, alone;
      std::array<WalkResult, kSubstituteWalks> a, b, c, d;
      constexpr int kTurn = 5, kSome = kSubstituteWalks / 2 - 3;
      for (int i = 0; i < kSubstituteWalks; ++i) {
        const auto k = static_cast<std::size_t>(i);
        set_point(all, i, surfaces[k], numbers[k]);
        set_point(turned, (i + kTurn) % kSubstituteWalks, surfaces[k], numbers[k]);
        if (i < kSome) set_point(some, i, surfaces[k], numbers[k]);
      }
      walk_all(walk, gloss, all, kSubstituteWalks, a.data());
      walk_all(walk, gloss, turned, kSubstituteWalks, b.data());
      walk_all(walk, gloss, some, kSome, c.data());
      for (std::size_t i = 0; i < kSubstituteWalks; ++i) {
        expect_same(a[i], b[(i + kTurn) % kSubstituteWalks]);
        if (i < kSome) expect_same(a[i], c[i]);
        if (i % 7 != 0) continue;
        set_point(alone, 0, surfaces[i], numbers[i]);
        walk_all(walk, gloss, alone, 1, d.data());
        expect_same(a[i], d[0]);
      }
    });
  }
}

TEST(SubstituteWalk, ScalingTheSceneChangesNoWalk) {
  for (const float scale : {1024.0f, 1000.0f}) {
    int walks = 0, same = 0;
    for (const NamedVpls& set : vpl_sets()) {
      std::vector<Vpl> scaled = set.vpls;
      for (Vpl& vpl : scaled) vpl.position *= scale;
      for (const Topology topology : {Topology::kRadix, Topology::kPerfect}) {
        const VplTree a(set.vpls, topology), b(scaled, topology, {topology, 0.5f, 0.3f * scale, kInfinity});
        for (const bool substitutes : {false, true}) {
          for (const Config& config : configs(topology, substitutes)) {
            SCOPED_TRACE(set.name + ", " + name_of(config));
            const SubstituteWalk here = a.walk(config.weight, config.cones, substitutes);
            SubstituteWalk there = b.walk(config.weight, config.cones, substitutes);
            there.floor2 *= scale * scale;
            there.inside2 *= scale * scale;
            std::vector<Surface> surfaces = walk_surfaces(kSubstituteWalks, 91);
            Stream random(9), again(9);
            const SubstituteWalkPoints points = points_of(surfaces, random);
            for (Surface& s : surfaces) s.position *= scale;
            const SubstituteWalkPoints scaled_points = points_of(surfaces, again);
            std::array<WalkResult, kSubstituteWalks> one, other;
            walk_all(here, config.gloss, points, kSubstituteWalks, one.data());
            walk_all(there, config.gloss, scaled_points, kSubstituteWalks, other.data());
            for (std::size_t i = 0; i < kSubstituteWalks; ++i) {
              ++walks;
              same += one[i].end == other[i].end && one[i].node == other[i].node;
              if (scale == 1024.0f) {
                ASSERT_NO_FATAL_FAILURE(expect_same(one[i], other[i]));
              }
            }
          }
        }
      }
    }
    // By 1000 the extents of boxes are rounded to other 8 bits, up to 1/128 larger: probabilities change that little.
    EXPECT_GT(same, 0.97 * walks) << same << " of " << walks;
  }
}

// --- weights -----------------------------------------------------------------------------------------------------

using dvec3 = glm::dvec3;

// Equation 5 for one child, in double and by scalar code of its own.
struct Oracle {
  const SubstituteWalk& walk;
  const Surface& s;
  bool gloss;

  struct Value {
    double shine, mean2, near2, diagonal2;
    double slack;           // what rounding may change
    bool certain = true;    // whether no decision hangs on rounding
  };

  static dvec3 in_double(vec3 v) { return dvec3(v); }

  Value child(const ChildRecord& record) const {
    const dvec3 x = in_double(s.position), lo = in_double(record.lo) - x;
    const dvec3 extent = in_double(unpack_extent(record)), hi = lo + extent;
    Value v{};
    const dvec3 mean(static_cast<double>(record.mean & 1023), static_cast<double>((record.mean >> 10) & 1023),
                     static_cast<double>((record.mean >> 20) & 1023));
    const dvec3 p = lo + extent * mean / 1023.0;
    v.mean2 = glm::dot(p, p);
    const dvec3 near = glm::max(glm::max(lo, -hi), dvec3(0));
    v.near2 = glm::dot(near, near);
    v.diagonal2 = glm::dot(extent, extent);
    const double size = glm::length(glm::max(glm::abs(lo), glm::abs(hi)));
    v.certain = v.near2 > 1e-6 * size * size || inside_by(lo, hi) > 1e-6 * size;
    const double cosine = bound_at_surface(lo, hi);
    v.shine = static_cast<double>(record.intensity) * cosine;
    v.slack = 1e-5 / std::max(cosine, 1e-12);
    if (gloss) v.shine *= lobe(towards(lo, hi, v.certain));
    if (walk.cones) v.shine *= bound_at_lights(record.cone, lo, hi);
    return v;
  }

  // Highest point of the turned box over its nearest distance from the normal.
  double bound_at_surface(dvec3 lo, dvec3 hi) const {
    const Frame frame = make_frame(s.normal);
    const dvec3 n(s.normal), axes[2] = {dvec3(frame.x), dvec3(frame.y)};
    double top = -1e300, low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
    for (int c = 0; c < 8; ++c) {
      const dvec3 corner(c & 1 ? hi.x : lo.x, c & 2 ? hi.y : lo.y, c & 4 ? hi.z : lo.z);
      top = std::max(top, glm::dot(n, corner));
      for (int a = 0; a < 2; ++a) {
        low[a] = std::min(low[a], glm::dot(axes[a], corner));
        high[a] = std::max(high[a], glm::dot(axes[a], corner));
      }
    }
    const dvec3 centre = 0.5 * (lo + hi), half = 0.5 * (hi - lo);
    top += 2e-6 * (glm::dot(glm::abs(centre), dvec3(1)) + glm::dot(half, dvec3(1)));
    if (top <= 0) return 0;
    double aside2 = 0;
    for (int a = 0; a < 2; ++a) aside2 += std::pow(std::max({0.0, low[a], -high[a]}), 2);
    return top / std::sqrt(top * top + aside2);
  }

  double bound_at_lights(PackedCone cone, dvec3 lo, dvec3 hi) const {
    const dvec3 axis = dvec3(cone.x, cone.y, cone.z) / 127.0, centre = 0.5 * (lo + hi), half = 0.5 * (hi - lo);
    const dvec3 near = glm::max(glm::max(lo, -hi), dvec3(0));
    const double far = glm::length(glm::abs(centre) + half), radius = cone.radius * (2 / 255.0);
    const double facing = glm::dot(glm::abs(axis), half) - glm::dot(axis, centre) + 1.41422 * radius * far;
    return std::min(1.0, std::max(facing, 0.0) / std::max(glm::length(near), 1e-15));
  }

  dvec3 mirror() const { return 2 * glm::dot(dvec3(s.normal), dvec3(s.wo)) * dvec3(s.normal) - dvec3(s.wo); }

  static double inside_by(dvec3 lo, dvec3 hi) {
    return std::min({-lo.x, -lo.y, -lo.z, hi.x, hi.y, hi.z});
  }

  // `certain` is cleared where two candidates are as good as one another.
  dvec3 towards(dvec3 lo, dvec3 hi, bool& certain) const {
    const dvec3 r = mirror();
    if (inside_by(lo, hi) >= 0) return r;
    std::vector<dvec3> candidates{glm::normalize(glm::clamp(dvec3(0), lo, hi))};
    for (int axis = 0; axis < 3; ++axis) {
      if (std::abs(r[axis]) < 1e-6) continue;
      for (const double plane : {lo[axis], hi[axis]}) {
        const double t = plane / r[axis];
        const dvec3 p = glm::clamp(r * t, lo, hi);
        if (t > 0 && glm::length(p) > 0) candidates.push_back(glm::normalize(p));
      }
    }
    std::sort(candidates.begin(), candidates.end(),
              [&](const dvec3& a, const dvec3& b) { return glm::dot(a, r) > glm::dot(b, r); });
    for (const dvec3& other : candidates)
      if (glm::dot(candidates[0] - other, r) < 3e-4 && glm::length(candidates[0] - other) > 1e-4) certain = false;
    return candidates[0];
  }

  double lobe(dvec3 w) const {
    const dvec3 n(s.normal), h = w + dvec3(s.wo);
    const double alpha = static_cast<double>(s.roughness) * static_cast<double>(s.roughness), a2 = alpha * alpha;
    const double n_h = glm::dot(n, h), h2 = glm::dot(h, h);
    const double q = a2 * n_h * n_h + std::max(0.0, h2 - n_h * n_h), density = a2 * h2 * h2 / std::max(q * q, 1e-30);
    const double k = 0.5 * a2, shadowing = 1 / (std::max(glm::dot(n, w), 0.0) * (1 - k) + k);
    const double f0 = static_cast<double>(luminance(s.specular));
    const double fresnel = f0 + (1 - f0) * std::pow(1 - std::min(1.0, 0.5 * std::sqrt(h2)), 5);
    return std::max(density * shadowing * fresnel, 1e-6);
  }

  // Both children's weights. `certain` as in Value.
  std::array<double, 2> pair(const Value& a, const Value& b, bool& certain) const {
    const double floor2 = static_cast<double>(walk.floor2), inside2 = static_cast<double>(walk.inside2);
    const auto by_rule = [&](const Value& v) {
      switch (walk.weight) {
        case Weights::kDistanceBounded: return std::max(v.mean2, floor2);
        case Weights::kInBox: return v.near2 > 0 ? std::max(v.mean2, floor2) : inside2;
        default: break;
      }
      const bool wide = a.diagonal2 > a.near2 || b.diagonal2 > b.near2;
      return wide ? 1 : std::max(v.near2, floor2);
    };
    certain = a.certain && b.certain;
    for (const Value& v : {a, b})
      if (walk.weight == Weights::kYuksel && std::abs(v.diagonal2 - v.near2) < 1e-4 * v.diagonal2)
        certain = false;
    return {a.shine / by_rule(a), b.shine / by_rule(b)};
  }
};

TEST(SubstituteWalk, WeightsAreThoseOfEquationFive) {
  int compared = 0, uncertain = 0;
  for_every_walk(false, [&](const SubstituteWalk& walk, bool gloss) {
    for (Surface surface : walk_surfaces(18, 101)) {
      surface.roughness = std::max(surface.roughness, 0.3f);  // narrower lobes are good enough with fewer digits
      SubstituteWalkPoints points;
      set_point(points, 0, surface, vec3(0.5f));
      const Oracle oracle{walk, surface, gloss};
      for (std::uint32_t node = 0; node + 1 < walk.tree.count; node += 1 + node / 8) {
        const Oracle::Value a = oracle.child(walk.tree.nodes[node].child[0]);
        const Oracle::Value b = oracle.child(walk.tree.nodes[node].child[1]);
        bool certain = true;
        const std::array<double, 2> expected = oracle.pair(a, b, certain);
        if (!certain) {
          ++uncertain;
          continue;
        }
        const vec2 found = probabilities(walk, gloss, points, 0, node);
        const double total = expected[0] + expected[1];
        if (!(total > 0)) {
          ASSERT_EQ(found, vec2(0)) << "node " << node;
          continue;
        }
        // Roots have 14 bits; the lobe falls by a power of their errors.
        const double tolerance = std::max(gloss ? 3e-3 : 1e-3, a.slack + b.slack);
        for (int side = 0; side < 2; ++side) {
          const double p = expected[static_cast<std::size_t>(side)] / total;
          ASSERT_NEAR(found[side], p, p * tolerance) << "node " << node;
        }
        ++compared;
      }
    }
  });
  EXPECT_GT(compared, 10000);
  EXPECT_LT(uncertain, compared / 4);
}

// --- direction to a box ------------------------------------------------------------------------------------------

dvec3 found_direction(vec3 r, vec3 lo, vec3 hi) {
  constexpr int L = kWalkLanes;
  const LaneVec3<L> w = direction_in_box<L>(broadcast<L>(r), broadcast<L>(lo), broadcast<L>(hi));
  return dvec3(w.x[0], w.y[0], w.z[0]);
}

// Distance along a direction to the box grown by `margin`, negative if it misses.
bool meets_box(dvec3 direction, dvec3 lo, dvec3 hi, double margin) {
  double near = 0, far = 1e300;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = lo[axis] - margin, b = hi[axis] + margin;
    if (std::abs(direction[axis]) < 1e-12) {
      if (a > 0 || b < 0) return false;
      continue;
    }
    near = std::max(near, std::min(a / direction[axis], b / direction[axis]));
    far = std::min(far, std::max(a / direction[axis], b / direction[axis]));
  }
  return near <= far;
}

struct BoxCase {
  vec3 r, lo, hi;
};
std::vector<BoxCase> box_cases(int n) {
  std::vector<BoxCase> cases;
  Stream random(111);
  for (int i = 0; i < n; ++i) {
    const vec3 centre = random.in_box(vec3(-4), vec3(4));
    vec3 half = random.in_box(vec3(0.01f), vec3(2));
    if (i % 4 == 1) half[i / 4 % 3] = 0;  // flat
    if (i % 4 == 2) half *= 0.1f;
    const vec3 r = i % 3 == 0 ? glm::normalize(centre + half * random.direction()) : random.direction();
    cases.push_back({r, centre - half, centre + half});
  }
  return cases;
}

TEST(DirectionInBox, IsRWhereRMeetsTheBox) {
  int met = 0;
  for (const BoxCase& c : box_cases(4000)) {
    if (!meets_box(c.r, c.lo, c.hi, -1e-4) && !(glm::length(c.hi - c.lo) == 0)) continue;
    ++met;
    const dvec3 w = found_direction(c.r, c.lo, c.hi);
    // Cosines have 14 bits, so that another clamped point may win: 0.7 degrees.
    EXPECT_GT(glm::dot(glm::normalize(w), dvec3(c.r)), 1 - 7.5e-5);
    EXPECT_NEAR(glm::length(w), 1, 1e-4);
  }
  EXPECT_GT(met, 500);
}

TEST(DirectionInBox, IsRWithinTheBox) {
  Stream random(112);
  for (int i = 0; i < 500; ++i) {
    const vec3 lo = -random.in_box(vec3(0), vec3(3)), hi = random.in_box(vec3(0), vec3(3)), r = random.direction();
    EXPECT_EQ(found_direction(r, lo, hi), dvec3(r));
  }
  EXPECT_EQ(found_direction(vec3(0, 1, 0), vec3(0), vec3(0)), dvec3(0, 1, 0));  // a light at the very place
}

// A heuristic: within 4 degrees of the least angle where that is less than 90, and 0.3 on average. Further away the
// nearest point of the box stands in, which may be 60 degrees worse; lobes have nothing there.
TEST(DirectionInBox, PointsIntoTheBoxAndNearlyNearestToR) {
  constexpr double kDegrees = 180 / M_PI;
  double worst = 0, worst_behind = 0;
  RunningMean mean;
  Stream random(113);
  for (const BoxCase& c : box_cases(3000)) {
    const dvec3 lo(c.lo), hi(c.hi), w = found_direction(c.r, c.lo, c.hi);
    ASSERT_NEAR(glm::length(w), 1, 1e-4);
    ASSERT_TRUE(meets_box(w, lo, hi, 1e-5));
    double best = -1;
    for (int k = 0; k < 300; ++k) {  // corners, edges, faces, inside
      vec3 t(random.next());
      for (int axis = 0; axis < 3; ++axis) {
        const int code = k >> (2 * axis);
        if (k < 64 || (code & 2) != 0) t[axis] = static_cast<float>(code & 1);
      }
      best = std::max(best, glm::dot(glm::normalize(glm::mix(lo, hi, dvec3(t))), dvec3(c.r)));
    }
    const double angle = std::acos(std::min(1.0, glm::dot(glm::normalize(w), dvec3(c.r))));
    const double excess = std::max(0.0, angle - std::acos(std::min(1.0, best))) * kDegrees;
    (best > 0 ? worst : worst_behind) = std::max(best > 0 ? worst : worst_behind, excess);
    if (best > 0) mean.add(excess);
  }
  EXPECT_LT(worst, 4);
  EXPECT_LT(mean.mean(), 0.3);
  EXPECT_LT(worst_behind, 60);
}

// --- drawing from a substitute -----------------------------------------------------------------------------------

Distribution distribution(vec3 mean, const glm::mat3& root) {  // covariance root root^T
  Distribution d{};
  d.mean = mean;
  const glm::mat3 c = root * glm::transpose(root);
  const float terms[6] = {c[0][0], c[1][1], c[2][2], c[1][0], c[2][0], c[2][1]};
  std::copy(terms, terms + 6, d.covariance);
  return d;
}

std::vector<Distribution> distributions() {
  const vec3 mean(1, -2, 3);
  return {distribution(mean, glm::mat3(1)),
          distribution(mean, glm::mat3(vec3(0.5f, 0.2f, -0.1f), vec3(0, 1, 0.7f), vec3(0.3f, 0, 0.05f))),
          distribution(mean, glm::mat3(vec3(1, 1, 0), vec3(1, -1, 2), vec3(0))),       // flat
          distribution(mean, glm::mat3(vec3(0), vec3(0, 2, 0), vec3(0, 0, 1))),        // flat across x
          distribution(mean, glm::mat3(vec3(0.5f, 1, -2), vec3(0), vec3(0))),          // a line
          distribution(mean, glm::mat3(vec3(0, 0, 1), vec3(0), vec3(0))),              // along z
          distribution(mean, glm::mat3(0))};
}

TEST(SampleDistribution, HasTheMeanAndTheCovariance) {
  const Box3 box{vec3(-1e6f), vec3(1e6f)};
  constexpr int kDraws = 40000, kFrom[6] = {0, 1, 2, 0, 0, 1}, kTo[6] = {0, 1, 2, 1, 2, 2};
  int number = 0;
  for (const Distribution& d : distributions()) {
    Stream random(120 + static_cast<std::uint32_t>(number));
    RunningMean mean[3], moment[6];
    for (int i = 0; i < kDraws; ++i) {
      const dvec3 off = dvec3(sample_distribution(d, box, random.next())) - dvec3(d.mean);
      for (int axis = 0; axis < 3; ++axis) mean[axis].add(off[axis]);
      for (int k = 0; k < 6; ++k) moment[k].add(off[kFrom[k]] * off[kTo[k]]);
    }
    for (int axis = 0; axis < 3; ++axis) EXPECT_TRUE(mean_within(mean[axis], 0, 4, 1e-5)) << number << " " << axis;
    for (int k = 0; k < 6; ++k)
      EXPECT_TRUE(mean_within(moment[k], static_cast<double>(d.covariance[k]), 4, 2e-3)) << number << " term " << k;
    ++number;
  }
}

TEST(SampleDistribution, IsGaussianAlongEveryDirection) {
  const Box3 box{vec3(-1e6f), vec3(1e6f)};
  const Distribution d = distributions()[1];
  Stream random(130);
  for (const vec3 along : {vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1), vec3(0.6f, -0.64f, 0.48f)}) {
    constexpr int kCells = 40, kDraws = 40000;
    std::vector<double> observed(kCells, 0), expected(kCells, static_cast<double>(kDraws) / kCells);
    const double sigma = std::sqrt(static_cast<double>(d.variance_along(along)));
    for (int i = 0; i < kDraws; ++i) {
      const vec3 off = sample_distribution(d, box, random.next()) - d.mean;
      const double quantile = 0.5 * std::erfc(-static_cast<double>(glm::dot(off, along)) / sigma / std::sqrt(2.0));
      ++observed[static_cast<std::size_t>(std::clamp(static_cast<int>(quantile * kCells), 0, kCells - 1))];
    }
    EXPECT_GT(chi_square_p_value(observed, expected), 1e-4);
  }
}

TEST(SampleDistribution, NeverLeavesTheBox) {
  Stream random(131);
  for (const Distribution& d : distributions()) {
    const Box3 box{d.mean - vec3(0.5f, 0.1f, 0), d.mean + vec3(0.2f, 2, 0.3f)};
    for (int i = 0; i < 2000; ++i) {
      const vec4 u = i == 0 ? vec4(0) : i == 1 ? vec4(0x0.ffffffp0f) : random.next();
      const vec3 p = sample_distribution(d, box, u);
      ASSERT_TRUE(glm::all(glm::greaterThanEqual(p, box.lo)) && glm::all(glm::lessThanEqual(p, box.hi)));
    }
  }
}

// --- ends --------------------------------------------------------------------------------------------------------

TEST(SubstituteWalk, NoLightIsDeadAndOneLightIsCertain) {
  const VplTree none({}), one(cloud(1).vpls);
  Stream random(140);
  const std::vector<Surface> surfaces = walk_surfaces(9);
  const SubstituteWalkPoints points = points_of(surfaces, random);
  std::array<WalkResult, kSubstituteWalks> results;
  for (const bool gloss : {false, true}) {
    for (const bool substitutes : {false, true}) {
      walk_all(none.walk(Weights::kInBox, false, substitutes), gloss, points, 9, results.data());
      for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(results[i].end, WalkEnd::kDead);
      walk_all(one.walk(Weights::kInBox, false, substitutes), gloss, points, 9, results.data());
      for (std::size_t i = 0; i < 9; ++i) {
        EXPECT_EQ(results[i].end, WalkEnd::kLeaf);
        EXPECT_EQ(results[i].node, 0u);
        EXPECT_EQ(results[i].pdf, 1.0f);
        EXPECT_EQ(results[i].steps, 0);
      }
    }
  }
}

TEST(SubstituteWalk, SubstitutesHoldTheirLightsInTheirBox) {
  const VplTree tree(two_walls(400).vpls);
  const SubstituteWalk walk = tree.walk(Weights::kDistanceBounded, false, true);
  // First and last leaf below every inner node.
  const auto edge = [&](std::uint32_t node, int side) {
    for (;;) {
      const Child child = child_of(walk.tree, node, side);
      if (child.leaf) return child.number;
      node = child.number;
    }
  };
  Stream random(150);
  int seen = 0;
  for (int batch = 0; batch < 10; ++batch) {
    const std::vector<Surface> surfaces = walk_surfaces(kSubstituteWalks, 151 + static_cast<std::uint32_t>(batch));
    const SubstituteWalkPoints points = points_of(surfaces, random);
    std::array<WalkResult, kSubstituteWalks> results;
    walk_all(walk, false, points, kSubstituteWalks, results.data());
    for (const WalkResult& result : results) {
      if (result.end != WalkEnd::kSubstitute) continue;
      ++seen;
      for (std::uint32_t leaf = edge(result.node, 0); leaf <= edge(result.node, 1); ++leaf) {
        const vec3 p = walk.tree.leaf(leaf).position;
        EXPECT_TRUE(glm::all(glm::greaterThanEqual(p, result.box.lo)));
        EXPECT_TRUE(glm::all(glm::lessThanEqual(p, result.box.hi)));
      }
    }
  }
  EXPECT_GT(seen, 200);
}

}  // namespace
}  // namespace lumigrove
