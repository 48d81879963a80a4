// The scene as kernels see it: spans and PODs, no ownership. `SceneArrays` owns what the view points to.
#pragma once

#include <span>
#include <vector>

#include "base/vec.h"
#include "lumigrove/scene.h"

namespace lumigrove {

struct ImageView {
  int width = 0, height = 0;
  bool srgb = false;
  const std::uint8_t* texels8 = nullptr;  // RGBA
  const float* texels32 = nullptr;        // RGBA
};

// Material without its strings.
struct MaterialView {
  vec3 base_color;
  float alpha, metallic, roughness;
  vec3 emission;
  float normal_scale, alpha_cutoff;
  bool masked, double_sided;
  bool textured;  // any of the four below has an image
  TextureUse base_color_texture, metallic_roughness_texture, normal_texture, emissive_texture;
};

// Optional arrays are null.
struct MeshView {
  const vec3* positions;
  const vec3* normals;
  const vec4* tangents;
  const vec2* uv0;
  const vec2* uv1;
  const vec4* colors;
  const uvec3* triangles;
  std::uint32_t triangle_count;
  int material;
};

struct InstanceView {
  mat4x3 to_world;
  mat3 normal_to_world;  // flip * cofactors: outward normals stay outward also under mirroring; not unit
                         // length
  float flip;  // -1 when to_world mirrors: the front is on the side of flip * cross(p1-p0, p2-p0), world
  int mesh;
};

struct SceneView {
  std::span<const MeshView> meshes;
  std::span<const InstanceView> instances;
  std::span<const MaterialView> materials;
  std::span<const ImageView> images;
  const float* srgb_to_linear;  // 256 entries
  float diagonal;               // D
};

// Meshes, materials and images of a scene as views; built once a scene.
struct SceneArrays {
  std::vector<MeshView> meshes;
  std::vector<MaterialView> materials;
  std::vector<ImageView> images;
  std::vector<InstanceView> instances;
  float diagonal = 1;

  explicit SceneArrays(const Scene& scene);
  void set_state(const SceneState& state);  // instances and diagonal of one moment
  SceneView view() const;
};

}  // namespace lumigrove
