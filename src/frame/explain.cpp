#include "frame/explain.h"

#include <algorithm>
#include <cmath>

#include "device/device.h"
#include "scene/surface_kernel.h"

namespace lumigrove {
namespace {

// --- drawing -----------------------------------------------------------------------------------------------

// Walks of one lobe that go together.
struct WalkGroup {
  SubstituteWalkPoints points;
  std::size_t index[kSubstituteWalks];
  float probability[kSubstituteWalks];
  int count = 0;

  void add(std::size_t i, const Surface& surface, vec3 numbers, float lobe_probability, bool gloss) {
    points.set(count, surface, numbers, gloss);
    index[count] = i;
    probability[count++] = lobe_probability;
  }
};

bool is_boxed(const WalkResult& walk, vec3 p) {
  for (int axis = 0; axis < 3; ++axis) {
    const bool flat = !(walk.box.lo[axis] < walk.box.hi[axis]);
    if (!flat && (p[axis] == walk.box.lo[axis] || p[axis] == walk.box.hi[axis])) return true;
  }
  return false;
}

bool is_clamped(const VplPoint& light, const Surface& surface, float clamp) {
  const vec3 to_surface = surface.position - light.position;
  const float d2 = length_squared(to_surface);
  return glm::dot(to_surface, light.normal) > clamp * d2 * std::sqrt(d2);
}

class Drawing {
 public:
  Drawing(const IndirectLighting& lighting, std::span<const WalkStart> starts, std::optional<Lobes> lobe,
          std::span<DrawnLight> drawn)
      : lighting_(lighting), starts_(starts), lobe_(lobe), drawn_(drawn) {}

  void batch(std::size_t first) const {
    WalkGroup diffuse, gloss;
    const std::size_t end = std::min(first + kSubstituteWalks, starts_.size());
    for (std::size_t i = first; i < end; ++i) add(i, diffuse, gloss);
    finish<false>(diffuse);
    finish<true>(gloss);
  }

 private:
  vec4 numbers(std::size_t i, std::uint32_t block) const {
    const Rng rng{lighting_.rng.seed, lighting_.rng.frame, starts_[i].pixel};
    return rng.uniform4(starts_[i].dimension + 4 * block);
  }

  void add(std::size_t i, WalkGroup& diffuse, WalkGroup& gloss) const {
    const Surface& surface = *starts_[i].surface;
    const vec4 u = numbers(i, 0);
    const vec3 rest(u.y, u.z, u.w);
    if (lobe_) {
      (*lobe_ == Lobes::kGloss ? gloss : diffuse).add(i, surface, rest, 1, *lobe_ == Lobes::kGloss);
      return;
    }
    const float p = diffuse_walk_probability(lighting_.sampler, surface);
    if (u.x < p)
      diffuse.add(i, surface, rest, p, false);
    else
      gloss.add(i, surface, rest, 1 - p, true);
  }

  template <bool kGloss>
  void finish(const WalkGroup& group) const {
    if (group.count == 0) return;
    const VplSampler& sampler = lighting_.sampler;
    WalkResult results[kSubstituteWalks];
    walk_substitute_tree<kGloss>(sampler.walk, group.points, group.count, results);
    for (int k = 0; k < group.count; ++k) {
      const std::size_t i = group.index[k];
      DrawnLight& drawn = drawn_[i];
      drawn = {};
      drawn.walk = results[k];
      drawn.lobe = kGloss ? Lobes::kGloss : Lobes::kDiffuse;
      drawn.lobe_probability = group.probability[k];
      if (drawn.walk.end == WalkEnd::kDead) continue;
      const bool substitute = drawn.walk.end == WalkEnd::kSubstitute;
      drawn.light = vpl_of_walk(sampler, drawn.walk, substitute ? numbers(i, 1) : vec4(0));
      drawn.boxed = substitute && is_boxed(drawn.walk, drawn.light.position);
      drawn.clamped = is_clamped(drawn.light, *starts_[i].surface, sampler.clamp);
    }
  }

  const IndirectLighting& lighting_;
  std::span<const WalkStart> starts_;
  std::optional<Lobes> lobe_;
  std::span<DrawnLight> drawn_;
};

// Which of the lights do not reach their surfaces; lights that send nothing are not asked about.
std::vector<std::uint8_t> find_occluded(const World& world, std::span<const WalkStart> starts,
                                        std::span<const DrawnLight> drawn, std::span<const vec3> light) {
  std::vector<Ray> rays(starts.size());
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (length_squared(light[i]) > 0) rays[i] = vpl_shadow_ray(*starts[i].surface, drawn[i].light);
  std::vector<std::uint8_t> occluded(rays.size());
  world.geometry->tracer.occluded(rays, occluded, Coherence::kIncoherent);
  return occluded;
}

// Rounding puts points of a flat substitute a little to either side of their surface. In units of D.
constexpr float kOnSurface = 1e-5f;

// Counts the substitutes' points that are inside geometry (WalkStatistics).
void count_inside(const World& world, const IndirectLighting& lighting, std::span<const DrawnLight> drawn,
                  WalkStatistics& statistics) {
  std::vector<Ray> rays;
  for (const DrawnLight& d : drawn) {
    if (d.walk.end != WalkEnd::kSubstitute) continue;
    Ray ray{d.light.position, kOnSurface * lighting.sampler.lights.diagonal, d.light.normal, d.walk.box.diagonal()};
    rays.push_back(ray);
  }
  std::vector<Hit> hits(rays.size());
  world.geometry->tracer.closest(rays, hits, Coherence::kIncoherent);
  const SceneView scene = world.geometry->arrays.view();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].instance == kNoId) continue;
    const auto& instance = scene.instances[hits[i].instance];
    const auto& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
    const WorldTriangle triangle = world_triangle(mesh, instance, mesh.triangles[hits[i].triangle]);
    const vec3 front = glm::cross(triangle.e1, triangle.e2) * instance.flip;
    if (!(glm::dot(front, rays[i].direction) > 0)) continue;
    ++statistics.inside;
    if (hits[i].t > lighting.sampler.substitute_offset) ++statistics.inside_beyond_offset;
  }
}

// --- weighing ----------------------------------------------------------------------------------------------

// What the walk compares: only the ratio counts.
struct RelativeWeights {
  float value[2], inverse[2];
};

// Equation (5) of child `side`: what it divides by is what the other child's relative weight was multiplied with.
float weight_of(const SubstituteWalk& walk, const RelativeWeights& relative, const float* shine, const float* mean2,
                int side) {
  if (walk.weight == Weights::kDistanceBounded) return shine[side] / std::max(mean2[side], walk.floor2);
  const int other = 1 - side;
  return shine[side] * shine[other] / relative.value[other];  // NaN if the other child cannot be taken
}

// Both children of `node` by the walk's own arithmetic.
template <bool kGloss>
RelativeWeights weigh(const SubstituteWalk& walk, const SubstituteWalkPoints& points, std::uint32_t node,
                      WeighedChild* children) {
  constexpr int L = kWalkLanes;
  std::uint32_t index[L];
  std::fill(index, index + L, node);
  const WalkLanes<L> walks = load_walks<L, kGloss>(points, 0);
  Lanes<L> words[kNodeWords];
  load_nodes<L>(walk.tree.nodes, index, words);
  const ChildLanes<L> sides[2] = {unpack_child<L>(words, walks.position),
                                  unpack_child<L>(words + kNodeWords / 2, walks.position)};
  const PairWeights<L> weights = weigh_children<L, kGloss>(walk, walks, sides[0], sides[1]);
  const auto lane = [](const Lanes<L>& lanes) {
    float stored[L];
    store_lanes<L>(lanes, stored);
    return stored[0];
  };
  const RelativeWeights relative{{lane(weights.left), lane(weights.right)},
                                 {lane(reciprocal<L>(weights.left)), lane(reciprocal<L>(weights.right))}};
  float shine[2], mean2[2];
  for (int side = 0; side < 2; ++side) {
    const ChildShine<L> seen = shine_of_child<L, kGloss>(walk, walks, sides[side]);
    shine[side] = lane(seen.shine);
    mean2[side] = lane(seen.mean2);
  }
  const vec2 probability = child_probabilities<kGloss>(walk, points, 0, node);
  for (int side = 0; side < 2; ++side) {
    const ChildRecord& record = walk.tree.nodes[node].child[side];
    WeighedChild& child = children[side];
    child.number = walk.tree.nodes[node].split() + static_cast<std::uint32_t>(side);
    child.leaf = (record.mean & ChildRecord::kLeaf) != 0;
    child.usable = (record.mean & ChildRecord::kUsable) != 0;
    child.intensity = record.intensity;
    child.distance = std::sqrt(mean2[side]);
    child.bound = record.intensity > 0 ? shine[side] / record.intensity : 0.0f;
    child.weight = weight_of(walk, relative, shine, mean2, side);
    child.probability = probability[side];
  }
  return relative;
}

// Which child the number picks, and what is left of it: as step_substitute_walks.
int pick(const RelativeWeights& weights, float& random) {
  const float left = weights.value[0], right = weights.value[1];
  const float total = left + right;
  if (!(total > 0)) return -1;
  const float target = random * total;
  const int side = left > 0 ? (right > 0 && target >= left ? 1 : 0) : 1;
  const float rest = side == 1 ? target - left : target;
  random = glm::clamp(rest * weights.inverse[side], 0.0f, 0x1.fffffep-1f);
  return side;
}

double share(const std::vector<double>& sums, const WeighedChild& child, std::uint32_t first, std::uint32_t last) {
  if (sums.empty()) return 0;
  const double all = sums[last + 1] - sums[first];
  return all > 0 ? (sums[child.last + 1] - sums[child.first]) / all : 0;
}

template <bool kGloss>
std::vector<WalkStep> explain_steps(const SubstituteWalk& walk, const SubstituteWalkPoints& points,
                                    const WalkResult& end, const TrueLight& truth) {
  std::vector<WalkStep> steps;
  if (end.steps == 0) return steps;
  std::uint32_t node = 0, first = 0, last = walk.tree.count - 1;
  float random = 0;
  for (int s = 0; s < end.steps; ++s) {
    WalkStep step;
    step.node = node;
    if (s % kStepsPerNumber == 0 && s / kStepsPerNumber < 3) random = points.u[s / kStepsPerNumber][0];
    step.random = random;
    const RelativeWeights weights = weigh<kGloss>(walk, points, node, step.child);
    const std::uint32_t split = step.child[0].number;
    step.child[0].first = first;
    step.child[0].last = split;
    step.child[1].first = split + 1;
    step.child[1].last = last;
    for (WeighedChild& child : step.child) {
      child.true_share = share(truth.unoccluded, child, first, last);
      child.visible_share = share(truth.visible, child, first, last);
    }
    step.taken = pick(weights, random);
    // Rounding of the number must not lead elsewhere than the walk went.
    if (end.end != WalkEnd::kDead) step.taken = end.node > split ? 1 : 0;
    steps.push_back(step);
    if (step.taken < 0) break;
    const WeighedChild& taken = step.child[step.taken];
    node = taken.number;
    first = taken.first;
    last = taken.last;
  }
  return steps;
}

}  // namespace

SeenSurfaces see_surfaces(const World& world, const Settings& settings, const PixelWindow& window, bool jitter) {
  const CameraView camera = make_camera_view(world.camera, settings.width, settings.height);
  const Rng rng = make_direct_lighting(world, settings, 0).rng;
  const auto n = static_cast<std::size_t>(window.count());
  std::vector<Ray> rays(n);
  std::vector<Hit> hits(n);
  SeenSurfaces seen{std::vector<Surface>(n), std::vector<std::uint32_t>(n)};
  launch(window.count(), CameraKernel{camera, window, rays, seen.pixels, rng.seed, rng.frame, jitter});
  world.geometry->tracer.closest(rays, hits, Coherence::kCoherent);
  launch(window.count(), SurfaceKernel{world.geometry->arrays.view(), rays, hits, seen.surfaces, settings.force_diffuse});
  return seen;
}

void draw_lights(const IndirectLighting& lighting, std::span<const WalkStart> starts, std::optional<Lobes> lobe,
                 std::span<DrawnLight> drawn) {
  const Drawing drawing(lighting, starts, lobe, drawn);
  launch(
      static_cast<int>((starts.size() + kSubstituteWalks - 1) / kSubstituteWalks),
      [&](int b) { drawing.batch(static_cast<std::size_t>(b) * kSubstituteWalks); }, 16);
}

vec3 unoccluded_light(const IndirectLighting& lighting, const Surface& surface, const DrawnLight& drawn) {
  if (drawn.walk.end == WalkEnd::kDead) return vec3(0);
  return vpl_light(surface, drawn.light, lighting.sampler.clamp, drawn.lobe) / drawn.lobe_probability;
}

WalkStatistics measure_walks(const World& world, const IndirectLighting& lighting, const SeenSurfaces& seen) {
  std::vector<WalkStart> starts;
  for (std::size_t i = 0; i < seen.surfaces.size(); ++i)
    if (seen.surfaces[i].instance != kNoId) starts.push_back({&seen.surfaces[i], seen.pixels[i], walk_dimension(0)});
  std::vector<DrawnLight> drawn(starts.size());
  draw_lights(lighting, starts, {}, drawn);
  std::vector<vec3> light(starts.size());
  for (std::size_t i = 0; i < light.size(); ++i) light[i] = unoccluded_light(lighting, *starts[i].surface, drawn[i]);
  const std::vector<std::uint8_t> occluded = find_occluded(world, starts, drawn, light);

  WalkStatistics result;
  result.walks = starts.size();
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    const DrawnLight& d = drawn[i];
    result.mean_steps += d.walk.steps;
    result.max_steps = std::max(result.max_steps, d.walk.steps);
    result.gloss += d.lobe == Lobes::kGloss;
    result.dead += d.walk.end == WalkEnd::kDead;
    result.leaves += d.walk.end == WalkEnd::kLeaf;
    result.substitutes += d.walk.end == WalkEnd::kSubstitute;
    result.boxed += d.boxed;
    result.clamped += d.clamped;
    result.dark += d.walk.end != WalkEnd::kDead && !(length_squared(light[i]) > 0);
    result.occluded += occluded[i];
  }
  if (result.walks > 0) result.mean_steps /= static_cast<double>(result.walks);
  count_inside(world, lighting, drawn, result);
  return result;
}

TrueLight true_light(const World& world, const IndirectLighting& lighting, const Surface& surface, Lobes lobe) {
  const SubstituteTreeView& tree = lighting.sampler.walk.tree;
  std::vector<vec3> light(tree.count);
  std::vector<Ray> rays(tree.count);
  launch(static_cast<int>(tree.count), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const VplPoint vpl = exact_vpl(tree.leaf(static_cast<std::uint32_t>(i)), 1);
    light[k] = vpl_light(surface, vpl, lighting.sampler.clamp, lobe);
    if (length_squared(light[k]) > 0) rays[k] = vpl_shadow_ray(surface, vpl);
  });
  std::vector<std::uint8_t> occluded;
  if (tree.count <= kMostTrueShadowRays) {
    occluded.resize(tree.count);
    world.geometry->tracer.occluded(rays, occluded, Coherence::kIncoherent);
  }
  TrueLight truth;
  truth.unoccluded.assign(1, 0);
  if (!occluded.empty()) truth.visible.assign(1, 0);
  glm::dvec3 all(0), arrives(0);
  for (std::size_t k = 0; k < light.size(); ++k) {
    const auto y = static_cast<double>(luminance(light[k]));
    all += glm::dvec3(light[k]);
    truth.unoccluded.push_back(truth.unoccluded.back() + y);
    if (occluded.empty()) continue;
    if (!occluded[k]) arrives += glm::dvec3(light[k]);
    truth.visible.push_back(truth.visible.back() + (occluded[k] ? 0 : y));
  }
  truth.unoccluded_sum = vec3(all);
  truth.visible_sum = vec3(arrives);
  return truth;
}

ExplainedWalk explain_walk(const World& world, const IndirectLighting& lighting, const Surface& surface,
                           std::uint32_t pixel, int sample, Lobes lobe, const TrueLight& truth) {
  const WalkStart start{&surface, pixel, walk_dimension(sample)};
  const std::span<const WalkStart> starts(&start, 1);
  ExplainedWalk walk;
  draw_lights(lighting, starts, lobe, {&walk.drawn, 1});
  SubstituteWalkPoints points;
  const vec4 u = Rng{lighting.rng.seed, lighting.rng.frame, pixel}.uniform4(start.dimension);
  points.set(0, surface, vec3(u.y, u.z, u.w), lobe == Lobes::kGloss);
  walk.steps = lobe == Lobes::kGloss ? explain_steps<true>(lighting.sampler.walk, points, walk.drawn.walk, truth)
                                     : explain_steps<false>(lighting.sampler.walk, points, walk.drawn.walk, truth);
  walk.unoccluded = unoccluded_light(lighting, surface, walk.drawn);
  walk.occluded = find_occluded(world, starts, {&walk.drawn, 1}, {&walk.unoccluded, 1})[0] != 0;
  return walk;
}

namespace {

// Of `n` numbers with these sums.
struct Estimate {
  double sum = 0, sum2 = 0;

  void add(double x) {
    sum += x;
    sum2 += x * x;
  }
  double error(double n) const {
    if (n < 2) return 0;
    return std::sqrt(std::max(0.0, sum2 / n - (sum / n) * (sum / n)) / (n - 1));
  }
};

}  // namespace

SampleSummary summarise_walks(const World& world, const IndirectLighting& lighting, const Surface& surface,
                              std::uint32_t pixel, int samples, Lobes lobe) {
  std::vector<WalkStart> starts;
  for (int s = 0; s < samples; ++s) starts.push_back({&surface, pixel, walk_dimension(s)});
  std::vector<DrawnLight> drawn(starts.size());
  draw_lights(lighting, starts, lobe, drawn);
  std::vector<vec3> light(starts.size());
  for (std::size_t i = 0; i < light.size(); ++i) light[i] = unoccluded_light(lighting, surface, drawn[i]);
  const std::vector<std::uint8_t> occluded = find_occluded(world, starts, drawn, light);

  SampleSummary result;
  result.samples = samples;
  Estimate unoccluded, arriving;
  glm::dvec3 sum(0);
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    result.dead += drawn[i].walk.end == WalkEnd::kDead;
    result.substitutes += drawn[i].walk.end == WalkEnd::kSubstitute;
    result.occluded += occluded[i];
    const auto y = static_cast<double>(luminance(light[i]));
    unoccluded.add(y);
    arriving.add(occluded[i] ? 0 : y);
    if (!occluded[i]) sum += glm::dvec3(light[i]);
  }
  const double n = samples;
  result.mean = vec3(sum / n);
  result.mean_y = arriving.sum / n;
  result.standard_error = arriving.error(n);
  result.unoccluded_y = unoccluded.sum / n;
  result.unoccluded_error = unoccluded.error(n);
  return result;
}

}  // namespace lumigrove
