#include "scene/scene_view.h"

#include <array>
#include <cmath>

namespace lumigrove {
namespace {

template <class T>
const T* data_or_null(const std::vector<T>& values) {
  return values.empty() ? nullptr : values.data();
}

MeshView make_view(const Mesh& mesh) {
  MeshView view;
  view.positions = data_or_null(mesh.positions);
  view.normals = data_or_null(mesh.normals);
  view.tangents = data_or_null(mesh.tangents);
  view.uv0 = data_or_null(mesh.uv0);
  view.uv1 = data_or_null(mesh.uv1);
  view.colors = data_or_null(mesh.colors);
  view.triangles = data_or_null(mesh.triangles);
  view.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
  view.material = mesh.material;
  return view;
}

MaterialView make_view(const Material& material) {
  MaterialView view;
  view.base_color = material.base_color;
  view.alpha = material.alpha;
  view.metallic = material.metallic;
  view.roughness = material.roughness;
  view.emission = material.emission;
  view.normal_scale = material.normal_scale;
  view.alpha_cutoff = material.alpha_cutoff;
  view.masked = material.alpha_mode == AlphaMode::kMask;
  view.double_sided = material.double_sided;
  view.base_color_texture = material.base_color_texture;
  view.metallic_roughness_texture = material.metallic_roughness_texture;
  view.normal_texture = material.normal_texture;
  view.emissive_texture = material.emissive_texture;
  view.textured = view.base_color_texture.image >= 0 || view.metallic_roughness_texture.image >= 0 ||
                  view.normal_texture.image >= 0 || view.emissive_texture.image >= 0;
  return view;
}

ImageView make_view(const Image8or32& image) {
  ImageView view;
  view.width = image.width;
  view.height = image.height;
  view.srgb = image.srgb;
  view.texels8 = data_or_null(image.texels8);
  view.texels32 = data_or_null(image.texels32);
  return view;
}

InstanceView make_view(const MeshInstance& instance) {
  InstanceView view;
  view.to_world = instance.to_world;
  const mat3 cofactors = normal_matrix(instance.to_world);
  view.flip = glm::dot(instance.to_world[0], cofactors[0]) < 0.0f ? -1.0f : 1.0f;
  view.normal_to_world = mat3(cofactors[0] * view.flip, cofactors[1] * view.flip, cofactors[2] * view.flip);
  view.mesh = instance.mesh;
  return view;
}

// IEC 61966-2-1 decoding of 8-bit values.
const float* srgb_to_linear_table() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double s = static_cast<double>(i) / 255.0;
      values[i] = static_cast<float>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
    }
    return values;
  }();
  return table.data();
}

}  // namespace

SceneArrays::SceneArrays(const Scene& scene) {
  meshes.reserve(scene.meshes.size());
  for (const Mesh& mesh : scene.meshes) meshes.push_back(make_view(mesh));
  materials.reserve(scene.materials.size());
  for (const Material& material : scene.materials) materials.push_back(make_view(material));
  images.reserve(scene.images.size());
  for (const Image8or32& image : scene.images) images.push_back(make_view(image));
}

void SceneArrays::set_state(const SceneState& state) {
  instances.clear();
  instances.reserve(state.instances.size());
  for (const MeshInstance& instance : state.instances) instances.push_back(make_view(instance));
  diagonal = state.diagonal;
}

SceneView SceneArrays::view() const {
  return {meshes, instances, materials, images, srgb_to_linear_table(), diagonal};
}

}  // namespace lumigrove
