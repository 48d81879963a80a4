// Vertex attributes at a point of a triangle, given by barycentric (u, v): p = (1-u-v) p0 + u p1 + v p2.
#pragma once

#include "scene/scene_view.h"
#include "scene/texture.h"

namespace lumigrove {

template <class T>
LUMI_HD inline T interpolate(const T* values, uvec3 triangle, float u, float v) {
  return values[triangle.x] * (1 - u - v) + values[triangle.y] * u + values[triangle.z] * v;
}

struct TexturePoint {
  vec2 uv0 = vec2(0), uv1 = vec2(0);
};

LUMI_HD inline TexturePoint texture_point(const MeshView& mesh, uvec3 triangle, float u, float v) {
  TexturePoint point;
  if (mesh.uv0) point.uv0 = interpolate(mesh.uv0, triangle, u, v);
  if (mesh.uv1) point.uv1 = interpolate(mesh.uv1, triangle, u, v);
  return point;
}

// Base colour and alpha: factor x texture x vertex colour.
LUMI_HD inline vec4 base_color_at(const SceneView& scene, const MeshView& mesh, const MaterialView& material,
                                  uvec3 triangle, float u, float v, const TexturePoint& at) {
  vec4 color(material.base_color, material.alpha);
  if (material.base_color_texture.image >= 0) {
    color *= sample_texture(scene, material.base_color_texture, at.uv0, at.uv1);
  }
  if (mesh.colors) color *= interpolate(mesh.colors, triangle, u, v);
  return color;
}

// Does an alpha mask leave a hole here?
LUMI_HD inline bool is_cut_out(const SceneView& scene, const MeshView& mesh, std::uint32_t triangle_index,
                               float u, float v) {
  const MaterialView& material = scene.materials[static_cast<std::size_t>(mesh.material)];
  if (!material.masked) return false;
  const uvec3 triangle = mesh.triangles[triangle_index];
  const TexturePoint at = texture_point(mesh, triangle, u, v);
  return base_color_at(scene, mesh, material, triangle, u, v, at).w < material.alpha_cutoff;
}

}  // namespace lumigrove
