// Method      Picks one emitter out of very many in a scene of instances: a walk down a perfect tree over the
//             instances, then one down the tree of the mesh that the instance shows, which all its instances share.
// Paper       D. Lin, C. Yuksel, "Real-Time Stochastic Lightcuts", Proc. ACM CGIT 3(1) (I3D 2020): 3.1, two-level
//             trees; mapping of the point into the mesh's space as in the authors' code.
// Symbols     top level -> LightTreeView of the sampler -> over instances that shine, point and spot lights
//             bottom level -> MeshTreesView::trees -> by mesh, in its own space; intensities are shares of the mesh's
//             L, t -> TreeInstance -> linear part and origin of the instance's map y = L y' + t, m
//             s -> scale of an instance that keeps shapes; its intensity is s^2 times the mesh's
// Equations   x' = L^-1 (x - t), n' = L^T n / |L^T n| -> to_mesh_space; as n (y - x) = (L^T n) (y' - x'), the horizon
//             stays where it is under every invertible L, and so does the side that a triangle shines on, mirrored
//             or not
//             p(emitter) = p(instance) p(triangle | instance) -> pdf_mesh_trees
// Departures  Distances in the bottom level are the mesh's own. If L keeps shapes all weights are as in world space;
//             under non-uniform scale and shear distances bend, and shares of flux are those of the unstretched mesh:
//             every probability stays positive and exact, but samples are chosen less well. The instance's own share
//             is right to the root mean square of its area scales.
//             x' is lowered under its tangent plane by what rounding can make of the mesh in the world. Instances
//             whose map has no (or hardly an) inverse are walked from far away, which is by intensity alone. Cones of
//             a mesh are widened for instances up to some hundred times its size away from the origin; beyond, they
//             are not used.
//             A mesh of one triangle needs no second walk. Triangles of no area in their mesh do not shine.
// Estimator   unbiased: every emitter that can contribute at x has positive probability, and the probability
//             returned is exactly the product of the steps taken.
// In -> Out   points and normals in the world and walks down the top level -> emitters and probabilities. Walks may
//             also start inside the tree of one instance's mesh, and then know nothing of the others.
// Oracle      tests/two_level_tree_test.cpp: sum and chi-square of pdf_mesh_trees, mean against the exhaustive sum
//             with turned, scaled, mirrored, stretched, sheared and flattened instances. tests/lightcuts_test.cpp for
//             walks from inside a mesh.
#pragma once

#include "base/rng.h"
#include "lights/emitter.h"
#include "methods/light_tree/light_tree_kernel.h"
#include "trace/ray.h"

namespace lumigrove {

// A leaf of the top level: an instance and the tree of its mesh, or one point or spot light.
struct alignas(64) TreeInstance {
  mat3 to_mesh = mat3(0);         // L^-1; 0 where there is none
  mat3 normal_to_mesh = mat3(0);  // L^T times a positive number; 0 likewise
  vec3 origin = vec3(0);          // t
  float slack = 0;  // how far x' is lowered, m of the mesh's space; without L^-1 how far away it is put
  float slack_per_length = 0;  // and for each metre of x'
  std::uint32_t first = 0;     // its first emitter
  std::uint32_t tree = kNone;  // kNone: a point or spot light, or an instance of a single triangle
  bool cones = false;

  static constexpr std::uint32_t kNone = 0xffffffffu;
};

// Where an instance shows its mesh: y = to_world y' + origin. What cuts need beside TreeInstance.
struct MeshPlacement {
  mat3 to_world = mat3(1);  // L
  vec3 origin = vec3(0);    // t
  float intensity = 1;      // share of all local flux that is 1 in the mesh's tree
  float to_normal = 0;      // 1/s if L keeps shapes: normals then are L n' / s; elsewhere 0
};

// The bottom level. Not present: leaves of the tree are emitters themselves.
struct MeshTreesView {
  const TreeInstance* instances = nullptr;          // by leaf number of the top level
  const MeshPlacement* placements = nullptr;        // likewise
  const LightTreeView* trees = nullptr;             // by mesh
  const std::uint32_t* instance_numbers = nullptr;  // instance of the scene -> its number in `instances`
  std::uint32_t punctual_first = 0;                 // number of the first point or spot light
  int width = 0;
  Weights weights = Weights::kMinMax;

  LUMI_HD bool present() const { return instances != nullptr; }
};

// Where a walk starts: in the tree over all lights, which may be the top level, or in the tree of an instance's mesh.
// Light BVHs: children of a node likewise, always one.
struct TreeStart {
  Subtree subtree;
  std::uint32_t instance = kNoId;  // number in MeshTreesView::instances

  LUMI_HD bool operator==(const TreeStart& o) const { return subtree == o.subtree && instance == o.instance; }
};

struct MeshSpacePoint {
  vec3 position, normal;
};

LUMI_HD inline MeshSpacePoint to_mesh_space(const TreeInstance& instance, vec3 x, vec3 n) {
  const vec3 normal = instance.normal_to_mesh * n;
  const float squared = length_squared(normal);
  if (!(squared > 0)) return {vec3(instance.slack), vec3(0)};  // no inverse
  const vec3 position = instance.to_mesh * (x - instance.origin);
  const vec3 unit = normal * (1 / glm::sqrt(squared));
  const vec3 apart = glm::abs(position);
  return {position - unit * (instance.slack + instance.slack_per_length * (apart.x + apart.y + apart.z)),
          unit};
}

// Two uniform numbers that the walk to the instance did not use up, made from those that it used.
LUMI_HD inline vec2 numbers_below(float u0, float u1) {
  const uvec4 h = pcg4d(uvec4(glm::floatBitsToUint(u0), glm::floatBitsToUint(u1), 0x2f6e2b1u, 0x9e3779b9u));
  return {to_unit_float(h.x), to_unit_float(h.y)};
}

// Walks of a batch in the bottom level, each in a tree of its own.
struct MeshWalks {
  WalkPoints points;  // in the space of each walk's mesh
  WalkState state;
  const LightTreeView* trees[kWalkBatch];
  bool cones[kWalkBatch];
};

LUMI_HD inline void start_mesh_walks(const MeshTreesView& below, const WalkPoints& points, int count,
                                     TreeSample* samples, MeshWalks& walks) {
  walks.state.living = 0;
  for (int i = 0; i < count; ++i) {
    if (!(samples[i].pdf > 0)) continue;
    const char* instance = reinterpret_cast<const char*>(below.instances + samples[i].emitter);
    for (std::size_t line = 0; line < sizeof(TreeInstance); line += 64) prefetch(instance + line);
  }
  for (int i = 0; i < count; ++i) {
    if (!(samples[i].pdf > 0)) continue;
    const TreeInstance& instance = below.instances[samples[i].emitter];
    samples[i].emitter = instance.first;
    if (instance.tree == TreeInstance::kNone) continue;
    const MeshSpacePoint local = to_mesh_space(instance, points.position(i), points.normal(i));
    const vec2 u = numbers_below(points.u0[i], points.u1[i]);
    walks.points.set(i, local.position, local.normal, u);
    walks.trees[i] = below.trees + instance.tree;
    walks.cones[i] = instance.cones;
    walks.state.node[i] = 0;
    walks.state.pdf[i] = 1;
    walks.state.r[i] = u.x;
    walks.state.alive[walks.state.living++] = i;
  }
}

// One step of every walk; those that reach a leaf end.
template <int W, Weights kWeights>
LUMI_HD LUMI_ALWAYS_INLINE void step_mesh_walks(MeshWalks& walks, int level, TreeSample* samples) {
  WalkState& state = walks.state;
  int kept = 0;
  for (int k = 0; k < state.living; ++k) {
    const int i = state.alive[k];
    const LightTreeView& tree = *walks.trees[i];
    Weighing weighing = weighing_of_level(tree, level, kWeights);
    weighing.cones = weighing.cones && walks.cones[i];
    const ChildWeights<W> children = weigh_children<W>(tree.level<W>(level)[state.node[i]], weighing,
                                                       walks.points.position(i), walks.points.normal(i));
    if (!(children.total > 0)) {
      samples[i] = {};
      continue;
    }
    const bool second_number = level == (tree.levels + 1) / 2;
    const ChosenChild chosen = choose_child<W>(children, second_number ? walks.points.u1[i] : state.r[i]);
    state.node[i] = state.node[i] * W + static_cast<std::uint32_t>(chosen.lane);
    state.pdf[i] *= chosen.probability;
    state.r[i] = chosen.r;
    prefetch_step<W>(tree, level + 1, state.node[i]);
    if (level + 1 < tree.levels) {
      state.alive[kept++] = i;
      continue;
    }
    samples[i].emitter += tree.leaf_emitters[state.node[i]];
    samples[i].pdf *= state.pdf[i];
  }
  state.living = kept;
}

template <int W, Weights kWeights>
LUMI_HD inline void walk_mesh_trees(MeshWalks& walks, TreeSample* samples) {
  for (int level = 0; walks.state.living > 0; ++level) step_mesh_walks<W, kWeights>(walks, level, samples);
}

// samples[i] says which leaf of the top level was chosen for points i, and becomes an emitter.
LUMI_HD inline void sample_mesh_trees(const MeshTreesView& below, const WalkPoints& points, int count,
                                      TreeSample* samples) {
  MeshWalks walks;
  start_mesh_walks(below, points, count, samples, walks);
  with_width(below.width, [&](auto w) {
    with_weights(below.weights, [&](auto weights) { walk_mesh_trees<w, weights>(walks, samples); });
  });
}

// The tree of an instance's mesh, with cones where the instance may use them.
LUMI_HD inline LightTreeView tree_of_instance(const MeshTreesView& below, const TreeInstance& instance) {
  LightTreeView tree = below.trees[instance.tree];
  if (!instance.cones) tree.first_cones = tree.levels;
  return tree;
}

// Emitters below a start in the mesh of one instance: all walks are in one tree.
LUMI_HD inline void sample_one_mesh(const MeshTreesView& below, const TreeStart& start, const WalkPoints& points,
                                    int count, TreeSample* samples) {
  const TreeInstance& instance = below.instances[start.instance];
  const LightTreeView tree = tree_of_instance(below, instance);
  WalkPoints local;
  for (int i = 0; i < count; ++i) {
    const MeshSpacePoint point = to_mesh_space(instance, points.position(i), points.normal(i));
    local.set(i, point.position, point.normal, vec2(points.u0[i], points.u1[i]));
  }
  with_width(below.width, [&](auto w) { sample_light_tree<w>(tree, start.subtree, local, count, samples); });
  for (int i = 0; i < count; ++i)
    if (samples[i].pdf > 0) samples[i].emitter += instance.first;
}

// Number in MeshTreesView::instances of the leaf that holds an emitter.
LUMI_HD inline std::uint32_t instance_of_emitter(const MeshTreesView& below, const Emitter& emitter) {
  return emitter.punctual() ? below.punctual_first + emitter.index()
                            : below.instance_numbers[emitter.source];
}

// Probability of `emitter` below `start`, in the tree of its instance's mesh.
template <int W>
LUMI_HD inline float pdf_in_tree(const LightTreeView& tree, Subtree start, const TreeInstance& instance, vec3 x, vec3 n,
                                 std::uint32_t emitter) {
  const MeshSpacePoint local = to_mesh_space(instance, x, n);
  return pdf_light_tree<W>(tree, start, local.position, local.normal, emitter - instance.first);
}

// Probability of `emitter`, given its instance: the product of sample_mesh_trees' steps.
template <int W>
LUMI_HD inline float pdf_in_mesh(const MeshTreesView& below, const TreeInstance& instance, vec3 x, vec3 n,
                                 std::uint32_t emitter) {
  if (instance.tree == TreeInstance::kNone) return instance.first == emitter ? 1.0f : 0.0f;
  const LightTreeView tree = tree_of_instance(below, instance);
  return pdf_in_tree<W>(tree, whole_tree(tree), instance, x, n, emitter);
}

// Probability with which walks from `start` return `emitter`.
template <int W>
LUMI_HD inline float pdf_mesh_trees(const LightTreeView& top, const MeshTreesView& below, const LightView& lights,
                                    const TreeStart& start, vec3 x, vec3 n, std::uint32_t emitter) {
  const std::uint32_t number = instance_of_emitter(below, lights.emitters[emitter]);
  if (number == kNoEmitter) return 0;
  const TreeInstance& instance = below.instances[number];
  if (start.instance != kNoId) {
    if (start.instance != number) return 0;
    return pdf_in_tree<W>(tree_of_instance(below, instance), start.subtree, instance, x, n, emitter);
  }
  const float of_instance = pdf_light_tree<W>(top, start.subtree, x, n, number);
  return of_instance > 0 ? of_instance * pdf_in_mesh<W>(below, instance, x, n, emitter) : 0.0f;
}

}  // namespace lumigrove
