// Scenes of meshes that many instances share, turned and bent in many ways, and the two-level tree over their lights.
#pragma once

#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "light_fixtures.h"
#include "methods/light_tree/two_level_tree.h"

namespace lumigrove::testing {

// --- scenes of shared meshes -------------------------------------------------------------------------------

// A closed body of eight triangles, outside outwards, round the origin.
inline std::vector<vec3> octahedron(float size) {
  const vec3 x(size, 0, 0), y(0, size, 0), z(0, 0, size);
  std::vector<vec3> corners;
  for (int i = 0; i < 8; ++i) {
    const float sx = i & 1 ? -1.0f : 1.0f, sy = i & 2 ? -1.0f : 1.0f, sz = i & 4 ? -1.0f : 1.0f;
    const bool outwards = sx * sy * sz > 0;
    const vec3 a = x * sx, b = y * sy, c = z * sz;
    corners.insert(corners.end(), {a, outwards ? b : c, outwards ? c : b});
  }
  return corners;
}

// Closed bodies, a cloud of two-sided triangles, a single triangle and a textured square.
inline void add_shared_meshes(Scene& scene) {
  Stream random(31);
  add_mesh(scene, add_material(scene, vec3(4, 2, 1)), octahedron(0.7f));
  std::vector<vec3> cloud;
  for (int i = 0; i < 40; ++i)
    add_triangle_of_size(cloud, random, random.in_box(vec3(-1), vec3(1, 0.4f, 1)), 0.15f);
  add_mesh(scene, add_material(scene, vec3(1, 3, 8), true), cloud);
  add_mesh(scene, add_material(scene, vec3(9)), {vec3(-0.4f, 0, 0), vec3(0, 0, 0.8f), vec3(0.5f, 0, 0)});

  Image8or32 image;
  image.width = image.height = 4;
  for (int i = 0; i < 16; ++i)
    for (int c = 0; c < 4; ++c) image.texels32.push_back(i < 6 ? 0.0f : random.next().x * 3);
  scene.images.push_back(image);
  const int material = add_material(scene, vec3(5, 4, 6));
  scene.materials.back().emissive_texture.image = 0;
  std::vector<vec3> square;
  std::vector<vec2> uvs;
  constexpr int kCells = 4;
  const auto corner = [&](int x, int y) {
    const vec2 uv(static_cast<float>(x) / kCells, static_cast<float>(y) / kCells);
    square.push_back({uv.x - 0.5f, 0, uv.y - 0.5f});
    uvs.push_back(uv * 0.999f);
  };
  for (int y = 0; y < kCells; ++y) {
    for (int x = 0; x < kCells; ++x) {
      corner(x, y), corner(x + 1, y), corner(x, y + 1);
      corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1);
    }
  }
  add_mesh(scene, material, square);
  scene.meshes.back().uv0 = uvs;
}

inline mat4 turn(Stream& random) {
  const Frame frame = make_frame(random.direction());
  return mat4(vec4(frame.x, 0), vec4(frame.y, 0), vec4(frame.z, 0), vec4(0, 0, 0, 1));
}
inline mat4 stretch(vec3 scale) {
  return mat4(vec4(scale.x, 0, 0, 0), vec4(0, scale.y, 0, 0), vec4(0, 0, scale.z, 0), vec4(0, 0, 0, 1));
}

using Shape = std::function<mat4(Stream&)>;  // linear part of an instance

inline Scene instances_of(int count, const Shape& shape, float reach = 6) {
  Scene scene;
  add_shared_meshes(scene);
  Stream random(32);
  for (int i = 0; i < count; ++i) {
    Node& node = add_node(scene, {i % 4});
    node.has_matrix = true;
    node.matrix = shape(random);
    node.matrix[3] = vec4(random.in_box(vec3(-reach), vec3(reach)), 1);
  }
  return scene;
}

inline Scene with_points(Scene scene) {
  Stream random(33);
  for (int i = 0; i < 12; ++i) {
    PunctualLight light;
    light.type = i % 3 == 0 ? LightType::kSpot : LightType::kPoint;
    light.outer_cone = 1.2f;
    light.color = i == 5 ? vec3(0) : random.in_box(vec3(1), vec3(9));
    add_light(scene, light, random.in_box(vec3(-6), vec3(6)));
  }
  return scene;
}

inline mat4 shear() {
  mat4 m(1);
  m[1][0] = 0.8f;
  m[2][1] = -0.5f;
  return m;
}

inline std::vector<NamedScene> instance_scenes() {
  std::vector<NamedScene> scenes;
  scenes.push_back({"turned", instances_of(24, turn)});
  scenes.push_back(
      {"scaled", instances_of(24, [](Stream& r) { return turn(r) * stretch(vec3(0.2f + 3 * r.next().x)); })});
  scenes.push_back(
      {"mirrored", instances_of(24, [](Stream& r) { return turn(r) * stretch(vec3(-1, 1, 1)); })});
  scenes.push_back({"stretched", instances_of(24, [](Stream& r) {
                      return turn(r) * stretch(vec3(4, 0.1f, 1)) * turn(r);
                    })});
  scenes.push_back(
      {"sheared", instances_of(24, [](Stream& r) { return turn(r) * shear() * stretch(vec3(1, -2, 1)); })});
  scenes.push_back(
      {"flattened", instances_of(24, [](Stream& r) { return turn(r) * stretch(vec3(1, 1e-7f, 1)); })});
  scenes.push_back({"with points", with_points(instances_of(12, turn))});
  scenes.push_back({"points only", punctual_cloud(60)});
  return scenes;
}

// --- the tree over them ------------------------------------------------------------------------------------

class TwoLevelWorld {
 public:
  explicit TwoLevelWorld(Scene scene, LightTree::Options options = kTree)
      : scene_(std::make_unique<Scene>(std::move(scene))),
        arrays_(*scene_),
        lights_(std::make_unique<LightSet>((arrays_.set_state(evaluate(*scene_, 0)), *scene_), arrays_)),
        options_(options) {
    update();
  }

  // As a frame of an animation does: the scene's nodes as they are now.
  void update() {
    const SceneState state = evaluate(*scene_, 0);
    arrays_.set_state(state);
    lights_->gather(arrays_, state, {});
    tree_.build(arrays_.view(), lights_->view(), options_);
  }

  Scene& scene() { return *scene_; }
  LightView lights() const { return lights_->view(); }
  const TwoLevelTree& tree() const { return tree_; }
  LightSampler sampler() const {
    LightSampler sampler;
    sampler.scene = arrays_.view();
    sampler.lights = lights_->view();
    sampler.choice = LightChoice::kTree;
    sampler.tree = tree_.top().view();
    sampler.mesh_trees = tree_.view();
    return sampler;
  }

 private:
  std::unique_ptr<Scene> scene_;
  SceneArrays arrays_;
  std::unique_ptr<LightSet> lights_;
  LightTree::Options options_;
  TwoLevelTree tree_;
};

}  // namespace lumigrove::testing
