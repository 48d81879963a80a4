// A scene at one moment: animation channels sampled as the glTF 2.0 specification says (appendix C), world
// transforms down the hierarchy, and everything that nodes carry collected in node order.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>

#include "base/vec.h"
#include "device/device.h"
#include "lumigrove/scene.h"
#include "scene/hierarchy.h"

namespace lumigrove {

std::string label(const char* kind, std::size_t index, const std::string& name) {
  return name.empty() ? fmt::format("{} {}", kind, index) : fmt::format("{} {} ('{}')", kind, index, name);
}

std::vector<int> parents_first(const Scene& scene) {
  enum class Mark : std::uint8_t { kNew, kOnPath, kDone };
  std::vector<Mark> marks(scene.nodes.size(), Mark::kNew);
  std::vector<int> order, path;
  order.reserve(scene.nodes.size());
  for (int start = 0; start < static_cast<int>(scene.nodes.size()); ++start) {
    // Climb to the first ancestor that is already listed, then list the path downwards.
    for (int n = start; n >= 0 && marks[static_cast<std::size_t>(n)] != Mark::kDone;) {
      const std::size_t i = static_cast<std::size_t>(n);
      if (marks[i] == Mark::kOnPath)
        throw Error(
            fmt::format("{}: {} is its own ancestor", scene.name, label("node", i, scene.nodes[i].name)));
      marks[i] = Mark::kOnPath;
      path.push_back(n);
      n = scene.nodes[i].parent;
    }
    for (; !path.empty(); path.pop_back()) {
      marks[static_cast<std::size_t>(path.back())] = Mark::kDone;
      order.push_back(path.back());
    }
  }
  return order;
}

namespace {

struct Pose {
  vec3 translation, scale;
  vec4 rotation;
};

glm::quat to_quat(vec4 q) { return glm::quat(q.w, q.x, q.y, q.z); }
vec4 to_vec4(const glm::quat& q) { return vec4(q.x, q.y, q.z, q.w); }

vec4 normalized_rotation(vec4 q, vec4 otherwise) {
  const float length = glm::length(q);
  return length > 0.0f && is_finite(length) ? q / length : otherwise;
}

// Key k and the fraction towards key k+1; the fraction is 0 outside the keys.
struct KeyPosition {
  std::size_t key = 0;
  float fraction = 0, interval = 0;
};

KeyPosition find_key(const std::vector<float>& times, double seconds) {
  const auto after = std::upper_bound(times.begin(), times.end(), seconds, [](double s, float key_time) {
    return s < static_cast<double>(key_time);
  });
  if (after == times.begin()) return {0, 0, 0};
  const std::size_t key = static_cast<std::size_t>(after - times.begin()) - 1;
  if (after == times.end()) return {key, 0, 0};
  const double interval = static_cast<double>(*after) - static_cast<double>(times[key]);
  return {key, static_cast<float>((seconds - static_cast<double>(times[key])) / interval),
          static_cast<float>(interval)};
}

// Cubic Hermite spline; tangents are per second.
vec4 sample_spline(const AnimationChannel& channel, const KeyPosition& at) {
  const vec4* here = &channel.values[3 * at.key];
  if (at.interval == 0.0f) return here[1];
  const vec4* next = here + 3;
  const float t = at.fraction, t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * here[1] + at.interval * (t3 - 2 * t2 + t) * here[2] +
         (-2 * t3 + 3 * t2) * next[1] + at.interval * (t3 - t2) * next[0];
}

vec4 sample(const AnimationChannel& channel, double seconds) {
  const KeyPosition at = find_key(channel.times, seconds);
  const bool rotates = channel.property == AnimatedProperty::kRotation;
  if (channel.interpolation == Interpolation::kCubicSpline) {
    const vec4 value = sample_spline(channel, at);
    return rotates ? normalized_rotation(value, channel.values[3 * at.key + 1]) : value;
  }
  const vec4 here = channel.values[at.key];
  if (channel.interpolation == Interpolation::kStep || at.fraction == 0.0f) return here;
  const vec4 next = channel.values[at.key + 1];
  if (!rotates) return here + at.fraction * (next - here);
  const vec4 turned =
      to_vec4(glm::slerp(to_quat(here), to_quat(next), at.fraction));  // takes the shorter arc
  return normalized_rotation(turned, here);
}

std::vector<Pose> poses_at(const Scene& scene, double seconds) {
  std::vector<Pose> poses;
  poses.reserve(scene.nodes.size());
  for (const Node& node : scene.nodes) poses.push_back({node.translation, node.scale, node.rotation});
  for (const Animation& animation : scene.animations)
    for (const AnimationChannel& channel : animation.channels) {
      Pose& pose = poses[static_cast<std::size_t>(channel.node)];
      const vec4 value = sample(channel, seconds);
      switch (channel.property) {
        case AnimatedProperty::kTranslation:
          pose.translation = vec3(value);
          break;
        case AnimatedProperty::kRotation:
          pose.rotation = value;
          break;
        case AnimatedProperty::kScale:
          pose.scale = vec3(value);
          break;
      }
    }
  return poses;
}

mat4 local_matrix(const Node& node, const Pose& pose) {
  if (node.has_matrix) return node.matrix;
  mat4 m = glm::mat4_cast(to_quat(pose.rotation));
  for (int c = 0; c < 3; ++c) m[c] *= pose.scale[c];
  m[3] = vec4(pose.translation, 1);
  return m;
}

bool all_finite(const mat4& m) {
  bool finite = true;
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r) finite = finite && is_finite(m[c][r]);
  return finite;
}

struct World {
  std::vector<mat4> matrices;
  std::vector<glm::quat> rotations;  // without scale: orients lights and cameras below a scale of zero
  std::vector<bool> moves;
};

World world_transforms(const Scene& scene, double seconds) {
  const std::size_t count = scene.nodes.size();
  const std::vector<Pose> poses = poses_at(scene, seconds);
  World world{std::vector<mat4>(count), std::vector<glm::quat>(count), std::vector<bool>(count, false)};
  for (const Animation& animation : scene.animations)
    for (const AnimationChannel& channel : animation.channels)
      world.moves[static_cast<std::size_t>(channel.node)] = true;
  for (const int n : parents_first(scene)) {
    const std::size_t i = static_cast<std::size_t>(n);
    const Node& node = scene.nodes[i];
    world.matrices[i] = local_matrix(node, poses[i]);
    world.rotations[i] = node.has_matrix ? glm::quat(1, 0, 0, 0) : to_quat(poses[i].rotation);
    if (node.parent >= 0) {
      const std::size_t parent = static_cast<std::size_t>(node.parent);
      world.matrices[i] = world.matrices[parent] * world.matrices[i];
      world.rotations[i] = world.rotations[parent] * world.rotations[i];
      world.moves[i] = world.moves[i] || world.moves[parent];
    }
    if (!all_finite(world.matrices[i]))
      throw Error(fmt::format("{}: {} has a transform that is not finite at {} s", scene.name,
                              label("node", i, node.name), seconds));
  }
  return world;
}

// Unit vector along column `c` of the node's world matrix; scale must not matter, so that a scale of zero
// falls back on the rotations alone.
vec3 axis(const World& world, std::size_t node, int c) {
  const vec3 column(world.matrices[node][c]);
  const float largest = max_component(glm::abs(column));
  if (largest > 0.0f) return glm::normalize(column / largest);
  vec3 unit(0);
  unit[c] = 1;
  return world.rotations[node] * unit;
}

CameraInstance place_camera(const Camera& camera, const World& world, std::size_t node) {
  CameraInstance placed{.camera = camera, .node = static_cast<int>(node)};
  placed.position = vec3(world.matrices[node][3]);
  placed.forward = -axis(world, node, 2);
  const vec3 up = axis(world, node, 1);
  const vec3 right = glm::cross(placed.forward, up);
  placed.right = glm::dot(right, right) > 1e-12f ? glm::normalize(right) : make_frame(placed.forward).x;
  placed.up = glm::cross(placed.right, placed.forward);
  return placed;
}

Box3 bounds_of(const Scene& scene, const std::vector<MeshInstance>& instances) {
  std::vector<Box3> boxes(instances.size());
  launch(
      static_cast<int>(instances.size()),
      [&](int i) {
        const MeshInstance& instance = instances[static_cast<std::size_t>(i)];
        Box3 box;
        for (const vec3 p : scene.meshes[static_cast<std::size_t>(instance.mesh)].positions)
          box = unite(box, transform_point(instance.to_world, p));
        boxes[static_cast<std::size_t>(i)] = box;
      },
      1);
  Box3 bounds;
  for (const Box3& box : boxes) bounds = unite(bounds, box);
  return bounds;
}

// Squared distances inside the scene must stay finite in single precision.
constexpr double kLargestDiagonal = 1e18;

float diagonal_of(const Scene& scene, const Box3& bounds) {
  if (bounds.empty()) return 1;
  const glm::dvec3 extent = glm::dvec3(bounds.hi) - glm::dvec3(bounds.lo);
  const double diagonal = glm::length(extent);
  if (!(diagonal < kLargestDiagonal))
    throw Error(fmt::format("{}: the scene is {} m across, more than the {} m that can be rendered",
                            scene.name, diagonal, kLargestDiagonal));
  return diagonal > 0 ? static_cast<float>(diagonal) : 1.0f;
}

}  // namespace

SceneState evaluate(const Scene& scene, double seconds) {
  if (!std::isfinite(seconds))
    throw Error(fmt::format("{}: the time {} s is not finite", scene.name, seconds));
  const World world = world_transforms(scene, seconds);
  SceneState state;
  for (std::size_t i = 0; i < scene.nodes.size(); ++i) {
    const Node& node = scene.nodes[i];
    const mat4& m = world.matrices[i];
    const mat4x3 to_world{vec3(m[0]), vec3(m[1]), vec3(m[2]), vec3(m[3])};
    for (const int mesh : node.meshes)
      state.instances.push_back({mesh, static_cast<int>(i), to_world, world.moves[i]});
    if (node.light >= 0)
      state.lights.push_back({scene.lights[static_cast<std::size_t>(node.light)], static_cast<int>(i),
                              to_world[3], -axis(world, i, 2)});
    if (node.camera >= 0)
      state.cameras.push_back(place_camera(scene.cameras[static_cast<std::size_t>(node.camera)], world, i));
  }
  state.bounds = bounds_of(scene, state.instances);
  state.diagonal = diagonal_of(scene, state.bounds);
  return state;
}

double duration(const Scene& scene) {
  float last = 0;
  for (const Animation& animation : scene.animations)
    for (const AnimationChannel& channel : animation.channels)
      if (!channel.times.empty()) last = std::max(last, channel.times.back());
  return static_cast<double>(last);
}

CameraInstance default_camera(const SceneState& state) {
  CameraInstance view;
  view.camera.name = "default";
  view.node = -1;
  view.forward = glm::normalize(vec3(0, -0.3f, -1));
  view.right = vec3(1, 0, 0);
  view.up = glm::cross(view.right, view.forward);
  // As near as the eight corners of the bounds stay inside a square field of view, with a small margin.
  const vec3 target = state.bounds.empty() ? vec3(0) : state.bounds.centre();
  const vec3 half = state.bounds.empty() ? vec3(0.5f) : state.bounds.hi - target;
  const float tangent = std::tan(0.5f * view.camera.vertical_fov) / 1.05f;
  float distance = 0.5f * state.diagonal;
  for (int corner = 0; corner < 8; ++corner) {
    const vec3 d = half * vec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    const float across = std::max(std::abs(glm::dot(d, view.right)), std::abs(glm::dot(d, view.up)));
    distance = std::max(distance, across / tangent - glm::dot(d, view.forward));
  }
  view.position = target - distance * view.forward;
  view.camera.znear = 1e-3f * distance;
  return view;
}

}  // namespace lumigrove
