#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <set>

#include "light_fixtures.h"
#include "light_scenes.h"
#include "lumigrove/renderer.h"
#include "methods/lightcuts/cut_kernel.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

// Leaves [first, end) below a node of a cut.
struct LeafRange {
  std::uint32_t first, end;
};
LeafRange range_below(const LightTreeView& tree, Subtree s) {
  std::uint64_t span = 1;  // leaves below a child
  for (int level = s.level + 1; level < tree.levels; ++level) span *= static_cast<std::uint64_t>(tree.width);
  const std::uint64_t first = (static_cast<std::uint64_t>(s.node) * static_cast<std::uint64_t>(tree.width) + s.first) * span;
  const std::uint64_t end = first + s.children * span;
  return {static_cast<std::uint32_t>(std::min<std::uint64_t>(first, tree.count)),
          static_cast<std::uint32_t>(std::min<std::uint64_t>(end, tree.count))};
}

LightCut cut_at(const LightTreeView& tree, const Surface& s, const CutOptions& options) {
  LightSampler sampler;
  sampler.choice = LightChoice::kTree;
  sampler.tree = tree;
  LightCut cut;
  select_cut(sampler, s.position, s.normal, options, cut);
  return cut;
}

SubtreeBounds bounds_at(const LightTreeView& tree, Subtree s) {
  return with_width(tree.width, [&](auto w) {
    return bounds_of<w>(tree.level<w>(s.level)[s.node], s.first, s.children);
  });
}

Scene cloud_of(int n) { return n >= 4 ? triangle_cloud(n, 0.2f, 11) : punctual_cloud(n, 12); }

TEST(LightCut, IsAPartitionOfAllLights) {
  for (const int width : {2, 4, 8, 16})
    for (const int n : {1, 2, 3, 5, 16, 17, 64, 200, 1000}) {
      const LightWorld world(cloud_of(n), {width, true, true});
      const LightTreeView tree = world.tree().view();
      for (const Surface& s : shading_points(12))
        for (const int size : {1, 2, 7, 8, 32})
          for (const CutBound bound : {CutBound::kNearest, CutBound::kExact, CutBound::kChildren}) {
            const LightCut cut = cut_at(tree, s, {size, 1e-4f, bound});
            ASSERT_LE(cut.count, size);
            ASSERT_GE(cut.count, 1);
            std::vector<LeafRange> ranges;
            for (int i = 0; i < cut.count; ++i) ranges.push_back(range_below(tree, cut.nodes[i].subtree));
            std::sort(ranges.begin(), ranges.end(), [](LeafRange a, LeafRange b) { return a.first < b.first; });
            std::uint32_t next = 0;
            for (const LeafRange& range : ranges) {
              ASSERT_EQ(range.first, next) << "width " << width << ", " << n << " lights, " << size << " nodes";
              ASSERT_LT(range.first, range.end);
              next = range.end;
            }
            ASSERT_EQ(next, tree.count);
          }
    }
}

TEST(LightCut, OfNoLightsIsEmpty) {
  const LightWorld world(punctual_cloud(0));
  EXPECT_EQ(cut_at(world.tree().view(), shading_points(1)[0], {8, 1e-4f}).count, 0);
}

// The next node to be split is the one of the largest error.
TEST(LightCut, SplitsTheLargestErrors) {
  const LightWorld world(triangle_cloud(600, 0.2f, 13));
  const LightTreeView tree = world.tree().view();
  for (const Surface& s : shading_points(40)) {
    const CutOptions longer{8, 1e-4f}, shorter{7, 1e-4f};
    const LightCut a = cut_at(tree, s, shorter), b = cut_at(tree, s, longer);
    if (b.count <= a.count) {  // nothing left to split
      for (int i = 0; i < a.count; ++i) EXPECT_EQ(a.error[i], 0);
      continue;
    }
    const int worst = static_cast<int>(std::max_element(a.error, a.error + a.count) - a.error);
    EXPECT_TRUE(std::none_of(b.nodes, b.nodes + b.count, [&](const TreeStart& n) { return n == a.nodes[worst]; }));
  }
}

TEST(LightCut, ErrorIsTheBoundOfThePaper) {
  const LightWorld world(triangle_cloud(300, 0.2f, 14));
  const LightTreeView tree = world.tree().view();
  for (const Surface& s : shading_points(20)) {
    const CutOptions options{16, 0.01f, CutBound::kExact};
    const LightCut cut = cut_at(tree, s, options);
    for (int i = 0; i < cut.count; ++i) {
      const SubtreeBounds bounds = bounds_at(tree, cut.nodes[i].subtree);
      if (is_leaf(tree, cut.nodes[i].subtree)) {
        EXPECT_EQ(cut.error[i], 0);
        continue;
      }
      // Sampled points of the box never have a larger cosine or a smaller distance than the bound allows.
      Stream random(static_cast<std::uint32_t>(i));
      for (int k = 0; k < 50; ++k) {
        const vec3 y = random.in_box(bounds.box.lo, bounds.box.hi) - s.position;
        const float d2 = glm::max(glm::dot(y, y), options.floor2);
        const float cosine = glm::max(0.0f, glm::dot(y, s.normal)) / glm::sqrt(glm::dot(y, y));
        EXPECT_LE(bounds.intensity * cosine / d2, cut.error[i] * 1.0001f + 1e-12f);
      }
    }
  }
}

TEST(PixelOrder, IsOneToOneAndHasAnInverse) {
  for (const PixelWindow& window : {PixelWindow{0, 0, 64, 64}, PixelWindow{3, 5, 40, 42}, PixelWindow{0, 0, 1, 9},
                                    PixelWindow{7, 7, 8, 8}, PixelWindow{1, 2, 30, 5}, PixelWindow{0, 0, 9, 65}}) {
    std::set<std::pair<int, int>> seen;
    for (int i = 0; i < window.count(); ++i) {
      const Pixel p = pixel_of_index(window, i);
      ASSERT_TRUE(p.x >= window.x0 && p.x < window.x1 && p.y >= window.y0 && p.y < window.y1);
      ASSERT_TRUE(seen.insert({p.x, p.y}).second);
      ASSERT_EQ(index_of_pixel(window, p), i);
    }
  }
}

TEST(PixelOrder, SixtyFourInARowAreABlock) {
  const PixelWindow window{64, 128, 128, 192};
  for (int i = 0; i < window.count(); ++i) {
    const Pixel first = pixel_of_index(window, i / 64 * 64), p = pixel_of_index(window, i);
    EXPECT_EQ(p.x / 8, first.x / 8);
    EXPECT_EQ(p.y / 8, first.y / 8);
  }
}

TEST(CutLookup, BlocksShareOutThePixels) {
  for (const int share : {1, 3, 8, 13, 64}) {
    const CutLookup lookup{{60, 33, 124, 90}, share, 1, 0};
    std::vector<int> found(static_cast<std::size_t>(lookup.window.count()), 0);
    for (int block = 0; block < lookup.blocks(); ++block) {
      const PixelWindow pixels = lookup.pixels_of(block);
      ASSERT_GT(pixels.count(), 0);
      for (int y = pixels.y0; y < pixels.y1; ++y)
        for (int x = pixels.x0; x < pixels.x1; ++x) {
          ASSERT_EQ(lookup.block_of({x, y}), block);
          ++found[static_cast<std::size_t>(index_of_pixel(lookup.window, {x, y}))];
        }
    }
    EXPECT_EQ(std::count(found.begin(), found.end(), 1), lookup.window.count());
  }
}

TEST(CutLookup, InterleavedPixelsShareOutTheNodes) {
  for (const int m : {1, 2, 3, 4})
    for (const int nodes : {1, 3, 8, 17, 32}) {
      std::vector<int> over_pixels(static_cast<std::size_t>(nodes), 0), over_frames = over_pixels;
      CutLookup lookup{{0, 0, 64, 64}, 8, m, 5};
      for (int y = 0; y < m; ++y)
        for (int x = 0; x < m; ++x) {
          const CutEntries e = entries_of_pixel(lookup, {x + 2 * m, y + 3 * m}, nodes);
          EXPECT_LE(e.end - e.first, lookup.passes(nodes));
          for (int i = e.first; i < e.end; ++i) ++over_pixels[static_cast<std::size_t>(i)];
        }
      for (int frame = 0; frame < m * m; ++frame) {
        lookup.frame = static_cast<std::uint32_t>(frame);
        const CutEntries e = entries_of_pixel(lookup, {3, 4}, nodes);
        for (int i = e.first; i < e.end; ++i) ++over_frames[static_cast<std::size_t>(i)];
      }
      EXPECT_EQ(over_pixels, std::vector<int>(static_cast<std::size_t>(nodes), 1));
      EXPECT_EQ(over_frames, std::vector<int>(static_cast<std::size_t>(nodes), 1));
    }
}

// --- whole frames ------------------------------------------------------------------------------------------

// A room with a box in it, lit by many small quads on the ceiling and around the box: neighbouring pixels look at
// surfaces that different lights reach. A sun shines in where the sky is seen.
Scene room_of_lights() {
  SceneBuilder b;
  const int wall = b.material(vec3(0.6f));
  b.quad(vec3(-3, 0, -3), vec3(0, 0, 6), vec3(6, 0, 0), wall);
  b.quad(vec3(-3, 0, -3), vec3(6, 0, 0), vec3(0, 3, 0), wall);
  b.room(vec3(0.8f, 1.2f, 0.4f), vec3(-0.4f, 0.02f, -0.8f), b.material(vec3(0.3f, 0.6f, 0.4f)));  // fronts outside
  Stream random(31);
  for (int i = 0; i < 40; ++i) {
    const int bright = b.material(vec3(0), random.in_box(vec3(0.5f), vec3(6)));
    const vec3 at = i < 20 ? random.in_box(vec3(-2.5f, 2.8f, -2.5f), vec3(2.5f, 3, 2.5f))
                           : random.in_box(vec3(-2, 0.1f, -2.5f), vec3(2, 1.5f, -1.2f));
    b.quad(at, vec3(0.1f, 0, 0), i < 20 ? vec3(0, 0, 0.1f) : vec3(0, 0.1f, 0), bright);
  }
  PunctualLight sun;
  sun.type = LightType::kDirectional;
  sun.color = vec3(0.4f);
  b.punctual(sun, vec3(0), glm::normalize(vec3(0.4f, -1, -0.3f)));
  return b.scene;
}

mat4 placed(vec3 at, vec3 axis, vec3 scale) {
  const Frame frame = make_frame(glm::normalize(axis));
  return mat4(vec4(frame.x * scale.x, 0), vec4(frame.y * scale.y, 0), vec4(frame.z * scale.z, 0), vec4(at, 1));
}

// The same room lit by three lamps of many triangles, shown many times: turned, mirrored, stretched.
Scene room_of_shown_lamps() {
  Scene scene = room_of_lights();
  std::erase_if(scene.nodes, [&](const Node& node) {
    return !node.meshes.empty() &&
           max_component(scene.materials[static_cast<std::size_t>(
                                             scene.meshes[static_cast<std::size_t>(node.meshes[0])].material)]
                             .emission) > 0;
  });
  Stream random(32);
  std::vector<int> lamps;
  for (int lamp = 0; lamp < 3; ++lamp) {
    std::vector<vec3> corners;
    for (int i = 0; i < 14; ++i)
      add_triangle_of_size(corners, random, random.in_box(vec3(-0.3f), vec3(0.3f)), 0.06f);
    lamps.push_back(add_mesh(scene, add_material(scene, random.in_box(vec3(2), vec3(12)), lamp == 1), corners));
  }
  for (int i = 0; i < 18; ++i) {
    Node& node = add_node(scene, {lamps[static_cast<std::size_t>(i % 3)]});
    node.has_matrix = true;
    const vec3 scales[] = {vec3(1), vec3(-0.6f, 0.6f, 0.6f), vec3(2, 0.3f, 0.8f)};
    node.matrix = placed(i < 9 ? random.in_box(vec3(-2.5f, 2.2f, -2.5f), vec3(2.5f, 2.7f, 2.5f))
                               : random.in_box(vec3(-2, 0.5f, -2.5f), vec3(2, 1.5f, -1.2f)),
                         random.direction(), scales[(i / 3) % 3]);
  }
  PunctualLight bulb;
  bulb.color = vec3(0.5f);
  add_light(scene, bulb, vec3(-1, 1.5f, 1));
  return scene;
}

Settings view_of_lights(const std::string& preset, int spp) {
  Settings settings = square_view(preset, 20, vec3(0.3f, 1.7f, 3.4f), vec3(0, 0.7f, -1), 60);
  settings.spp = spp;
  return settings;
}

// z-scores of the pixels' direct light (green) in `a` against `b`, by the images' own variances.
std::vector<double> z_scores(const Image& a, const Image& b) {
  const auto value = [](const Image& image, const char* layer, std::size_t i) {
    return static_cast<double>(image.find(layer)->values[3 * i + 1]);
  };
  std::vector<double> z;
  for (std::size_t i = 0; i < static_cast<std::size_t>(a.width) * static_cast<std::size_t>(a.height); ++i) {
    const double variance = value(a, "variance", i) + value(b, "variance", i);
    if (variance > 0) z.push_back((value(a, "direct", i) - value(b, "direct", i)) / std::sqrt(variance));
  }
  return z;
}

// Means of 400 pixels. Single pixels are compared as well where they have enough samples to know their own noise.
void expect_same_mean(const Image& image, const Image& truth, bool pixels, const std::string& what) {
  const std::vector<double> z = z_scores(image, truth);
  ASSERT_GT(z.size(), 300u);
  double sum = 0, worst = 0;
  for (const double score : z) {
    sum += score;
    worst = std::max(worst, std::abs(score));
  }
  EXPECT_LT(std::abs(sum) / std::sqrt(static_cast<double>(z.size())), 3.5) << what;
  if (pixels) {
    EXPECT_LT(worst, 5.5) << what;
  }
}

TEST(SharedCuts, HaveTheExhaustiveSumAsMean) {
  const Scene scene = room_of_lights();
  const Image truth = render(scene, view_of_lights("exhaustive", 64));
  struct Variant {
    int nodes, share, interleave, width;
    bool cones;
  };
  for (const Variant& v : {Variant{8, 8, 1, 16, true}, Variant{8, 1, 1, 16, true}, Variant{8, 8, 2, 16, true},
                           Variant{5, 3, 1, 2, false}, Variant{32, 16, 3, 4, true}, Variant{1, 8, 1, 8, true}}) {
    Settings settings = view_of_lights("rtslc", 144);
    settings.direct.spp = v.nodes;
    settings.direct.cut_share = v.share;
    settings.direct.cut_interleave = v.interleave;
    settings.direct.width = v.width;
    settings.direct.cones = v.cones;
    expect_same_mean(render(scene, settings), truth, v.interleave == 1,
                     std::to_string(v.nodes) + " nodes, shared by " + std::to_string(v.share) + ", interleaved by " +
                         std::to_string(v.interleave));
  }
}

TEST(SharedCuts, OfEveryTreeHaveTheExhaustiveSumAsMean) {
  const Scene scene = room_of_shown_lamps();
  const Image truth = render(scene, view_of_lights("exhaustive", 64));
  struct Variant {
    Hierarchy hierarchy;
    Weights weights;
    int nodes, share, interleave, width;
  };
  for (const Variant& v : {Variant{Hierarchy::kTwoLevel, Weights::kMinMax, 8, 8, 1, 16},
                           Variant{Hierarchy::kTwoLevel, Weights::kMinMax, 8, 1, 2, 2},
                           Variant{Hierarchy::kTwoLevel, Weights::kMinMax, 20, 4, 2, 4},
                           Variant{Hierarchy::kSaoh, Weights::kSaoh, 8, 8, 1, 16},
                           Variant{Hierarchy::kSaoh, Weights::kMinMax, 8, 1, 2, 16},
                           Variant{Hierarchy::kAgglomerative, Weights::kMinMax, 20, 4, 2, 16}}) {
    Settings settings = view_of_lights("rtslc", 96);
    settings.direct.hierarchy = v.hierarchy;
    settings.direct.weights = v.weights;
    settings.direct.spp = v.nodes;
    settings.direct.cut_share = v.share;
    settings.direct.cut_interleave = v.interleave;
    settings.direct.width = v.width;
    expect_same_mean(render(scene, settings), truth, v.interleave == 1,
                     get_value(settings, "direct.hierarchy") + ", " + std::to_string(v.nodes) + " nodes, shared by " +
                         std::to_string(v.share) + ", interleaved by " + std::to_string(v.interleave));
  }
}

// A glossy floor under lamps of very different sizes, a sun and a sky.
Scene glossy_floor() {
  SceneBuilder b;
  b.quad(vec3(-3, 0, -3), vec3(0, 0, 6), vec3(6, 0, 0), b.material(vec3(0.8f), vec3(0), 1, 0.25f));
  Stream random(41);
  for (int i = 0; i < 24; ++i) {
    const int bright = b.material(vec3(0), random.in_box(vec3(0.5f), vec3(3)));
    const float size = i % 4 == 0 ? 1.2f : 0.15f;
    const vec3 corner = random.in_box(vec3(-2.5f, 0.2f, -2.8f), vec3(1.5f, 1.2f, -1.5f));
    b.quad(corner, vec3(size, 0, 0), vec3(0, size, 0), bright);
  }
  PunctualLight sun;
  sun.type = LightType::kDirectional;
  sun.color = vec3(0.3f);
  b.punctual(sun, vec3(0), glm::normalize(vec3(0.4f, -1, -0.3f)));
  b.scene.environment.radiance = vec3(0.15f);
  return b.scene;
}

struct MisVariant {
  int nodes, share, interleave, width;
  bool cones;
  Hierarchy hierarchy = Hierarchy::kPerfect;
};

Settings glossy_view(const std::string& preset, const MisVariant& v, bool mis, int spp) {
  Settings settings = square_view(preset, 20, vec3(0.3f, 1.7f, 3.4f), vec3(0, 0, -0.3f), 50);
  settings.spp = spp;
  settings.force_diffuse = false;
  settings.direct.mis = mis;
  settings.direct.hierarchy = v.hierarchy;
  settings.direct.spp = v.nodes;
  settings.direct.cut_share = v.share;
  settings.direct.cut_interleave = v.interleave;
  settings.direct.width = v.width;
  settings.direct.cones = v.cones;
  return settings;
}

TEST(SharedCuts, HaveTheExhaustiveSumAsMeanBesideBsdfSamples) {
  const Scene scene = glossy_floor();
  const Image truth = render(scene, glossy_view("exhaustive", {1, 8, 1, 16, true}, true, 200));
  for (const MisVariant& v : {MisVariant{8, 8, 1, 16, true}, MisVariant{5, 1, 1, 2, false},
                              MisVariant{8, 8, 2, 16, true}, MisVariant{3, 4, 3, 4, true},
                              MisVariant{8, 8, 2, 16, true, Hierarchy::kTwoLevel},
                              MisVariant{20, 4, 1, 2, true, Hierarchy::kTwoLevel},
                              MisVariant{8, 8, 2, 16, true, Hierarchy::kSaoh}})
    expect_same_mean(render(scene, glossy_view("rtslc", v, true, 144)), truth, v.interleave == 1,
                     std::to_string(v.nodes) + " nodes, shared by " + std::to_string(v.share) + ", interleaved by " +
                         std::to_string(v.interleave));
}

double summed_variance(const Image& image) {
  double sum = 0;
  for (const float v : image.find("variance")->values) sum += static_cast<double>(v);
  return sum;
}

TEST(SharedCuts, BsdfSamplesBesideThemLessenTheNoiseOfGloss) {
  const Scene scene = glossy_floor();
  for (const MisVariant& v : {MisVariant{8, 8, 1, 16, true}, MisVariant{8, 8, 2, 16, true}}) {
    const double without = summed_variance(render(scene, glossy_view("rtslc", v, false, 64)));
    EXPECT_LT(summed_variance(render(scene, glossy_view("rtslc", v, true, 64))), 0.5 * without);
  }
}

TEST(SharedCuts, SpreadTheSamplesOverTheLights) {
  const Scene scene = room_of_lights();
  const auto noise = [&](int nodes) {
    Settings settings = view_of_lights("rtslc", 32);
    settings.direct.spp = nodes;
    const Image image = render(scene, settings);
    double sum = 0;
    for (const float v : image.find("variance")->values) sum += static_cast<double>(v);
    return sum;
  };
  const double one = noise(1), eight = noise(8), all = noise(32);
  EXPECT_LT(eight, 0.5 * one);
  EXPECT_LT(all, 0.5 * eight);
}

TEST(SharedCuts, DoNotDependOnThreadsOrCropWindows) {
  const Scene scene = room_of_shown_lamps();
  Settings settings = view_of_lights("rtslc", 2);
  settings.width = 150;  // more than one tile
  for (const Hierarchy hierarchy : {Hierarchy::kPerfect, Hierarchy::kTwoLevel, Hierarchy::kSaoh}) {
    settings.direct.hierarchy = hierarchy;
    settings.threads = 1;
    const Image one = render(scene, settings);
    for (const int threads : {2, 4}) {
      settings.threads = threads;
      EXPECT_EQ(render(scene, settings).find("direct")->values, one.find("direct")->values);
    }
  }
}

TEST(SharedCuts, RefuseWhatTheyCannotDo) {
  Settings settings = make_preset("rtslc");
  settings.direct.spp = 33;
  EXPECT_THROW(check(settings), Error);
  settings = make_preset("rtslc");
  settings.direct.hierarchy = Hierarchy::kNone;
  EXPECT_THROW(check(settings), Error);
  settings = make_preset("rtslc");
  settings.direct.hierarchy = Hierarchy::kSaoh;
  EXPECT_NO_THROW(check(settings));
  settings.direct.split = 0.5f;
  EXPECT_THROW(check(settings), Error);
}

}  // namespace
}  // namespace lumigrove
