#include "scene/builtin/scene_parts.h"

#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <utility>

namespace lumigrove::builtin {
namespace {

void animate(Scene& scene, int node, AnimatedProperty property, float period, int keys,
             Interpolation interpolation, const std::function<vec4(float)>& value) {
  if (scene.animations.empty()) scene.animations.push_back({"loop", {}});
  AnimationChannel channel;
  channel.node = node;
  channel.property = property;
  channel.interpolation = interpolation;
  for (int k = 0; k <= keys; ++k) {
    const float phase = static_cast<float>(k) / static_cast<float>(keys);
    channel.times.push_back(phase * period);
    if (interpolation != Interpolation::kCubicSpline) {
      channel.values.push_back(value(phase));
      continue;
    }
    constexpr float kStep = 1.0f / 256;
    const vec4 tangent = (value(phase + kStep) - value(phase - kStep)) / (2 * kStep * period);
    channel.values.insert(channel.values.end(), {tangent, value(phase), tangent});
  }
  scene.animations.front().channels.push_back(std::move(channel));
}

}  // namespace

int add_surface(Scene& scene, std::string name, vec3 base_color, float roughness, float metallic) {
  Material material;
  material.name = std::move(name);
  material.base_color = base_color;
  material.roughness = roughness;
  material.metallic = metallic;
  scene.materials.push_back(std::move(material));
  return static_cast<int>(scene.materials.size()) - 1;
}

int add_emitter(Scene& scene, std::string name, vec3 radiance, vec3 base_color) {
  const int index = add_surface(scene, std::move(name), base_color);
  scene.materials.back().emission = radiance;
  return index;
}

int add_mesh(Scene& scene, MeshBuilder& builder, std::string name, int material) {
  scene.meshes.push_back(builder.take(std::move(name), material));
  return static_cast<int>(scene.meshes.size()) - 1;
}

int add_node(Scene& scene, std::string name, std::vector<int> meshes, vec3 translation, vec4 rotation,
             int parent) {
  Node node;
  node.name = std::move(name);
  node.parent = parent;
  node.translation = translation;
  node.rotation = rotation;
  node.meshes = std::move(meshes);
  scene.nodes.push_back(std::move(node));
  return static_cast<int>(scene.nodes.size()) - 1;
}

void add_static(Scene& scene, MeshBuilder& builder, const std::string& name, int material) {
  if (builder.empty()) return;
  const int mesh = add_mesh(scene, builder, name, material);
  add_node(scene, name, {mesh});
}

int add_light_node(Scene& scene, const PunctualLight& light, vec3 translation, vec4 rotation, int parent) {
  scene.lights.push_back(light);
  const int node = add_node(scene, light.name, {}, translation, rotation, parent);
  scene.nodes.back().light = static_cast<int>(scene.lights.size()) - 1;
  return node;
}

void add_camera(Scene& scene, std::string name, vec3 from, vec3 towards, float vertical_fov_degrees) {
  scene.cameras.push_back({name, vertical_fov_degrees * kPi / 180, 0.01f});
  add_node(scene, std::move(name), {}, from, looking_along(towards - from));
  scene.nodes.back().camera = static_cast<int>(scene.cameras.size()) - 1;
}

vec4 axis_angle(vec3 unit_axis, float radians) {
  return vec4(unit_axis * sine(radians / 2), cosine(radians / 2));
}

vec4 looking_along(vec3 direction, vec3 up) {
  const vec3 back = -glm::normalize(direction);
  const vec3 helper = glm::length(glm::cross(up, back)) > 1e-3f ? up : vec3(0, 0, -1);
  const vec3 right = glm::normalize(glm::cross(helper, back));
  const glm::quat q = glm::normalize(glm::quat_cast(mat3(right, glm::cross(back, right), back)));
  return vec4(q.x, q.y, q.z, q.w);
}

mat4 placed(vec3 translation, float turn_about_y) {
  const float c = cosine(turn_about_y), s = sine(turn_about_y);
  return mat4(vec4(c, 0, -s, 0), vec4(0, 1, 0, 0), vec4(s, 0, c, 0), vec4(translation, 1));
}

void animate_translation(Scene& scene, int node, float period, int keys, Interpolation interpolation,
                         const std::function<vec3(float)>& value) {
  animate(scene, node, AnimatedProperty::kTranslation, period, keys, interpolation,
          [&](float phase) { return vec4(value(phase), 0); });
}

void animate_rotation(Scene& scene, int node, float period, int keys, Interpolation interpolation,
                      const std::function<vec4(float)>& value) {
  animate(scene, node, AnimatedProperty::kRotation, period, keys, interpolation, value);
}

}  // namespace lumigrove::builtin
