// Kernels that build the two-level light tree: boxes of a mesh's triangles once, boxes of its instances every
// frame. The trees over both are perfect light trees. The method and its header block are in
// two_level_tree_kernel.h.
#pragma once

#include <span>

#include "methods/light_tree/light_tree_build_kernel.h"
#include "methods/light_tree/two_level_tree_kernel.h"

namespace lumigrove {

// What instances need to know of their mesh. Object space; intensities for radiance of luminance 1.
struct MeshSummary {
  Box3 box;
  vec3 cone_axis = vec3(0);
  float cone_radius = 2;
  float intensity = 0;          // of all triangles
  mat3 normals = mat3(0);       // mean of n n^T over unit normals n, by intensity
  float tolerance = 0;          // vertices may move by so much, m, before cones fail
  std::uint32_t triangles = 0;  // that are leaves
  std::uint32_t only = 0;       // number of the leaf if there is one
};

// boxes[k] of emissive triangle k, the mesh in its own space. Cones hold the normals that vertices moved by `tolerance`
// can give.
struct TriangleBoxKernel {
  MeshView mesh;
  EmissiveInstance emissive;  // any instance of the mesh
  float inverse_luminance;
  float tolerance;
  std::span<NodeChild> boxes;

  LUMI_HD void operator()(int i) const {
    const std::uint32_t t = emissive.triangles ? emissive.triangles[i] : static_cast<std::uint32_t>(i);
    const uvec3 v = mesh.triangles[t];
    const vec3 a = mesh.positions[v.x], b = mesh.positions[v.y], c = mesh.positions[v.z];
    const vec3 cross = glm::cross(b - a, c - a);
    const float twice_area = glm::length(cross);
    const vec3 radiance =
        emissive.mean_texture ? emissive.radiance * emissive.mean_texture[i] : emissive.radiance;
    NodeChild box;
    box.box = {glm::min(a, glm::min(b, c)), glm::max(a, glm::max(b, c))};
    box.intensity = finite_or_zero(luminance(radiance) * inverse_luminance * 0.5f * twice_area);
    if (!emissive.double_sided && twice_area > 1e-18f && is_finite(twice_area)) {
      const float longest2 =
          glm::max(length_squared(b - a), glm::max(length_squared(c - a), length_squared(c - b)));
      const float turn = 4 * tolerance * glm::sqrt(longest2) / twice_area;  // tolerance over the least height
      box.cone = pack_axis(cross / twice_area);
      box.cone.radius = pack_radius(turn + kPackedAxisError);
    }
    boxes[static_cast<std::size_t>(i)] = box;
  }
};

// |L| in the Frobenius norm.
LUMI_HD inline float norm(const mat3& m) {
  return glm::sqrt(length_squared(m[0]) + length_squared(m[1]) + length_squared(m[2]));
}

// Does the map turn, mirror and scale all directions alike?
LUMI_HD inline bool keeps_shapes(const mat3& m) {
  const float x = length_squared(m[0]), y = length_squared(m[1]), z = length_squared(m[2]);
  const float bend =
      glm::max(glm::max(glm::abs(glm::dot(m[0], m[1])), glm::abs(glm::dot(m[0], m[2]))),
               glm::max(glm::abs(glm::dot(m[1], m[2])), glm::max(glm::abs(x - y), glm::abs(x - z))));
  return bend < 1e-5f * x;
}

// Cone of the instance's normals: C n', C the cofactors of L with its sign of winding. For unit n' in the mesh's cone
// |C n' / |C n'| - C a / |C a|| <= 2 |C (n' - a)| / |C a|; where L keeps shapes, radii stay.
LUMI_HD inline PackedCone instance_cone(const MeshSummary& mesh, const mat3& linear, const mat3& cofactors) {
  if (!(mesh.cone_radius < 2)) return {};
  vec3 axis = cofactors * mesh.cone_axis;
  float radius = mesh.cone_radius;
  if (keeps_shapes(linear)) {
    axis /= glm::length(cofactors[0]);
    radius += 1e-4f;
  } else {
    const float length = glm::length(axis);
    if (!(length > 0)) return {};
    axis /= length;
    radius *= 2 * norm(cofactors) / length;
  }
  const float excess = glm::max(glm::length(axis) - 1, 0.0f);  // an axis from a node may be a little long
  PackedCone cone = pack_axis(axis / (1 + excess));
  cone.radius = pack_radius(radius + excess + kPackedAxisError);
  return cone.radius < 255 ? cone : PackedCone{};
}

// Leaf i of the top level: instance `sources[i]` of the scene, beyond these the point and spot lights.
struct TreeInstanceKernel {
  SceneView scene;
  LightView lights;
  const MeshSummary* meshes;
  std::span<const std::uint32_t> sources;
  std::uint32_t first_punctual;  // emitter
  float inverse_flux;            // of all local lights
  bool use_cones;
  std::span<TreeInstance> instances;
  std::span<MeshPlacement> placements;
  std::span<NodeChild> boxes;

  LUMI_HD void operator()(int i) const {
    const std::size_t number = static_cast<std::size_t>(i);
    if (number >= sources.size()) {
      const std::uint32_t e = first_punctual + static_cast<std::uint32_t>(number - sources.size());
      TreeInstance light;
      light.first = e;
      instances[number] = light;
      boxes[number] = emitter_child(lights, e, 1);
      return;
    }
    const InstanceView& shown = scene.instances[sources[number]];
    write_instance(number, shown, lights.instances[sources[number]], meshes[shown.mesh]);
  }

 private:
  LUMI_HD void write_instance(std::size_t number, const InstanceView& shown, const EmissiveInstance& emissive,
                              const MeshSummary& mesh) const {
    const mat3 linear(shown.to_world[0], shown.to_world[1], shown.to_world[2]);
    const vec3 centre = mesh.box.centre(), half = 0.5f * mesh.box.extent();
    // Sizes of the terms whose sums are the world's coordinates: a few roundings of them is how far vertices move.
    const mat3 sizes(glm::abs(linear[0]), glm::abs(linear[1]), glm::abs(linear[2]));
    const float term =
        max_component(sizes * (glm::abs(centre) + half)) + max_component(glm::abs(shown.to_world[3]));
    const float rounding = 4e-7f * term;

    TreeInstance instance;
    instance.origin = shown.to_world[3];
    instance.first = emissive.first + mesh.only;
    if (mesh.triangles > 1) instance.tree = static_cast<std::uint32_t>(shown.mesh);
    set_inverse(instance, linear, shown.normal_to_world * shown.flip, mesh, rounding);

    const vec3 reach = sizes * half + rounding;
    const vec3 middle = transform_point(shown.to_world, centre);
    NodeChild box;
    box.box = {middle - reach, middle + reach};
    box.intensity = finite_or_zero(luminance(emissive.radiance) * mesh.intensity *
                                   area_scale(shown.normal_to_world, mesh.normals));
    if (instance.cones) box.cone = instance_cone(mesh, linear, shown.normal_to_world);
    instances[number] = instance;
    boxes[number] = box;
    placements[number] = {linear, instance.origin, finite_or_zero(box.intensity * inverse_flux),
                          instance.cones && keeps_shapes(linear) ? 1 / glm::length(linear[0]) : 0.0f};
  }

  // Root of the mean square of |C n| over the mesh's normals: exact for one plane, and where L keeps shapes.
  LUMI_HD static float area_scale(const mat3& cofactors, const mat3& normals) {
    const mat3 product = cofactors * normals;
    return glm::sqrt(glm::max(glm::dot(product[0], cofactors[0]) + glm::dot(product[1], cofactors[1]) +
                                  glm::dot(product[2], cofactors[2]),
                              0.0f));
  }

  LUMI_HD void set_inverse(TreeInstance& instance, const mat3& linear, const mat3& cofactors,
                           const MeshSummary& mesh, float rounding) const {
    constexpr float kWorst = 1e4f, kWorstForCones = 50;  // condition numbers
    const float largest =
        glm::max(max_component(glm::abs(linear[0])),
                 glm::max(max_component(glm::abs(linear[1])), max_component(glm::abs(linear[2]))));
    const float determinant = glm::dot(linear[0], cofactors[0]);
    const mat3 inverse = glm::transpose(cofactors) * (1 / determinant);
    const float condition = norm(linear) * norm(inverse) * (1.0f / 3);
    const vec3 far = glm::max(glm::abs(mesh.box.lo), glm::abs(mesh.box.hi));
    if (!(condition < kWorst) || !is_finite(1 / largest)) {
      instance.slack = 1000 * max_component(far);
      return;
    }
    instance.to_mesh = inverse;
    instance.normal_to_mesh = glm::transpose(linear) * (1 / largest);
    instance.slack_per_length = 4e-7f * condition;
    instance.slack = rounding * norm(inverse) + instance.slack_per_length * (far.x + far.y + far.z);
    instance.cones = use_cones && condition < kWorstForCones && instance.slack <= mesh.tolerance;
  }
};

}  // namespace lumigrove
