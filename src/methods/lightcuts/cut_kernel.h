// Method      Cuts the tree of lights at a few nodes, so that each is sampled once: lights are spread over the samples
//             instead of being left to chance. A cut found at one pixel serves its neighbours.
// Paper       D. Lin, C. Yuksel, "Real-Time Stochastic Lightcuts", Proc. ACM CGIT 3(1) (I3D 2020): 3.3 selection of cuts,
//             3.4 sharing and interleaving; B. Walter et al., "Lightcuts", SIGGRAPH 2005, for the bound; authors' code.
// Symbols     I_j -> SubtreeBounds::intensity -> as the nodes hold it, share of all local flux
//             F_j -> cosine_bound -> bound of the cosine at the receiver over the node's box, no material
//             E_j = I_j F_j / max(d_min^2, floor) -> box_error; leaves have none, since they are sampled exactly
//             n -> CutOptions::size -> nodes of a cut
//             k, m -> CutLookup::share, interleave -> pixels of a block's edge that share a cut, or its samples
//             R_L -> diagonal of the lights' bounds; the floor is (0.001 R_L)^2
// Equations   (3) p = (f + m (y mod m) + (x mod m)) mod m^2; nodes floor(p n / m^2) to floor((p + 1) n / m^2) - 1
//             -> entries_of_pixel
// Departures  The tree's nodes have W children; the binary nodes that the paper cuts at are halves, quarters, ... of
//             these, put together when needed. Cuts shorter than n happen only where there are too few lights.
//             By default a node's error is the sum of the bounds of the children of the wide node that it belongs to, with
//             their own boxes and cones (CutBound::kChildren): tighter than the bound over one box around all of them,
//             which is largest wherever that box holds the point. The others are the paper's and the code's.
//             In the two-level tree a leaf of the top level is the tree of its mesh. Errors there are of boxes around
//             the mesh's boxes in the world, as shares of all local flux, so that those of both levels compare under
//             any map from the mesh to the world; cones count where the map keeps shapes.
//             Light BVHs are cut by the same errors, whatever their walks' weights are.
//             Pixels without a surface pass the choice of the representative on to the next one.
// Estimator   unbiased: a cut is a partition of all lights, whatever pixel it was chosen for, and one light is sampled
//             below each node. Interleaved, unbiased as the mean over m^2 frames.
// In -> Out   surfaces of a tile -> a LightCut for every block of k x k pixels
// Oracle      tests/lightcuts_test.cpp, tests/tree_cuts_test.cpp: partition of the lights, greedy choice against a plain
//             one, exhaustive sum.
#pragma once

#include "lumigrove/settings.h"
#include "methods/light_sampling/light_sampler_kernel.h"
#include "scene/camera_kernel.h"
#include "scene/surface.h"
#include "trace/ray.h"

namespace lumigrove {

inline constexpr int kMaxCut = 32;

struct CutOptions {
  int size = 8;              // n
  float floor2 = 0;          // m^2
  CutBound bound = CutBound::kChildren;
};

// Partition of the lights: each node holds those that a walk from it can reach.
struct LightCut {
  TreeStart nodes[kMaxCut];
  float error[kMaxCut];
  int count = 0;
};

// --- errors ------------------------------------------------------------------------------------------------

struct SubtreeBounds {
  Box3 box;
  float intensity = 0;
};

template <int W>
LUMI_HD inline SubtreeBounds bounds_of(const LightNode<W>& node, int first, int children) {
  SubtreeBounds bounds;
  for (int c = first; c < first + children; ++c) {
    if (!(node.intensity[c] > 0)) continue;
    const vec3 centre(node.centre_x[c], node.centre_y[c], node.centre_z[c]);
    const vec3 half(node.half_x[c], node.half_y[c], node.half_z[c]);
    bounds.box = unite(bounds.box, Box3{centre - half, centre + half});
    bounds.intensity += node.intensity[c];
  }
  return bounds;
}

// The world's box of what an instance shows, and its share of all local flux.
LUMI_HD inline SubtreeBounds place(const SubtreeBounds& bounds, const MeshPlacement& placement) {
  const mat3& m = placement.to_world;
  const vec3 middle = m * bounds.box.centre() + placement.origin;
  const vec3 reach = mat3(glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2])) * (0.5f * bounds.box.extent());
  return {{middle - reach, middle + reach}, bounds.intensity * placement.intensity};
}

// The same for the children of a node.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<W> multiply(const mat3& m, const LaneVec3<W>& v) {
  const auto row = [&](int r) {
    return dot<W>({broadcast<W>(m[0][r]), broadcast<W>(m[1][r]), broadcast<W>(m[2][r])}, v);
  };
  return {row(0), row(1), row(2)};
}

template <int W>
LUMI_HD inline BoxLanes<W> place(const BoxLanes<W>& boxes, const MeshPlacement& placement) {
  const mat3& m = placement.to_world;
  const LaneVec3<W> centre = multiply<W>(m, boxes.centre);
  return {{centre.x + placement.origin.x, centre.y + placement.origin.y, centre.z + placement.origin.z},
          multiply<W>(mat3(glm::abs(m[0]), glm::abs(m[1]), glm::abs(m[2])), boxes.half),
          boxes.intensity * placement.intensity};
}

template <int W>
LUMI_HD inline ConeLanes<W> place(const ConeLanes<W>& cones, const MeshPlacement& placement) {
  return {multiply<W>(placement.to_world * placement.to_normal, cones.axis), cones.radius};
}

// Height of the box's highest corner over its distance: of the point nearest to x, as the authors' code has it (never 0
// where the box reaches above the horizon, but no bound), or of the nearest to the normal's axis, a bound.
LUMI_HD inline float cosine_bound(Box3 box, vec3 x, vec3 n, bool exact) {
  const vec3 lo = box.lo - x, hi = box.hi - x;
  const vec3 top(n.x > 0 ? hi.x : lo.x, n.y > 0 ? hi.y : lo.y, n.z > 0 ? hi.z : lo.z);
  const float height = glm::dot(top, n);
  if (!(height > 0)) return 0;
  float aside2;
  if (exact) {
    const Frame frame = make_frame(n);
    const vec3 centre = 0.5f * (lo + hi), half = 0.5f * (hi - lo);
    const auto nearest = [&](vec3 axis) {
      return glm::max(0.0f, glm::abs(glm::dot(axis, centre)) - glm::dot(glm::abs(axis), half));
    };
    const float a = nearest(frame.x), b = nearest(frame.y);
    aside2 = a * a + b * b;
  } else {
    const vec3 nearest = glm::clamp(vec3(0), lo, hi);
    const vec3 tangent = nearest - n * glm::dot(n, nearest);
    aside2 = length_squared(tangent);
  }
  return height / glm::sqrt(aside2 + height * height);
}

LUMI_HD inline float box_error(const SubtreeBounds& bounds, vec3 x, vec3 n, const CutOptions& options) {
  const vec3 nearest = glm::clamp(x, bounds.box.lo, bounds.box.hi) - x;
  return bounds.intensity * cosine_bound(bounds.box, x, n, options.bound == CutBound::kExact) /
         glm::max(length_squared(nearest), options.floor2);
}

// Bounds of what each child of a node can send, their own boxes and cones taken for themselves. `placement`: of the
// mesh whose tree the node is in, null in the world's.
template <int W>
LUMI_HD inline Lanes<W> child_errors(const LightNode<W>& node, bool cones, const MeshPlacement* placement, vec3 x,
                                     vec3 n, float floor2) {
  BoxLanes<W> boxes = load_boxes<W>(node);
  if (placement) boxes = place<W>(boxes, *placement);
  const auto cones_of_node = [&] {
    return placement ? place<W>(load_cones<W>(node), *placement) : load_cones<W>(node);
  };
  return weigh_boxes<W>(boxes, cones && (!placement || placement->to_normal > 0), cones_of_node, floor2,
                        broadcast<W>(x), broadcast<W>(n))
      .near;
}

template <int W>
LUMI_HD inline float sum_of_child_errors(const LightNode<W>& node, int first, int children, bool cones,
                                         const MeshPlacement* placement, vec3 x, vec3 n, float floor2) {
  float errors[W], sum = 0;
  store_lanes<W>(child_errors<W>(node, cones, placement, x, n, floor2), errors);
  for (int c = first; c < first + children; ++c) sum += errors[c];
  return sum;
}

// --- trees that can be cut ---------------------------------------------------------------------------------
// What select_cut asks of a tree, for a surface at x with normal n:
//   bool root(TreeStart&)                  all lights; false if there are none
//   int split(TreeStart, TreeStart[2])     the parts of a node that hold lights; of several lights only
//   float error(TreeStart)                 0 for a single light

LUMI_HD inline bool is_leaf(const LightTreeView& tree, Subtree subtree) {
  return subtree.children == 1 && subtree.level == tree.levels - 1;
}

// The whole tree, as a range whose halves are binary nodes.
LUMI_HD inline Subtree binary_root(const LightTreeView& tree) {
  Subtree root = whole_tree(tree);
  int children = 1;
  while (children < tree.root_children) children *= 2;
  root.children = static_cast<std::uint8_t>(children);
  return root;
}

// One child of a node is that child's own children, where it has any.
template <int W>
LUMI_HD inline Subtree enter_children(const LightTreeView& tree, Subtree s) {
  if (s.children > 1 || is_leaf(tree, s)) return s;
  return {s.node * W + s.first, static_cast<std::int16_t>(s.level + 1), 0, static_cast<std::uint8_t>(W)};
}

// The halves of several children that hold lights, and not only bogus ones.
template <int W>
LUMI_HD inline int halves_with_lights(const LightTreeView& tree, const Subtree& s, Subtree (&halves)[2]) {
  const LightNode<W>& node = tree.level<W>(s.level)[s.node];
  const auto half = static_cast<std::uint8_t>(s.children / 2);
  int count = 0;
  for (int side = 0; side < 2; ++side) {
    const auto first = static_cast<std::uint8_t>(s.first + side * half);
    if (bounds_of<W>(node, first, half).intensity > 0) halves[count++] = {s.node, s.level, first, half};
  }
  return count;
}

// The perfect tree, of one level or two.
template <int W>
struct CutOfTrees {
  const LightTreeView& top;
  const MeshTreesView& below;
  const CutOptions& options;
  vec3 x, n;

  LUMI_HD const LightTreeView& tree_of(const TreeStart& start) const {
    return start.instance == kNoId ? top : below.trees[below.instances[start.instance].tree];
  }
  LUMI_HD const LightNode<W>& node_of(const TreeStart& start) const {
    return tree_of(start).template level<W>(start.subtree.level)[start.subtree.node];
  }

  // A leaf of the top level is the tree of its mesh.
  LUMI_HD TreeStart enter(const TreeStart& start) const {
    const Subtree& s = start.subtree;
    const LightTreeView& tree = tree_of(start);
    if (!is_leaf(tree, s)) return {enter_children<W>(tree, s), start.instance};
    if (start.instance != kNoId || !below.present()) return start;
    const std::uint32_t instance = tree.leaf_emitters[s.node * W + s.first];
    const std::uint32_t mesh = below.instances[instance].tree;
    return mesh == TreeInstance::kNone ? start : TreeStart{binary_root(below.trees[mesh]), instance};
  }

  LUMI_HD bool root(TreeStart& start) const {
    if (top.count == 0) return false;
    start = enter({binary_root(top)});
    return true;
  }

  LUMI_HD int split(const TreeStart& start, TreeStart (&parts)[2]) const {
    Subtree halves[2];
    const int count = halves_with_lights<W>(tree_of(start), start.subtree, halves);
    for (int k = 0; k < count; ++k) parts[k] = enter({halves[k], start.instance});
    return count;
  }

  LUMI_HD float error(const TreeStart& start) const {
    const LightTreeView& tree = tree_of(start);
    const Subtree& s = start.subtree;
    if (is_leaf(tree, s)) return 0;
    const LightNode<W>& node = node_of(start);
    const MeshPlacement* placement = start.instance == kNoId ? nullptr : &below.placements[start.instance];
    if (options.bound == CutBound::kChildren)
      return sum_of_child_errors<W>(node, s.first, s.children, s.level >= tree.first_cones, placement, x, n,
                                    options.floor2);
    const SubtreeBounds bounds = bounds_of<W>(node, s.first, s.children);
    return box_error(placement ? place(bounds, *placement) : bounds, x, n, options);
  }
};

struct CutOfBvh {
  const LightBvhView& bvh;
  const CutOptions& options;
  vec3 x, n;

  LUMI_HD bool root(TreeStart& start) const {
    start = {subtree_of_entry(kBvhRoot)};
    return bvh.count > 0;
  }

  LUMI_HD int split(const TreeStart& start, TreeStart (&parts)[2]) const {
    const std::uint32_t link = bvh.link(entry_of_subtree(start.subtree));
    parts[0] = {subtree_of_entry(2 * link)};
    parts[1] = {subtree_of_entry(2 * link + 1)};
    return 2;
  }

  LUMI_HD float error(const TreeStart& start) const {
    const std::uint32_t link = bvh.link(entry_of_subtree(start.subtree));
    if ((link & kBvhLeaf) != 0) return 0;
    const bool cones = bvh.cones || bvh.weights == Weights::kSaoh;
    if (options.bound == CutBound::kChildren)
      return sum_of_child_errors<2>(bvh.nodes[link].bounds, 0, 2, cones, nullptr, x, n, options.floor2);
    return box_error(bounds_of<2>(bvh.nodes[start.subtree.node].bounds, start.subtree.first, 1), x, n, options);
  }
};

// --- selection ---------------------------------------------------------------------------------------------

// Splits the node of the greatest error until there are n, or none has any. Cut: LightCut, or longer.
template <class Tree, class Cut>
LUMI_HD inline void select_cut(const Tree& tree, int size, Cut& cut) {
  cut.count = 0;
  if (!tree.root(cut.nodes[0])) return;
  cut.error[0] = tree.error(cut.nodes[0]);
  cut.count = 1;
  while (cut.count < size) {
    int worst = 0;
    for (int i = 1; i < cut.count; ++i)
      if (cut.error[i] > cut.error[worst]) worst = i;
    if (!(cut.error[worst] > 0)) return;
    TreeStart parts[2];
    const int count = tree.split(cut.nodes[worst], parts);
    // The first takes the place of what is split, the second is appended.
    for (int part = 0; part < count; ++part) {
      const int place = part == 0 ? worst : cut.count++;
      cut.nodes[place] = parts[part];
      cut.error[place] = tree.error(parts[part]);
    }
  }
}

LUMI_HD inline void select_cut(const LightSampler& sampler, vec3 x, vec3 n, const CutOptions& options, LightCut& cut) {
  if (sampler.choice == LightChoice::kBvh) {
    select_cut(CutOfBvh{sampler.bvh, options, x, n}, options.size, cut);
    return;
  }
  with_width(sampler.tree.width, [&](auto w) {
    select_cut(CutOfTrees<w>{sampler.tree, sampler.mesh_trees, options, x, n}, options.size, cut);
  });
}

// Which cut, and which of its nodes, a pixel samples.
struct CutLookup {
  PixelWindow window;  // of the tile whose surfaces are lit, in the order of pixel_of_index
  int share = 8;       // k
  int interleave = 1;  // m
  std::uint32_t frame = 0;

  LUMI_HD int blocks_x() const { return (window.x1 - 1) / share - window.x0 / share + 1; }
  LUMI_HD int blocks() const { return blocks_x() * ((window.y1 - 1) / share - window.y0 / share + 1); }
  LUMI_HD int block_of(Pixel p) const {
    return (p.y / share - window.y0 / share) * blocks_x() + p.x / share - window.x0 / share;
  }
  LUMI_HD PixelWindow pixels_of(int block) const {
    const int x = (window.x0 / share + block % blocks_x()) * share, y = (window.y0 / share + block / blocks_x()) * share;
    return {glm::max(x, window.x0), glm::max(y, window.y0), glm::min(x + share, window.x1),
            glm::min(y + share, window.y1)};
  }
  // Samples that a pixel takes at most.
  LUMI_HD int passes(int size) const { return (size + interleave * interleave - 1) / (interleave * interleave); }
};

struct CutEntries {
  int first, end;
};
LUMI_HD inline CutEntries entries_of_pixel(const CutLookup& lookup, Pixel pixel, int nodes) {
  const int m = lookup.interleave, m2 = m * m;
  const int p = (static_cast<int>(lookup.frame % static_cast<std::uint32_t>(m2)) + m * (pixel.y % m) + pixel.x % m) % m2;
  return {p * nodes / m2, (p + 1) * nodes / m2};
}

// Random numbers of a block, whatever tile it is clipped by: keyed by its first pixel.
LUMI_HD inline Rng rng_of_block(const Rng& rng, const PixelWindow& pixels) {
  return {rng.seed, rng.frame, static_cast<std::uint32_t>(pixels.y0) * 65536u + static_cast<std::uint32_t>(pixels.x0)};
}

// cuts[block]: of a random pixel of the block that shows a surface.
struct CutKernel {
  LightSampler sampler;
  CutOptions options;
  CutLookup lookup;
  Rng rng;
  std::span<const Surface> surfaces;
  std::span<LightCut> cuts;

  LUMI_HD void operator()(int block) const {
    LightCut& cut = cuts[static_cast<std::size_t>(block)];
    cut.count = 0;
    const PixelWindow pixels = lookup.pixels_of(block);
    const float u = rng_of_block(rng, pixels).uniform4(kDimCut).x;
    const int count = pixels.count(), random = static_cast<int>(u * static_cast<float>(count));
    for (int k = 0; k < count; ++k) {
      const int at = (random + k) % count;
      const Pixel pixel{pixels.x0 + at % pixels.width(), pixels.y0 + at / pixels.width()};
      const Surface& s = surfaces[static_cast<std::size_t>(index_of_pixel(lookup.window, pixel))];
      if (s.instance == kNoId) continue;
      select_cut(sampler, s.position, s.normal, options, cut);
      return;
    }
  }
};

}  // namespace lumigrove
