#include "lights/light_set.h"

#include <algorithm>
#include <cmath>

#include "base/stopwatch.h"
#include "device/device.h"
#include "device/reduce.h"
#include "lights/emitter.h"
#include "scene/texture.h"

namespace lumigrove {
namespace {

// Largest channel of the texels that a triangle's lookups can touch: zero means that it really is black.
float max_texel_in_uv_bounds(const SceneView& scene, const TextureUse& use, vec2 lo, vec2 hi) {
  const ImageView& image = scene.images[static_cast<std::size_t>(use.image)];
  const auto axis = [](float a, float b, int n) {  // texels that bilinear lookups reach, at most one period
    const double first = std::floor(static_cast<double>(a) * n - 0.5);
    const double last = std::floor(static_cast<double>(b) * n - 0.5) + 1;
    if (!(last - first < n) || !(std::abs(first) < 1e8)) return std::pair<int, int>{0, n - 1};
    return std::pair<int, int>{static_cast<int>(first), static_cast<int>(last)};
  };
  const auto [x0, x1] = axis(lo.x, hi.x, image.width);
  const auto [y0, y1] = axis(lo.y, hi.y, image.height);
  float largest = 0;
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      const vec4 texel = fetch_texel(image, scene.srgb_to_linear, wrap_texel(x, image.width, use.wrap_u),
                                     wrap_texel(y, image.height, use.wrap_v));
      largest = std::max(largest, max_component(vec3(texel)));
    }
  return largest;
}

// Average of the emissive texture over triangle `t` on a barycentric grid about one texel wide. Zero only if
// no lookup on the triangle can be positive, so that dropping such triangles loses no light.
vec3 mean_emission(const SceneView& scene, const MeshView& mesh, const TextureUse& use, std::uint32_t t) {
  const uvec3 v = mesh.triangles[t];
  const vec2* uvs = use.uv_set == 0 ? mesh.uv0 : mesh.uv1;
  const vec2 a = uvs ? uvs[v.x] : vec2(0), b = uvs ? uvs[v.y] : vec2(0), c = uvs ? uvs[v.z] : vec2(0);
  const vec2 ta = transform_uv(use, a), tb = transform_uv(use, b), tc = transform_uv(use, c);
  const float largest =
      max_texel_in_uv_bounds(scene, use, glm::min(ta, glm::min(tb, tc)), glm::max(ta, glm::max(tb, tc)));
  if (!(largest > 0)) return vec3(0);

  const ImageView& image = scene.images[static_cast<std::size_t>(use.image)];
  const vec2 size(static_cast<float>(image.width), static_cast<float>(image.height));
  const float texels =
      std::max({glm::length((tb - ta) * size), glm::length((tc - tb) * size), glm::length((ta - tc) * size)});
  constexpr float kMaxGrid = 512;  // beyond it the average is an estimate; it only steers importance
  const int n = static_cast<int>(std::clamp(std::ceil(texels), 1.0f, kMaxGrid));
  glm::dvec3 sum(0);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n - i; ++j) {
      const float u = (static_cast<float>(i) + 1.0f / 3) / static_cast<float>(n);
      const float w = (static_cast<float>(j) + 1.0f / 3) / static_cast<float>(n);
      const vec2 uv = a * (1 - u - w) + b * u + c * w;
      sum += glm::dvec3(vec3(sample_texture(scene, use, uv, uv)));
    }
  const vec3 mean = vec3(sum / (0.5 * n * (n + 1)));
  return glm::max(mean, vec3(1e-4f * largest));
}

MeshEmission mesh_emission(const SceneView& scene, const MeshView& mesh) {
  MeshEmission result;
  const MaterialView& material = scene.materials[static_cast<std::size_t>(mesh.material)];
  if (!(max_component(material.emission) > 0) || mesh.triangle_count == 0) return result;
  result.emits = true;
  result.count = mesh.triangle_count;
  result.textured = material.emissive_texture.image >= 0;
  if (!result.textured) return result;

  std::vector<vec3> means(mesh.triangle_count);
  launch(
      static_cast<int>(mesh.triangle_count),
      [&](int t) {
        means[static_cast<std::size_t>(t)] =
            mean_emission(scene, mesh, material.emissive_texture, static_cast<std::uint32_t>(t));
      },
      16);
  result.ranks.assign(mesh.triangle_count, EmissiveInstance::kNoEmitters);
  for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
    if (!(max_component(means[t] * material.emission) > 0)) continue;
    result.ranks[t] = static_cast<std::uint32_t>(result.triangles.size());
    result.triangles.push_back(t);
    result.mean_texture.push_back(means[t]);
  }
  result.count = static_cast<std::uint32_t>(result.triangles.size());
  result.emits = result.count > 0;
  return result;
}

Emitter triangle_emitter(const MeshView& mesh, const InstanceView& instance, std::uint32_t index,
                         std::uint32_t t) {
  const uvec3 v = mesh.triangles[t];
  const vec3 p0 = transform_point(instance.to_world, mesh.positions[v.x]);
  const vec3 p1 = transform_point(instance.to_world, mesh.positions[v.y]);
  const vec3 p2 = transform_point(instance.to_world, mesh.positions[v.z]);
  // A mirrored instance turns the winding round; the emitting side stays the mesh's own outside.
  return instance.flip < 0 ? Emitter{p0, p2 - p0, p1 - p0, index} : Emitter{p0, p1 - p0, p2 - p0, index};
}

Emitter punctual_emitter(const LightInstance& light, std::uint32_t index) {
  if (light.light.type != LightType::kSpot)
    return {light.position, light.direction, vec3(0), Emitter::kPunctual | index};
  const float cos_outer = std::cos(light.light.outer_cone);
  const float cos_inner = std::cos(std::min(light.light.inner_cone, light.light.outer_cone));
  const float slope = 1.0f / std::max(1e-4f, cos_inner - cos_outer);
  return {light.position, light.direction, vec3(cos_outer, slope, 0), Emitter::kPunctual | index};
}

}  // namespace

LightSet::LightSet(const Scene& scene, const SceneArrays& arrays) : environment_(scene.environment) {
  const SceneView view = arrays.view();
  meshes_.reserve(view.meshes.size());
  for (const MeshView& mesh : view.meshes) meshes_.push_back(mesh_emission(view, mesh));
  build_environment(arrays);
}

// Distribution over the texels of the environment image, by luminance times the solid angle of the texel's
// row. A small uniform share keeps every direction possible, since lookups interpolate between texels.
void LightSet::build_environment(const SceneArrays& arrays) {
  if (environment_.image < 0) return;
  const SceneView scene = arrays.view();
  const ImageView& image = scene.images[static_cast<std::size_t>(environment_.image)];
  const int w = image.width, h = image.height;
  std::vector<double> rows(static_cast<std::size_t>(h));
  column_cdf_.resize(static_cast<std::size_t>(h) * static_cast<std::size_t>(w + 1));
  constexpr double kPiD = 3.14159265358979323846;
  double mean = 0;
  const auto texel = [&](int x, int y) {
    return static_cast<double>(luminance(vec3(fetch_texel(image, scene.srgb_to_linear, x, y))));
  };
  double average = 0;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) average += texel(x, y) / (static_cast<double>(w) * h);
  const double floor_value = std::max(1e-3 * average, 1e-12);
  for (int y = 0; y < h; ++y) {
    const double solid = std::cos(kPiD * y / h) - std::cos(kPiD * (y + 1) / h);
    double sum = 0;
    float* cdf = column_cdf_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(w + 1);
    std::vector<double> running(static_cast<std::size_t>(w + 1), 0);
    for (int x = 0; x < w; ++x) {
      // Bilinear lookups reach into neighbouring texels, so weigh a texel by the brightest of its 3x3
      // surroundings.
      double value = floor_value;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          value = std::max(value, texel((x + dx + w) % w, std::clamp(y + dy, 0, h - 1)));
      sum += value;
      running[static_cast<std::size_t>(x) + 1] = sum;
      mean += texel(x, y) * solid / (2.0 * w);
    }
    for (int x = 0; x <= w; ++x) cdf[x] = static_cast<float>(running[static_cast<std::size_t>(x)] / sum);
    rows[static_cast<std::size_t>(y)] = sum * solid;
  }
  double total = 0;
  for (const double r : rows) total += r;
  row_cdf_.assign(1, 0);
  double sum = 0;
  for (const double r : rows) row_cdf_.push_back(static_cast<float>((sum += r) / total));
  environment_mean_ = static_cast<float>(mean);
}

void LightSet::gather(const SceneArrays& arrays, const SceneState& state, const Settings& settings) {
  const Stopwatch watch;
  const SceneView scene = arrays.view();
  punctual_.clear();
  directional_.clear();
  instances_.assign(state.instances.size(), {});

  std::uint32_t count = 0, stable = 0;
  for (std::size_t i = 0; i < state.instances.size(); ++i) {
    const MeshView& mesh = scene.meshes[static_cast<std::size_t>(state.instances[i].mesh)];
    const MeshEmission& emission = meshes_[static_cast<std::size_t>(state.instances[i].mesh)];
    const MaterialView& material = scene.materials[static_cast<std::size_t>(mesh.material)];
    instances_[i].stable_base = stable;
    stable += mesh.triangle_count;
    if (!emission.emits || !(settings.light_scale > 0)) continue;
    instances_[i].radiance = material.emission * settings.light_scale;
    instances_[i].first = count;
    instances_[i].count = emission.count;
    instances_[i].textured = emission.textured;
    instances_[i].double_sided = material.double_sided;
    instances_[i].masked = material.masked;
    if (emission.textured) {
      instances_[i].triangles = emission.triangles.data();
      instances_[i].ranks = emission.ranks.data();
      instances_[i].mean_texture = emission.mean_texture.data();
    }
    count += emission.count;
  }

  std::vector<Emitter> local_lights;
  for (const LightInstance& light : state.lights) {
    const std::uint32_t id = stable++;
    const vec3 color = light.light.color * settings.light_scale;
    if (!(max_component(color) > 0)) continue;
    if (light.light.type == LightType::kDirectional) {
      directional_.push_back({light.direction, color});
      continue;
    }
    const float range = settings.ignore_range ? 0 : light.light.range;
    local_lights.push_back(punctual_emitter(light, static_cast<std::uint32_t>(punctual_.size())));
    punctual_.push_back({color, range, id, light.light.type == LightType::kSpot});
  }

  emitters_.resize(count + local_lights.size());
  std::copy(local_lights.begin(), local_lights.end(), emitters_.begin() + count);
  // Blocks of triangles rather than instances: one mesh may hold a million emitters, or one.
  for (std::size_t i = 0; i < instances_.size(); ++i) {
    const EmissiveInstance& instance = instances_[i];
    if (instance.first == EmissiveInstance::kNoEmitters) continue;
    const MeshView& mesh = scene.meshes[static_cast<std::size_t>(state.instances[i].mesh)];
    launch(
        static_cast<int>(instance.count),
        [&](int k) {
          const std::uint32_t t = instance.triangles ? instance.triangles[k] : static_cast<std::uint32_t>(k);
          emitters_[instance.first + static_cast<std::uint32_t>(k)] =
              triangle_emitter(mesh, scene.instances[i], static_cast<std::uint32_t>(i), t);
        },
        4096);
  }

  view_ = {};
  view_.emitters = emitters_;
  view_.instances = instances_;
  view_.punctual = punctual_;
  view_.directional = directional_;
  view_.diagonal = state.diagonal;
  view_.scene_disc = kPi * 0.25f * state.diagonal * state.diagonal;
  view_.environment.radiance = environment_.radiance * settings.light_scale;
  view_.environment.image = environment_.image;
  float mean = luminance(view_.environment.radiance);
  if (environment_.image >= 0) {
    const ImageView& image = scene.images[static_cast<std::size_t>(environment_.image)];
    view_.environment.width = image.width;
    view_.environment.height = image.height;
    view_.environment.row_cdf = row_cdf_.data();
    view_.environment.column_cdf = column_cdf_.data();
    mean *= environment_mean_;
  }
  view_.environment_flux = mean * kPi * view_.scene_disc;
  struct Sums {
    double flux = 0;
    Box3 bounds;
  };
  const Sums sums = reduce(
      static_cast<int>(emitters_.size()), Sums{},
      [&](int i) {
        const std::uint32_t e = static_cast<std::uint32_t>(i);
        return Sums{static_cast<double>(emitter_flux(view_, e)), emitter_bounds(emitters_[e])};
      },
      [](const Sums& a, const Sums& b) {
        return Sums{a.flux + b.flux, unite(a.bounds, b.bounds)};
      });
  view_.local_flux = static_cast<float>(sums.flux);
  view_.bounds = sums.bounds;
  gather_ms_ = watch.ms();
}

LightView LightSet::view() const { return view_; }

std::size_t LightSet::bytes() const {
  std::size_t bytes = emitters_.size() * sizeof(Emitter) + punctual_.size() * sizeof(PunctualView);
  for (const MeshEmission& mesh : meshes_)
    bytes += mesh.mean_texture.size() * sizeof(vec3) +
             (mesh.triangles.size() + mesh.ranks.size()) * sizeof(std::uint32_t);
  return bytes;
}

}  // namespace lumigrove
