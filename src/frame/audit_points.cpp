#include "frame/audit_points.h"

#include <algorithm>

#include "base/sampling.h"
#include "scene/interpolate.h"
#include "scene/surface_kernel.h"

namespace lumigrove {
namespace {

// Rays that may miss, and points that may fall into holes, for each point wanted.
constexpr int kTries = 4;

vec4 numbers(const Settings& settings, std::uint32_t i, std::uint32_t use) {
  return Rng{settings.seed, 0xa0d17u, i}.uniform4(4 * use);
}

void add_seen(const World& world, const Settings& settings, int count, std::vector<AuditPoint>& points) {
  const CameraView camera = make_camera_view(world.camera, settings.width, settings.height);
  const vec2 size(static_cast<float>(settings.width), static_cast<float>(settings.height));
  const auto tries = static_cast<std::size_t>(kTries * count);
  std::vector<Ray> rays(tries);
  std::vector<Hit> hits(tries);
  for (std::uint32_t i = 0; i < tries; ++i) rays[i] = camera_ray(camera, vec2(numbers(settings, i, 0)) * size);
  world.geometry->tracer.closest(rays, hits, Coherence::kIncoherent);
  for (std::size_t i = 0; i < tries && static_cast<int>(points.size()) < count; ++i)
    if (hits[i].instance != kNoId)
      points.push_back({make_surface(world.geometry->arrays.view(), rays[i], hits[i], settings.force_diffuse), true});
}

double triangle_area_of(const MeshView& mesh, const InstanceView& instance, std::uint32_t triangle) {
  const WorldTriangle t = world_triangle(mesh, instance, mesh.triangles[triangle]);
  return 0.5 * static_cast<double>(finite_or_zero(glm::length(glm::cross(t.e1, t.e2))));
}

class Surfaces {
 public:
  explicit Surfaces(const SceneView& scene) : scene_(scene) {
    for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
      const MeshView& mesh = mesh_of(i);
      double area = 0;
      for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) area += triangle_area_of(mesh, scene.instances[i], t);
      if (!(area > 0)) continue;
      instances_.push_back(i);
      sums_.push_back((sums_.empty() ? 0 : sums_.back()) + area);
    }
  }
  bool empty() const { return instances_.empty(); }

  // False in the hole of a mask.
  bool point(const Settings& settings, std::uint32_t i, AuditPoint& result) const {
    const vec4 u = numbers(settings, i, 1), w = numbers(settings, i, 2);
    const std::size_t k = i % 2 == 0 ? by_area(static_cast<double>(u.x)) : evenly(u.x);
    const std::uint32_t number = instances_[k];
    const InstanceView& instance = scene_.instances[number];
    const MeshView& mesh = mesh_of(number);
    double rest = static_cast<double>(u.y) * (sums_[k] - (k > 0 ? sums_[k - 1] : 0));
    std::uint32_t triangle = 0;
    for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
      const double area = triangle_area_of(mesh, instance, t);
      if (area > 0) triangle = t;
      if (rest < area) break;
      rest -= area;
    }
    const vec2 b = sample_uniform_triangle(vec2(u.z, u.w));
    if (is_cut_out(scene_, mesh, triangle, b.x, b.y)) return false;
    const WorldTriangle t = world_triangle(mesh, instance, mesh.triangles[triangle]);
    const vec3 front = normalize_or(glm::cross(t.e1, t.e2) * instance.flip, vec3(0, 0, 1));
    const vec3 viewer = make_frame(w.z < 0.5f ? front : -front).to_world(sample_cosine_hemisphere(vec2(w)));
    const Ray ray{t.p0 + t.e1 * b.x + t.e2 * b.y + viewer, 0, -viewer, kInfinity};
    result = {make_surface(scene_, ray, {number, triangle, b.x, b.y, 1}, settings.force_diffuse), false};
    return true;
  }

 private:
  const MeshView& mesh_of(std::uint32_t i) const {
    return scene_.meshes[static_cast<std::size_t>(scene_.instances[i].mesh)];
  }
  std::size_t by_area(double u) const {
    const auto found = std::upper_bound(sums_.begin(), sums_.end(), u * sums_.back());
    return std::min(static_cast<std::size_t>(found - sums_.begin()), sums_.size() - 1);
  }
  std::size_t evenly(float u) const {
    const auto n = static_cast<double>(instances_.size());
    return std::min(static_cast<std::size_t>(static_cast<double>(u) * n), instances_.size() - 1);
  }

  SceneView scene_;
  std::vector<std::uint32_t> instances_;  // of any area
  std::vector<double> sums_;              // of their areas
};

}  // namespace

std::vector<AuditPoint> make_audit_points(const World& world, const Settings& settings, int count) {
  std::vector<AuditPoint> points;
  const Surfaces surfaces(world.geometry->arrays.view());
  if (surfaces.empty()) return points;
  add_seen(world, settings, count - count / 2, points);
  const auto tries = static_cast<std::uint32_t>(kTries * count);
  AuditPoint point;
  for (std::uint32_t i = 0; i < tries && static_cast<int>(points.size()) < count; ++i)
    if (surfaces.point(settings, i, point)) points.push_back(point);
  return points;
}

}  // namespace lumigrove
