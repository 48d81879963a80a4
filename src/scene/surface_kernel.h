// From a hit to a point ready to be lit: interpolates the triangle's vertices and looks the material up.
//
// Conventions
//   front        the side of flip * cross(p1-p0, p2-p0) in world space; emission leaves there (both sides
//   when the
//                material is double-sided)
//   normals      geometric and shading normal are flipped to the viewer's side; a shading normal that still
//   points
//                away from the viewer is bent towards the geometric one until it does not
//   position     from the vertices, not from origin + t*direction: its error does not grow with the distance
//   epsilon      kSelfIntersection * the largest coordinate of the triangle in world space. Both roundings
//   that make
//                a ray hit the surface it leaves (of the point on the triangle, of Embree's distance to the
//                triangle's plane) are relative to that, and so is the offset: scaling the scene changes no
//                pixel
#pragma once

#include "base/lanes.h"
#include "scene/interpolate.h"
#include "scene/scene_view.h"
#include "scene/surface.h"
#include "trace/ray.h"

namespace lumigrove {

// 64 roundings of float: tests meet no self-intersection even at a sixteenth of it. 4 mm at 1 km from the
// origin.
inline constexpr float kSelfIntersection = 0x1p-18f;

inline constexpr float kMinRoughness = 0.08f;
inline constexpr float kDielectricF0 = 0.04f;
// The least cosine between shading normal and viewer.
inline constexpr float kMinViewCosine = 0.01f;

LUMI_HD inline vec3 normalize_or(vec3 v, vec3 fallback) {
  const float squared = length_squared(v);
  return squared > 0.0f && is_finite(squared) ? v * (1.0f / glm::sqrt(squared)) : fallback;
}

// Three vertices in world space, as origin and edges.
struct WorldTriangle {
  vec3 p0, e1, e2;
};

LUMI_HD inline WorldTriangle world_triangle(const MeshView& mesh, const InstanceView& instance,
                                            uvec3 triangle) {
  const vec3 p0 = mesh.positions[triangle.x];
  return {transform_point(instance.to_world, p0),
          transform_vector(instance.to_world, mesh.positions[triangle.y] - p0),
          transform_vector(instance.to_world, mesh.positions[triangle.z] - p0)};
}

// See `epsilon` above.
LUMI_HD inline float self_intersection_offset(const WorldTriangle& t) {
  const vec3 largest = glm::max(glm::abs(t.p0), glm::max(glm::abs(t.p0 + t.e1), glm::abs(t.p0 + t.e2)));
  return kSelfIntersection * max_component(largest);
}

// Tangent (xyz) and handedness (w) of texture space, from the change of (u, v) over the triangle: the
// bitangent cross(n, t) * w points against growing v, as glTF's tangents do. Zero when the texture
// coordinates are degenerate.
LUMI_HD inline vec4 tangent_from_uv(const WorldTriangle& t, vec3 n, vec2 a, vec2 b, vec2 c) {
  const vec2 d1 = b - a, d2 = c - a;
  const float determinant = d1.x * d2.y - d2.x * d1.y;
  if (!(glm::abs(determinant) > 0.0f)) return vec4(0);
  const float sign = determinant > 0.0f ? 1.0f : -1.0f;
  const vec3 du = (t.e1 * d2.y - t.e2 * d1.y) * sign, dv = (t.e2 * d1.x - t.e1 * d2.x) * sign;
  return vec4(du, glm::dot(glm::cross(n, du), dv) > 0.0f ? -1.0f : 1.0f);
}

LUMI_HD inline vec3 apply_normal_map(const SceneView& scene, const MeshView& mesh,
                                     const InstanceView& instance, const MaterialView& material,
                                     uvec3 triangle, const WorldTriangle& world, const Hit& hit,
                                     const TexturePoint& at, vec3 n) {
  vec4 tangent(0);
  if (mesh.tangents) {
    const vec4 object = interpolate(mesh.tangents, triangle, hit.u, hit.v);
    tangent = vec4(transform_vector(instance.to_world, vec3(object)), object.w < 0.0f ? -1.0f : 1.0f);
    tangent.w *= instance.flip;
  } else if (const vec2* uv = material.normal_texture.uv_set == 0 ? mesh.uv0 : mesh.uv1) {
    tangent = tangent_from_uv(world, n, uv[triangle.x], uv[triangle.y], uv[triangle.z]);
  }
  const vec3 along = normalize_or(vec3(tangent) - n * glm::dot(n, vec3(tangent)), vec3(0));
  if (along == vec3(0)) return n;
  const vec4 texel = sample_texture(scene, material.normal_texture, at.uv0, at.uv1);
  const vec2 slope = (vec2(texel.x, texel.y) * 2.0f - 1.0f) * material.normal_scale;
  const vec3 bitangent = glm::cross(n, along) * tangent.w;
  return normalize_or(along * slope.x + bitangent * slope.y + n * (texel.z * 2.0f - 1.0f), n);
}

// Bends `n` towards `geometric` (both unit, on one side; the latter faces wo) until it makes at least the
// smaller of kMinViewCosine and geometric's own cosine with wo.
LUMI_HD inline vec3 face_viewer(vec3 n, vec3 geometric, vec3 wo) {
  const float have = glm::dot(n, wo), most = glm::dot(geometric, wo);
  const float want = glm::min(kMinViewCosine, most);
  if (have >= want) return n;
  return normalize_or(glm::mix(n, geometric, (want - have) / (most - have)), geometric);
}

// Writes straight into `s`: a kernel's output is 144 bytes that need not be put together elsewhere first.
LUMI_HD inline void write_surface(const SceneView& scene, const Ray& ray, const Hit& hit, bool force_diffuse,
                                  Surface& s) {
  const float squared = length_squared(ray.direction);
  const float inverse = squared > 0.0f ? 1.0f / glm::sqrt(squared) : 0.0f;
  s.wo = ray.direction * -inverse;
  s.emitter = kNoId;
  s.emission = vec3(0);
  s.pad = 0;
  if (hit.instance == kNoId) {
    s.position = s.diffuse = s.specular = vec3(0);
    s.geometric_normal = s.normal = s.wo;
    s.t = s.epsilon = 0;
    s.roughness = 1;
    s.instance = kNoId;
    s.triangle = 0;
    return;
  }

  const InstanceView& instance = scene.instances[hit.instance];
  const MeshView& mesh = scene.meshes[static_cast<std::size_t>(instance.mesh)];
  const MaterialView& material = scene.materials[static_cast<std::size_t>(mesh.material)];
  const uvec3 triangle = mesh.triangles[hit.triangle];
  const WorldTriangle world = world_triangle(mesh, instance, triangle);
  s.instance = hit.instance;
  s.triangle = hit.triangle;
  s.t = hit.t * squared * inverse;
  s.position = world.p0 + world.e1 * hit.u + world.e2 * hit.v;
  s.epsilon = self_intersection_offset(world);

  const vec3 front = normalize_or(glm::cross(world.e1, world.e2) * instance.flip, s.wo);
  const bool front_seen = glm::dot(front, s.wo) >= 0.0f;
  s.geometric_normal = front_seen ? front : -front;
  TexturePoint at;
  if (material.textured) at = texture_point(mesh, triangle, hit.u, hit.v);
  vec3 n = front;
  if (mesh.normals) {
    n = normalize_or(instance.normal_to_world * interpolate(mesh.normals, triangle, hit.u, hit.v), front);
  }
  if (material.normal_texture.image >= 0) {
    n = apply_normal_map(scene, mesh, instance, material, triangle, world, hit, at, n);
  }
  if (glm::dot(n, s.geometric_normal) < 0.0f) n = -n;
  s.normal = face_viewer(n, s.geometric_normal, s.wo);

  const vec3 base = vec3(base_color_at(scene, mesh, material, triangle, hit.u, hit.v, at));
  float metallic = material.metallic, roughness = material.roughness;
  if (material.metallic_roughness_texture.image >= 0) {
    const vec4 texel = sample_texture(scene, material.metallic_roughness_texture, at.uv0, at.uv1);
    roughness *= texel.y;
    metallic *= texel.z;
  }
  s.roughness = glm::clamp(roughness, kMinRoughness, 1.0f);
  s.diffuse = force_diffuse ? base : base * (1.0f - metallic);
  s.specular = force_diffuse ? vec3(0) : glm::mix(vec3(kDielectricF0), base, metallic);
  if (front_seen || material.double_sided) {
    s.emission = material.emission;
    if (material.emissive_texture.image >= 0) {
      s.emission *= vec3(sample_texture(scene, material.emissive_texture, at.uv0, at.uv1));
    }
  }
}

LUMI_HD inline Surface make_surface(const SceneView& scene, const Ray& ray, const Hit& hit,
                                    bool force_diffuse) {
  Surface s;
  write_surface(scene, ray, hit, force_diffuse, s);
  return s;
}

// Hits of incoherent rays lie anywhere in memory: fetches early what make_surface will read of those that follow. The
// vertices are known only from the triangle, so they follow half as far ahead.
LUMI_HD LUMI_ALWAYS_INLINE void prefetch_surfaces(const SceneView& scene, std::span<const Hit> hits, std::size_t i) {
  constexpr std::size_t kAhead = 4;
  if (i + 2 * kAhead >= hits.size()) return;
  const auto mesh_of = [&](const Hit& hit) -> const MeshView& {
    return scene.meshes[static_cast<std::size_t>(scene.instances[hit.instance].mesh)];
  };
  if (const Hit& far = hits[i + 2 * kAhead]; far.instance != kNoId) prefetch(&mesh_of(far).triangles[far.triangle]);
  const Hit& near = hits[i + kAhead];
  if (near.instance == kNoId) return;
  const MeshView& mesh = mesh_of(near);
  const uvec3 triangle = mesh.triangles[near.triangle];
  for (int k = 0; k < 3; ++k) {
    prefetch(&mesh.positions[triangle[k]]);
    if (mesh.normals) prefetch(&mesh.normals[triangle[k]]);
    if (mesh.uv0) prefetch(&mesh.uv0[triangle[k]]);
  }
}

// One surface a hit. `Surface::emitter` is left for whoever knows the light set.
struct SurfaceKernel {
  SceneView scene;
  std::span<const Ray> rays;
  std::span<const Hit> hits;
  std::span<Surface> surfaces;
  bool force_diffuse = false;

  LUMI_HD void operator()(int i) const {
    const auto at = static_cast<std::size_t>(i);
    write_surface(scene, rays[at], hits[at], force_diffuse, surfaces[at]);
  }
};

}  // namespace lumigrove
