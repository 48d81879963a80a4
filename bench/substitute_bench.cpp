// The substitute tree: its build.
#include <tbb/parallel_sort.h>

#include "base/morton.h"
#include "base/rng.h"
#include "base/sampling.h"
#include "bench.h"
#include "methods/substitute_tree/substitute_tree.h"

namespace lumigrove::bench {
namespace {

// Lights as paths leave them, in no order: on the walls of a room, and on spheres and slanted tiles inside it.
LargeArray<Vpl> scattered_lights(std::uint32_t count) {
  constexpr std::uint32_t kObjects = 64;
  LargeArray<Vpl> vpls(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const vec4 u = Rng{1, 0, i}.uniform4(0), v = Rng{2, 0, i}.uniform4(0);
    const auto object = static_cast<std::uint32_t>(u.w * kObjects);
    const vec4 place = Rng{3, 0, object}.uniform4(0);
    const vec3 direction = sample_uniform_sphere(vec2(u));
    Vpl& vpl = vpls[i];
    vpl.epsilon = 1e-4f;
    vpl.intensity = vec3(v) * (0.01f + v.w * v.w * v.w);
    if (object < kObjects / 2) {  // a wall
      const int axis = static_cast<int>(object % 3);
      vpl.position = vec3(u) * 10.0f;
      vpl.position[axis] = object % 2 == 0 ? 0.0f : 10.0f;
      vpl.normal = vec3(0);
      vpl.normal[axis] = object % 2 == 0 ? 1.0f : -1.0f;
    } else if (object < kObjects * 3 / 4) {
      vpl.normal = direction;
      vpl.position = vec3(place) * 10.0f + direction * (0.2f + place.w);
    } else {
      vpl.normal = sample_uniform_sphere(vec2(place));
      const Frame frame = make_frame(vpl.normal);
      vpl.position = vec3(place) * 10.0f + frame.x * u.x + frame.y * u.y;
    }
  }
  return vpls;
}

VplView view_of(const LargeArray<Vpl>& vpls) {
  VplView view{vpls, {}, 1};
  for (const Vpl& vpl : vpls) view.bounds = unite(view.bounds, vpl.position);
  view.diagonal = view.bounds.diagonal();
  return view;
}

SubstituteTree::Options tree_options(const VplView& lights) {
  return {Topology::kRadix, 0.5f, 0.0216f * lights.diagonal, kInfinity};
}

}  // namespace

Result build_substitute_1m(const Options& options) {
  const LargeArray<Vpl> vpls = scattered_lights(1000000);
  const VplView lights = view_of(vpls);
  const vec3 scale = inverse_extent(lights.bounds);
  LargeArray<KeyIndex> input, pairs;
  for (const Vpl& vpl : vpls)
    input.push_back({morton30((vpl.position - lights.bounds.lo) * scale), static_cast<std::uint32_t>(input.size())});
  SubstituteTree tree;
  const auto less = [](KeyIndex a, KeyIndex b) { return a.key < b.key; };
  const PairTimes times = time_in_turns(
      options.runs, [&] { tree.build(lights, tree_options(lights)); },
      [&] { tbb::parallel_sort(pairs.begin(), pairs.end(), less); }, [&] { pairs = input; });
  const double count = tree.view().count;
  return {times.ratio,
          {{"build_ms", times.a_ms},
           {"parallel_sort_ms", times.b_ms},
           {"lowest_ratio", times.lowest_ratio},
           {"highest_ratio", times.highest_ratio},
           {"lights", count},
           {"bytes per light", static_cast<double>(tree.bytes()) / count},
           {"bytes per light during the build", static_cast<double>(tree.scratch_bytes()) / count}}};
}

Result build_substitute_growth(const Options& options) {
  const LargeArray<Vpl> many = scattered_lights(1000000), few = scattered_lights(100000);
  const VplView many_lights = view_of(many), few_lights = view_of(few);
  SubstituteTree many_tree, few_tree;
  const PairTimes times = time_in_turns(
      options.runs, [&] { many_tree.build(many_lights, tree_options(many_lights)); },
      [&] { few_tree.build(few_lights, tree_options(few_lights)); });
  return {times.ratio,
          {{"ms, 1 M lights", times.a_ms},
           {"ms, 100 k lights", times.b_ms},
           {"lowest_ratio", times.lowest_ratio},
           {"highest_ratio", times.highest_ratio}}};
}

}  // namespace lumigrove::bench
