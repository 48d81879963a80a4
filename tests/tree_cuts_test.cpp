// Cuts of two-level trees and of light BVHs, and walks from their nodes. Cuts of the perfect tree, and whole frames:
// lightcuts_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "instance_fixtures.h"
#include "methods/lightcuts/cut_kernel.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

// Samplers whose trees can be cut, and what they are made from.
class CutWorld {
 public:
  CutWorld(const Scene& scene, const LightTree::Options& tree)
      : two_level_(scene, tree), sampler_(two_level_.sampler()) {}
  CutWorld(const Scene& scene, const LightBvh::Options& bvh) : two_level_(scene), sampler_(two_level_.sampler()) {
    bvh_.build(sampler_.lights, bvh);
    sampler_.bvh = bvh_.view();
    sampler_.choice = LightChoice::kBvh;
  }
  const LightSampler& sampler() const { return sampler_; }

 private:
  TwoLevelWorld two_level_;
  LightBvh bvh_;
  LightSampler sampler_;
};

struct NamedCutWorld {
  std::string name;
  CutWorld world;
};

// Every scene under every tree.
std::vector<NamedCutWorld> cut_worlds() {
  std::vector<NamedScene> scenes = instance_scenes();
  Scene single;
  add_shared_meshes(single);
  add_node(single, {2});
  scenes.push_back({"one triangle", single});
  std::vector<NamedCutWorld> worlds;
  for (const NamedScene& named : scenes) {
    const std::string name = named.name;
    for (const int width : {2, 16})
      worlds.push_back({name + ", two-level " + std::to_string(width),
                        CutWorld(named.scene, LightTree::Options{width, width == 16, true})});
    worlds.push_back(
        {name + ", SAOH", CutWorld(named.scene, LightBvh::Options{Hierarchy::kSaoh, Weights::kSaoh, true})});
    worlds.push_back({name + ", agglomerative",
                      CutWorld(named.scene, LightBvh::Options{Hierarchy::kAgglomerative, Weights::kMinMax, false})});
  }
  return worlds;
}

LightCut cut_at(const LightSampler& sampler, const Surface& s, const CutOptions& options) {
  LightCut cut;
  select_cut(sampler, s.position, s.normal, options, cut);
  return cut;
}

// --- what lies below a node --------------------------------------------------------------------------------

// Leaves below a range of children, as the tree numbers what it is over.
std::vector<std::uint32_t> leaves_below(const LightTreeView& tree, Subtree s) {
  const auto width = static_cast<std::uint64_t>(tree.width);
  std::uint64_t span = 1;
  for (int level = s.level + 1; level < tree.levels; ++level) span *= width;
  const std::uint64_t first = (s.node * width + s.first) * span;
  std::vector<std::uint32_t> found;
  for (std::uint64_t leaf = first; leaf < std::min<std::uint64_t>(first + s.children * span, tree.count); ++leaf)
    found.push_back(tree.leaf_emitters[leaf]);
  return found;
}

void add_mesh_leaves(const MeshTreesView& below, std::uint32_t instance, Subtree s,
                     std::vector<std::uint32_t>& emitters) {
  const TreeInstance& shown = below.instances[instance];
  for (const std::uint32_t leaf : leaves_below(below.trees[shown.tree], s)) emitters.push_back(shown.first + leaf);
}

std::vector<std::uint32_t> emitters_below(const LightSampler& sampler, const TreeStart& start) {
  std::vector<std::uint32_t> emitters;
  if (sampler.choice == LightChoice::kBvh) {
    const std::uint32_t link = sampler.bvh.link(entry_of_subtree(start.subtree));
    if ((link & kBvhLeaf) != 0) return {link & ~kBvhLeaf};
    const LightBvhNode& node = sampler.bvh.nodes[link];
    for (std::uint32_t e = 0; e < sampler.lights.emitters.size(); ++e) {
      const std::uint32_t leaf = sampler.bvh.emitter_leaves[e];
      if (leaf >= node.first && leaf < node.first + node.count[0] + node.count[1]) emitters.push_back(e);
    }
    return emitters;
  }
  const MeshTreesView& below = sampler.mesh_trees;
  if (start.instance != kNoId) {
    add_mesh_leaves(below, start.instance, start.subtree, emitters);
    return emitters;
  }
  for (const std::uint32_t instance : leaves_below(sampler.tree, start.subtree)) {
    const std::uint32_t tree = below.instances[instance].tree;
    if (tree == TreeInstance::kNone)
      emitters.push_back(below.instances[instance].first);
    else
      add_mesh_leaves(below, instance, whole_tree(below.trees[tree]), emitters);
  }
  return emitters;
}

std::vector<std::uint32_t> all_emitters(const LightSampler& sampler) {
  const TreeStart root = sampler.choice == LightChoice::kBvh ? TreeStart{subtree_of_entry(kBvhRoot)}
                                                             : TreeStart{whole_tree(sampler.tree)};
  std::vector<std::uint32_t> emitters = emitters_below(sampler, root);
  std::sort(emitters.begin(), emitters.end());
  return emitters;
}

TEST(TreeCuts, ArePartitionsOfAllLights) {
  for (const auto& [name, world] : cut_worlds()) {
    const LightSampler& sampler = world.sampler();
    const std::vector<std::uint32_t> all = all_emitters(sampler);
    for (std::uint32_t e = 0; e < sampler.lights.emitters.size(); ++e) {
      if (emitter_flux(sampler.lights, e) > 1e-3f * sampler.lights.local_flux) {
        ASSERT_TRUE(std::binary_search(all.begin(), all.end(), e)) << name;
      }
    }
    int longest = 0;
    for (const Surface& s : shading_points(12))
      for (const int size : {1, 2, 7, 32})
        for (const CutBound bound : {CutBound::kNearest, CutBound::kExact, CutBound::kChildren}) {
          const LightCut cut = cut_at(sampler, s, {size, 1e-4f, bound});
          ASSERT_LE(cut.count, size);
          longest = std::max(longest, cut.count);
          std::vector<std::uint32_t> found;
          for (int i = 0; i < cut.count; ++i) {
            const std::vector<std::uint32_t> part = emitters_below(sampler, cut.nodes[i]);
            ASSERT_FALSE(part.empty()) << name;
            found.insert(found.end(), part.begin(), part.end());
          }
          std::sort(found.begin(), found.end());
          ASSERT_EQ(found, all) << name << ", " << size << " nodes";
        }
    EXPECT_EQ(longest, std::min<std::size_t>(32, all.size())) << name;
  }
}

TEST(TreeCuts, OfNoLightsAreEmpty) {
  const Surface s = shading_points(1)[0];
  EXPECT_EQ(cut_at(CutWorld(Scene{}, LightTree::Options{}).sampler(), s, {8, 1e-4f}).count, 0);
  EXPECT_EQ(cut_at(CutWorld(Scene{}, LightBvh::Options{}).sampler(), s, {8, 1e-4f}).count, 0);
}

TEST(TreeCuts, ReachIntoMeshes) {
  const CutWorld world(instances_of(8, turn), kTree);
  int inside = 0;
  for (const Surface& s : shading_points(20)) {
    const LightCut cut = cut_at(world.sampler(), s, {32, 1e-4f});
    for (int i = 0; i < cut.count; ++i) inside += cut.nodes[i].instance != kNoId ? 1 : 0;
  }
  EXPECT_GT(inside, 20 * 8);
}

// --- choice ------------------------------------------------------------------------------------------------

// The same cut, with every error computed anew at every step.
template <class Tree>
std::vector<TreeStart> plain_cut(const Tree& tree, int size) {
  TreeStart root;
  if (!tree.root(root)) return {};
  std::vector<TreeStart> cut{root};
  while (static_cast<int>(cut.size()) < size) {
    std::vector<float> errors;
    for (const TreeStart& node : cut) errors.push_back(tree.error(node));
    const auto worst = std::max_element(errors.begin(), errors.end());
    if (!(*worst > 0)) break;
    const auto at = cut.begin() + (worst - errors.begin());
    TreeStart parts[2];
    const int count = tree.split(*at, parts);
    *at = parts[0];
    if (count > 1) cut.push_back(parts[1]);
  }
  return cut;
}

TEST(TreeCuts, SplitTheLargestError) {
  for (const auto& [name, world] : cut_worlds()) {
    const LightSampler& sampler = world.sampler();
    for (const Surface& s : shading_points(6, 3)) {
      const CutOptions options{12, 1e-3f};
      std::vector<TreeStart> plain;
      if (sampler.choice == LightChoice::kBvh)
        plain = plain_cut(CutOfBvh{sampler.bvh, options, s.position, s.normal}, options.size);
      else
        with_width(sampler.tree.width, [&](auto w) {
          plain = plain_cut(CutOfTrees<w>{sampler.tree, sampler.mesh_trees, options, s.position, s.normal},
                            options.size);
        });
      const LightCut cut = cut_at(sampler, s, options);
      EXPECT_EQ(std::vector<TreeStart>(cut.nodes, cut.nodes + cut.count), plain) << name;
    }
  }
}

// Share of all flux of an emitter, as the leaf of its mesh's tree and the instance have it.
float leaf_intensity(const LightSampler& sampler, std::uint32_t instance, std::uint32_t emitter) {
  const MeshTreesView& below = sampler.mesh_trees;
  const LightTreeView& tree = below.trees[below.instances[instance].tree];
  const std::uint32_t leaf = tree.emitter_leaves[emitter - below.instances[instance].first];
  const std::uint32_t w = static_cast<std::uint32_t>(tree.width);
  return below.placements[instance].intensity * with_width(tree.width, [&](auto width) {
    return tree.level<width>(tree.levels - 1)[leaf / w].intensity[leaf % w];
  });
}

// What the lights below a node in a mesh can send to a surface never exceeds the node's error, in the world's units and
// whatever the instance's map does.
TEST(TreeCuts, ErrorsInsideMeshesAreBoundsInTheWorld) {
  Stream random(15);
  int compared = 0;
  for (const NamedScene& named : instance_scenes()) {
    const CutWorld world(named.scene, kTree);
    const LightSampler& sampler = world.sampler();
    for (const Surface& s : shading_points(30, 16)) {
      const bool children = random.next().x < 0.5f;
      const CutOptions options{24, 0.01f, children ? CutBound::kChildren : CutBound::kExact};
      const LightCut cut = cut_at(sampler, s, options);
      for (int i = 0; i < cut.count; ++i) {
        if (cut.nodes[i].instance == kNoId || !(cut.error[i] > 0)) continue;
        double sum = 0;
        for (const std::uint32_t e : emitters_below(sampler, cut.nodes[i])) {
          const vec4 u = random.next();
          const Emitter& light = sampler.lights.emitters[e];
          const vec3 y = light.p0 + light.e1 * (u.x * 0.5f) + light.e2 * (u.y * 0.5f) - s.position;
          const float d2 = length_squared(y), d = glm::sqrt(d2);
          double cosines = static_cast<double>(std::max(0.0f, glm::dot(y, s.normal)) / d);
          const vec3 normal = glm::normalize(glm::cross(light.e1, light.e2));
          if (children && !sampler.lights.instances[light.source].double_sided)
            cosines *= static_cast<double>(std::max(0.0f, -glm::dot(y, normal)) / d);
          sum += static_cast<double>(leaf_intensity(sampler, cut.nodes[i].instance, e)) * cosines /
                 static_cast<double>(std::max(d2, options.floor2));
        }
        EXPECT_LE(sum, static_cast<double>(cut.error[i]) * 1.001) << named.name;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 500);
}

// A mesh that is moved, and grown, has the errors that its triangles have in one tree over the world.
TEST(TreeCuts, ErrorsInsideMeshesAreThoseOfOneTreeOverTheWorld) {
  constexpr LightTree::Options kNoCones{2, false, true};
  for (const float scale : {0.25f, 1.0f, 4.0f}) {
    Scene scene;
    add_shared_meshes(scene);
    Node& node = add_node(scene, {1});
    node.translation = vec3(2, -1, 3);
    node.scale = vec3(scale);
    const LightWorld one(scene, kNoCones);
    const CutWorld two(scene, kNoCones);
    for (const Surface& s : shading_points(20, 21)) {
      const CutOptions options{10, 0.01f};
      LightCut a = cut_at(one.sampler(LightChoice::kTree), s, options), b = cut_at(two.sampler(), s, options);
      ASSERT_EQ(a.count, b.count);
      std::sort(a.error, a.error + a.count);
      std::sort(b.error, b.error + b.count);
      for (int i = 0; i < a.count; ++i) EXPECT_NEAR(b.error[i], a.error[i], 2e-3f * a.error[i] + 1e-9f);
    }
  }
}

// --- walks -------------------------------------------------------------------------------------------------

TreeSample draw_below(const LightSampler& sampler, const TreeStart& start, const Surface& s, vec4 u) {
  if (sampler.choice == LightChoice::kBvh)
    return sample_light_bvh(sampler.bvh, entry_of_subtree(start.subtree), s.position, s.normal, vec2(u.x, u.y));
  WalkPoints points;
  points.set(0, s.position, s.normal, vec2(u.x, u.y));
  TreeSample sample;
  sample_emitters(sampler, start, points, 1, &sample);
  return sample;
}

TEST(TreeCuts, WalksStayBelowTheirNodeAndReportThePdfBitForBit) {
  for (const auto& [name, world] : cut_worlds()) {
    const LightSampler& sampler = world.sampler();
    Stream random(7);
    int compared = 0;
    for (const Surface& s : shading_points(20)) {
      const LightCut cut = cut_at(sampler, s, {8, 1e-4f});
      for (int i = 0; i < cut.count; ++i) {
        const std::vector<std::uint32_t> below = emitters_below(sampler, cut.nodes[i]);
        for (int k = 0; k < 4; ++k) {
          const TreeSample sample = draw_below(sampler, cut.nodes[i], s, random.next());
          if (!(sample.pdf > 0)) continue;
          EXPECT_NE(std::find(below.begin(), below.end(), sample.emitter), below.end()) << name;
          EXPECT_EQ(sample.pdf, pdf_emitter_below(sampler, cut.nodes[i], s.position, s.normal, sample.emitter)) << name;
          ++compared;
        }
      }
    }
    EXPECT_GT(compared, 20) << name;
  }
}

// Property: of the nodes of a cut, exactly one finds a light, and every light that can arrive is found. The cut is that
// of another surface.
TEST(TreeCuts, ContributionImpliesProbability) {
  for (const auto& [name, world] : cut_worlds()) {
    const LightSampler& sampler = world.sampler();
    Stream random(8);
    const std::vector<Surface> surfaces = shading_points(30, 12);
    for (std::size_t k = 0; k < surfaces.size(); ++k) {
      const LightCut cut = cut_at(sampler, surfaces[(k + 1) % surfaces.size()], {8, 1e-4f});
      const Surface& s = surfaces[k];
      for (std::uint32_t e = 0; e < sampler.lights.emitters.size(); ++e) {
        int found = 0;
        for (int i = 0; i < cut.count; ++i)
          found += pdf_emitter_below(sampler, cut.nodes[i], s.position, s.normal, e) > 0 ? 1 : 0;
        ASSERT_LE(found, 1) << name << ", emitter " << e;
        const vec4 u = random.next();
        const EmitterPoint point = sample_emitter_point(sampler.scene, sampler.lights, e, s.position, vec2(u.x, u.y));
        if (!(max_component(point.incident) > 0) || !(glm::dot(point.wi, s.normal) > 1e-5f)) continue;
        ASSERT_EQ(found, 1) << name << ", emitter " << e;
      }
    }
  }
}

TEST(TreeCuts, TheSumOverTheNodesHasTheExhaustiveSumAsMean) {
  constexpr int kDraws = 1500, kRounds = 60;
  for (const auto& [name, world] : cut_worlds()) {
    const LightSampler& sampler = world.sampler();
    Stream random(21);
    const std::vector<Surface> surfaces = shading_points(4, 43);
    for (std::size_t k = 0; k < 2; ++k) {
      const Surface& s = surfaces[k];
      LightSampler every = sampler;
      every.choice = LightChoice::kOne;
      RunningMean truth, mean;
      for (int i = 0; i < kRounds; ++i) {
        double sum = 0;
        for (every.one = 0; every.one < light_count(every.lights); ++every.one)
          sum += sample_value(sample_light(every, s, random.next()), s);
        truth.add(sum);
      }
      const LightCut cut = cut_at(sampler, surfaces[k + 2], {8, 1e-4f});
      for (int i = 0; i < kDraws; ++i) {
        double sum = 0;
        for (int node = 0; node < cut.count; ++node) {
          const TreeSample chosen = draw_below(sampler, cut.nodes[node], s, random.next());
          const vec4 u = random.next();
          sum += sample_value(local_sample(sampler, s, chosen, vec2(u.x, u.y)), s);
        }
        mean.add(sum);
      }
      const double error = std::hypot(mean.standard_error(), truth.standard_error());
      // 72 comparisons: 4.5 standard errors keep false alarms below one in a thousand.
      EXPECT_NEAR(mean.mean(), truth.mean(), 4.5 * error + 1e-6 * truth.mean()) << name;
    }
  }
}

}  // namespace
}  // namespace lumigrove
