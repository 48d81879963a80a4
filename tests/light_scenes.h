// Scenes of a few quads and lights, built by hand, and the renders and closed forms that tests compare them
// with.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/vec.h"
#include "lumigrove/image.h"
#include "lumigrove/renderer.h"
#include "lumigrove/scene.h"
#include "lumigrove/settings.h"
#include "statistics.h"

namespace lumigrove::testing {

class SceneBuilder {
 public:
  int material(vec3 base_color, vec3 emission = vec3(0), float metallic = 0, float roughness = 1) {
    Material m;
    m.base_color = base_color;
    m.emission = emission;
    m.metallic = metallic;
    m.roughness = roughness;
    scene.materials.push_back(m);
    return static_cast<int>(scene.materials.size()) - 1;
  }

  // A parallelogram whose front is on the side of cross(e1, e2), in nx * ny cells of two triangles; uv0 runs
  // along e1 and e2.
  void quad(vec3 corner, vec3 e1, vec3 e2, int material, int nx = 1, int ny = 1) {
    Mesh mesh;
    mesh.material = material;
    for (int y = 0; y <= ny; ++y) {
      for (int x = 0; x <= nx; ++x) {
        const vec2 uv(static_cast<float>(x) / static_cast<float>(nx),
                      static_cast<float>(y) / static_cast<float>(ny));
        mesh.positions.push_back(corner + e1 * uv.x + e2 * uv.y);
        mesh.uv0.push_back(uv);
      }
    }
    const auto row = static_cast<std::uint32_t>(nx + 1);
    for (std::uint32_t y = 0; y < static_cast<std::uint32_t>(ny); ++y) {
      for (std::uint32_t x = 0; x < static_cast<std::uint32_t>(nx); ++x) {
        const std::uint32_t i = y * row + x;
        mesh.triangles.push_back(uvec3(i, i + 1, i + row + 1));
        mesh.triangles.push_back(uvec3(i, i + row + 1, i + row));
      }
    }
    add(std::move(mesh));
  }

  void triangle(vec3 a, vec3 b, vec3 c, int material) {
    Mesh mesh;
    mesh.material = material;
    mesh.positions = {a, b, c};
    mesh.triangles = {uvec3(0, 1, 2)};
    add(std::move(mesh));
  }

  // The walls of an axis-aligned box, fronts inside.
  void room(vec3 lo, vec3 hi, int material) {
    const vec3 x(hi.x - lo.x, 0, 0), y(0, hi.y - lo.y, 0), z(0, 0, hi.z - lo.z);
    quad(lo, z, x, material);      // floor, +y
    quad(lo + y, x, z, material);  // ceiling, -y
    quad(lo, x, y, material);      // back, +z
    quad(lo + z, y, x, material);  // front, -z
    quad(lo, y, z, material);      // left, +x
    quad(lo + x, z, y, material);  // right, -x
  }

  void punctual(PunctualLight light, vec3 position, vec3 direction) {
    Node node;
    node.light = static_cast<int>(scene.lights.size());
    node.translation = position;
    // Shortest rotation from -Z.
    const vec3 from(0, 0, -1), to = glm::normalize(direction);
    const vec4 q(glm::cross(from, to), 1 + glm::dot(from, to));
    node.rotation = glm::length(q) > 1e-6f ? q / glm::length(q) : vec4(1, 0, 0, 0);
    scene.lights.push_back(std::move(light));
    scene.nodes.push_back(std::move(node));
  }

  Scene scene;

 private:
  void add(Mesh mesh) {
    Node node;
    node.meshes = {static_cast<int>(scene.meshes.size())};
    scene.meshes.push_back(std::move(mesh));
    scene.nodes.push_back(std::move(node));
  }
};

// A small square picture; centre of the pixels, Lambert surfaces.
inline Settings square_view(const std::string& preset, int size, vec3 eye, vec3 target,
                            float fov_degrees = 60) {
  Settings settings = make_preset(preset);
  settings.width = settings.height = size;
  settings.view = ViewSettings{eye, target, vec3(0, 1, 0)};
  settings.fov = fov_degrees;
  settings.jitter = false;
  settings.force_diffuse = true;
  return settings;
}

// Where the centre ray of a pixel meets the plane y = 0.
inline vec3 point_on_floor(const Settings& settings, int x, int y) {
  const ViewSettings& view = *settings.view;
  const vec3 forward = glm::normalize(view.look_at - view.position);
  const vec3 right = glm::normalize(glm::cross(forward, view.up)), up = glm::cross(right, forward);
  const float size = 2 * std::tan(0.5f * *settings.fov * kPi / 180) / static_cast<float>(settings.height);
  const vec3 d = forward +
                 right * ((static_cast<float>(x) + 0.5f - 0.5f * static_cast<float>(settings.width)) * size) -
                 up * ((static_cast<float>(y) + 0.5f - 0.5f * static_cast<float>(settings.height)) * size);
  return view.position - d * (view.position.y / d.y);
}

// A pixel of a layer with three or more channels, numbered row by row from the top.
inline vec3 pixel(const Image& image, const std::string& layer, int number) {
  const Layer* found = image.find(layer);
  if (!found) throw Error("the image has no layer '" + layer + "'");
  const float* v = found->values.data() + static_cast<std::size_t>(number) * found->channels.size();
  return vec3(v[0], v[1], v[2]);
}

// Mean over all pixels of one channel of a layer, and its standard error by the variance layer (of the
// total).
struct ImageMean {
  double mean = 0, standard_error = 0;
};
inline ImageMean image_mean(const Image& image, const std::string& layer, int channel = 1) {
  ImageMean result;
  const int count = image.width * image.height;
  double variance = 0;
  for (int i = 0; i < count; ++i) {
    result.mean += static_cast<double>(pixel(image, layer, i)[channel]) / count;
    if (image.find("variance")) variance += static_cast<double>(pixel(image, "variance", i)[channel]);
  }
  result.standard_error = std::sqrt(variance) / count;
  return result;
}

// Irradiance at `x` with normal `n` from a polygon of constant radiance 1 that lies wholly above x's horizon:
// Lambert's formula, the sum over edges of the angle they subtend times the cosine of their plane's normal
// with n.
template <std::size_t N>
double polygon_irradiance(vec3 x, vec3 n, const std::array<vec3, N>& vertices) {
  double sum = 0;
  for (std::size_t i = 0; i < N; ++i) {
    const glm::dvec3 a = glm::normalize(glm::dvec3(vertices[i] - x));
    const glm::dvec3 b = glm::normalize(glm::dvec3(vertices[(i + 1) % N] - x));
    const glm::dvec3 c = glm::cross(a, b);
    sum += std::acos(std::clamp(glm::dot(a, b), -1.0, 1.0)) * glm::dot(glm::normalize(c), glm::dvec3(n));
  }
  return std::abs(0.5 * sum);
}

}  // namespace lumigrove::testing
