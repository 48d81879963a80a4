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
//             Pixels without a surface pass the choice of the representative on to the next one.
// Estimator   unbiased: a cut is a partition of all lights, whatever pixel it was chosen for, and one light is sampled
//             below each node. Interleaved, unbiased as the mean over m^2 frames.
// In -> Out   surfaces of a tile -> a LightCut for every block of k x k pixels
// Oracle      tests/lightcuts_test.cpp: partition of the lights, greedy choice against a plain one, exhaustive sum.
#pragma once

#include "lumigrove/settings.h"
#include "methods/light_tree/light_tree_kernel.h"
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

struct LightCut {
  Subtree nodes[kMaxCut];
  float error[kMaxCut];
  int count = 0;
};

struct SubtreeBounds {
  Box3 box;
  float intensity = 0;
};

template <int W>
LUMI_HD inline SubtreeBounds bounds_of(const LightTreeView& tree, Subtree subtree) {
  const LightNode<W>& node = tree.level<W>(subtree.level)[subtree.node];
  SubtreeBounds bounds;
  for (int c = subtree.first; c < subtree.first + subtree.children; ++c) {
    if (!(node.intensity[c] > 0)) continue;
    const vec3 centre(node.centre_x[c], node.centre_y[c], node.centre_z[c]);
    const vec3 half(node.half_x[c], node.half_y[c], node.half_z[c]);
    bounds.box = unite(bounds.box, Box3{centre - half, centre + half});
    bounds.intensity += node.intensity[c];
  }
  return bounds;
}

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
LUMI_HD inline Subtree descend(const LightTreeView& tree, Subtree subtree) {
  if (subtree.children > 1 || is_leaf(tree, subtree)) return subtree;
  return {subtree.node * W + subtree.first, static_cast<std::int16_t>(subtree.level + 1), 0,
          static_cast<std::uint8_t>(W)};
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

// Bounds of what each child of a node can send, their own boxes and cones taken for themselves.
template <int W>
LUMI_HD inline Lanes<W> child_errors(const LightTreeView& tree, Subtree subtree, vec3 x, vec3 n, float floor2) {
  const LightNode<W>& node = tree.level<W>(subtree.level)[subtree.node];
  return weigh_boxes<W>(
             load_boxes<W>(node), subtree.level >= tree.first_cones, [&] { return load_cones<W>(node); }, floor2,
             broadcast<W>(x), broadcast<W>(n))
      .near;
}

template <int W>
LUMI_HD inline float cut_error(const LightTreeView& tree, Subtree subtree, const SubtreeBounds& bounds, vec3 x, vec3 n,
                               const CutOptions& options) {
  if (is_leaf(tree, subtree)) return 0;
  if (options.bound != CutBound::kChildren) return box_error(bounds, x, n, options);
  float errors[W], sum = 0;
  store_lanes<W>(child_errors<W>(tree, subtree, x, n, options.floor2), errors);
  for (int c = subtree.first; c < subtree.first + subtree.children; ++c) sum += errors[c];
  return sum;
}

// Splits the node of the greatest error until there are n, or none has any.
template <int W>
LUMI_HD inline void select_cut(const LightTreeView& tree, vec3 x, vec3 n, const CutOptions& options, LightCut& cut) {
  cut.count = 0;
  if (tree.count == 0) return;
  const Subtree root = descend<W>(tree, binary_root(tree));
  cut.nodes[0] = root;
  cut.error[0] = cut_error<W>(tree, root, bounds_of<W>(tree, root), x, n, options);
  cut.count = 1;
  while (cut.count < options.size) {
    int worst = 0;
    for (int i = 1; i < cut.count; ++i)
      if (cut.error[i] > cut.error[worst]) worst = i;
    if (!(cut.error[worst] > 0)) return;
    const Subtree split = cut.nodes[worst];
    const auto half = static_cast<std::uint8_t>(split.children / 2);
    int written = 0;
    for (int side = 0; side < 2; ++side) {
      Subtree child = split;
      child.first = static_cast<std::uint8_t>(split.first + side * half);
      child.children = half;
      const SubtreeBounds bounds = bounds_of<W>(tree, child);
      if (!(bounds.intensity > 0)) continue;  // nothing but bogus lights
      child = descend<W>(tree, child);
      // The first takes the place of what is split, the second is appended.
      const int place = written++ == 0 ? worst : cut.count++;
      cut.nodes[place] = child;
      cut.error[place] = cut_error<W>(tree, child, bounds, x, n, options);
    }
  }
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

// cuts[block]: of a random pixel of the block that shows a surface.
struct CutKernel {
  LightTreeView tree;
  CutOptions options;
  CutLookup lookup;
  Rng rng;
  std::span<const Surface> surfaces;
  std::span<LightCut> cuts;

  LUMI_HD void operator()(int block) const {
    LightCut& cut = cuts[static_cast<std::size_t>(block)];
    cut.count = 0;
    const PixelWindow pixels = lookup.pixels_of(block);
    const auto number = static_cast<std::uint32_t>(pixels.y0) * 65536u + static_cast<std::uint32_t>(pixels.x0);
    const float u = Rng{rng.seed, rng.frame, number}.uniform4(kDimCut).x;
    const int count = pixels.count(), random = static_cast<int>(u * static_cast<float>(count));
    for (int k = 0; k < count; ++k) {
      const int at = (random + k) % count;
      const Pixel pixel{pixels.x0 + at % pixels.width(), pixels.y0 + at / pixels.width()};
      const Surface& s = surfaces[static_cast<std::size_t>(index_of_pixel(lookup.window, pixel))];
      if (s.instance == kNoId) continue;
      with_width(tree.width, [&](auto w) { select_cut<w>(tree, s.position, s.normal, options, cut); });
      return;
    }
  }
};

}  // namespace lumigrove
