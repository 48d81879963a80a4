// Small scenes full of lights, and the light set, tree and alias table over them.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/rng.h"
#include "base/sampling.h"
#include "lights/light_set.h"
#include "lights/alias_table.h"
#include "methods/light_bvh/light_bvh.h"
#include "methods/light_sampling/light_sampler_kernel.h"
#include "methods/light_tree/light_tree.h"
#include "scene/scene_view.h"
#include "statistics.h"

namespace lumigrove::testing {

// A stream of random numbers for making scenes and shading points.
class Stream {
 public:
  explicit Stream(std::uint32_t seed) : rng_{seed, 0, 0} {}
  vec4 next() {
    ++rng_.pixel;
    return rng_.uniform4(0);
  }
  vec3 in_box(vec3 lo, vec3 hi) { return lo + vec3(next()) * (hi - lo); }
  vec3 direction() {
    const vec4 u = next();
    return sample_uniform_sphere(vec2(u.x, u.y));
  }

 private:
  Rng rng_;
};

inline int add_material(Scene& scene, vec3 emission, bool double_sided = false) {
  Material material;
  material.emission = emission;
  material.double_sided = double_sided;
  scene.materials.push_back(material);
  return static_cast<int>(scene.materials.size()) - 1;
}

inline int add_mesh(Scene& scene, int material, std::vector<vec3> corners) {  // three corners a triangle
  Mesh mesh;
  mesh.material = material;
  for (std::uint32_t i = 0; i < corners.size(); i += 3) mesh.triangles.push_back({i, i + 1, i + 2});
  mesh.positions = std::move(corners);
  scene.meshes.push_back(std::move(mesh));
  return static_cast<int>(scene.meshes.size()) - 1;
}

inline Node& add_node(Scene& scene, std::vector<int> meshes) {
  Node node;
  node.meshes = std::move(meshes);
  scene.nodes.push_back(std::move(node));
  return scene.nodes.back();
}

inline void add_light(Scene& scene, PunctualLight light, vec3 position) {
  scene.lights.push_back(std::move(light));
  Node& node = add_node(scene, {});
  node.translation = position;
  node.light = static_cast<int>(scene.lights.size()) - 1;
}

inline void add_triangle_of_size(std::vector<vec3>& corners, Stream& random, vec3 centre, float size) {
  for (int k = 0; k < 3; ++k) corners.push_back(centre + random.direction() * size);
}

// n small triangles of various colours in a box.
inline Scene triangle_cloud(int n, float size, std::uint32_t seed = 1) {
  Scene scene;
  Stream random(seed);
  for (int m = 0; m < 4; ++m) {
    const vec3 emission = random.in_box(vec3(0.1f), vec3(5));
    const int material = add_material(scene, emission, m == 3);
    std::vector<vec3> corners;
    for (int i = 0; i < n / 4; ++i)
      add_triangle_of_size(corners, random, random.in_box(vec3(-5), vec3(5)), size);
    const int mesh = add_mesh(scene, material, std::move(corners));
    add_node(scene, {mesh});
  }
  return scene;
}

// Point and spot lights, some of them black, some at the very same place.
inline Scene punctual_cloud(int n, std::uint32_t seed = 2) {
  Scene scene;
  Stream random(seed);
  add_node(scene, {add_mesh(scene, add_material(scene, vec3(0)), {vec3(-5), vec3(5, -5, -5), vec3(5)})});
  for (int i = 0; i < n; ++i) {
    PunctualLight light;
    light.type = i % 3 == 0 ? LightType::kSpot : LightType::kPoint;
    light.color = i % 10 == 9 ? vec3(0) : random.in_box(vec3(0.1f), vec3(3));
    light.inner_cone = 0.3f;
    light.outer_cone = 1.2f;
    light.range = i % 7 == 0 ? 8.0f : 0.0f;
    add_light(scene, light, i % 5 == 0 ? vec3(1, 2, 3) : random.in_box(vec3(-5), vec3(5)));
  }
  return scene;
}

// One big bright triangle among small dim ones in a plane, triangles of no area, and lights along a line.
inline Scene uneven_mix(std::uint32_t seed = 3) {
  Scene scene;
  Stream random(seed);
  add_node(scene,
           {add_mesh(scene, add_material(scene, vec3(1)), {vec3(-6, 4, -6), vec3(6, 4, 6), vec3(6, 4, -6)})});
  std::vector<vec3> small;
  for (int i = 0; i < 60; ++i) {
    const vec3 p = vec3(random.next().x * 10 - 5, 0, random.next().y * 10 - 5);
    small.insert(small.end(), {p, p + vec3(0.05f, 0, 0.1f), p + vec3(0.1f, 0, 0)});
  }
  for (int i = 0; i < 6; ++i) small.insert(small.end(), {vec3(0), vec3(1), vec3(2)});  // no area
  add_node(scene, {add_mesh(scene, add_material(scene, vec3(20, 10, 0)), small)});
  for (int i = 0; i < 20; ++i) add_light(scene, {}, vec3(static_cast<float>(i) * 0.25f, 1, 0));
  return scene;
}

// Two clusters far apart, and directional lights and an environment beside them.
inline Scene far_clusters_under_a_sky(std::uint32_t seed = 4) {
  Scene scene = triangle_cloud(40, 0.2f, seed);
  Node& far = add_node(scene, {0, 1});
  far.translation = vec3(300, 0, 0);
  far.scale = vec3(-2, 1, 3);  // mirrored
  PunctualLight sun;
  sun.type = LightType::kDirectional;
  sun.color = vec3(3, 2, 1);
  add_light(scene, sun, vec3(0));
  scene.nodes.back().rotation = vec4(-0.7071068f, 0, 0, 0.7071068f);  // -Z turned to -Y: shines down
  scene.environment.radiance = vec3(0.2f, 0.3f, 0.5f);
  return scene;
}

// The default tree, which can also be asked for probabilities.
inline constexpr LightTree::Options kTree{16, true, true};

// Light set and samplers over a scene that it owns.
class LightWorld {
 public:
  explicit LightWorld(Scene scene, LightTree::Options tree = kTree, Settings settings = {})
      : scene_(std::make_unique<Scene>(std::move(scene))), state_(evaluate(*scene_, 0)), arrays_(*scene_) {
    arrays_.set_state(state_);
    lights_ = std::make_unique<LightSet>(*scene_, arrays_);
    lights_->gather(arrays_, state_, settings);
    tree_.build(lights_->view(), tree);
    std::vector<float> flux;
    for (std::uint32_t i = 0; i < lights_->view().emitters.size(); ++i)
      flux.push_back(emitter_flux(lights_->view(), i));
    alias_.build(flux);
  }

  LightView lights() const { return lights_->view(); }
  const LightTree& tree() const { return tree_; }
  const SceneState& state() const { return state_; }
  LightSampler sampler(LightChoice choice) const {
    LightSampler sampler;
    sampler.scene = arrays_.view();
    sampler.lights = lights_->view();
    sampler.choice = choice;
    sampler.alias = alias_.view();
    sampler.tree = tree_.view();
    if (choice == LightChoice::kBvh) {
      bvh_.build(lights_->view(), {Hierarchy::kSaoh, Weights::kSaoh, true});
      sampler.bvh = bvh_.view();
    }
    return sampler;
  }

 private:
  std::unique_ptr<Scene> scene_;
  SceneState state_;
  SceneArrays arrays_;
  std::unique_ptr<LightSet> lights_;
  LightTree tree_;
  mutable LightBvh bvh_;  // built when asked for
  AliasTable alias_;
};

inline Surface surface_at(vec3 position, vec3 normal) {
  Surface surface;
  surface.position = position;
  surface.normal = surface.geometric_normal = surface.wo = normal;
  surface.diffuse = vec3(1);
  surface.specular = vec3(0);
  surface.emission = vec3(0);
  surface.instance = 0;
  return surface;
}

// Shading points inside and outside the boxes of the scenes above.
inline std::vector<Surface> shading_points(int n, std::uint32_t seed = 9) {
  std::vector<Surface> surfaces;
  Stream random(seed);
  for (int i = 0; i < n; ++i) {
    const float reach = i % 3 == 0 ? 3.0f : (i % 3 == 1 ? 8.0f : 40.0f);
    surfaces.push_back(surface_at(random.in_box(vec3(-reach), vec3(reach)), random.direction()));
  }
  return surfaces;
}

// P-value (chi-square) of where walks down a tree end, at one of the emitters or at a dead branch, when they should
// follow the pdf. walk(vec2 u) -> TreeSample, pdf(std::uint32_t emitter) -> float.
template <class Walk, class Pdf>
double walk_p_value(int draws, std::size_t emitters, Stream& random, const Walk& walk, const Pdf& pdf) {
  std::vector<double> observed(emitters + 1, 0), expected(emitters + 1, 0);
  for (int i = 0; i < draws; ++i) {
    const vec4 u = random.next();
    const TreeSample sample = walk(vec2(u.x, u.y));
    ++observed[sample.emitter == kNoEmitter ? emitters : sample.emitter];
  }
  double total = 0;
  for (std::uint32_t e = 0; e < emitters; ++e) total += expected[e] = draws * static_cast<double>(pdf(e));
  expected[emitters] = draws - total;  // dead branches
  if (expected[emitters] < 1e-3 * draws && observed[emitters] == 0) expected[emitters] = 0;
  return chi_square_p_value(observed, expected);
}

// Irradiance that one light sample stands for, unoccluded.
inline double sample_value(const LightSample& sample, const Surface& s) {
  return luminance(sample.weight) * std::max(0.0f, glm::dot(sample.wi, s.normal));
}

struct NamedScene {
  const char* name;
  Scene scene;
};
inline std::vector<NamedScene> light_scenes() {
  std::vector<NamedScene> scenes;
  scenes.push_back({"triangle cloud", triangle_cloud(200, 0.3f)});
  scenes.push_back({"punctual cloud", punctual_cloud(120)});
  scenes.push_back({"uneven mix", uneven_mix()});
  scenes.push_back({"far clusters under a sky", far_clusters_under_a_sky()});
  return scenes;
}

}  // namespace lumigrove::testing
