// One emitter of the light set: flux, bounds, a point on it, and the light that arrives from that point.
//
// Point and spot lights follow KHR_lights_punctual: smooth cone edge squared, window 1 - (d/range)^4 over the
// inverse square. Triangles are sampled uniformly by area. Of virtual point lights, cosine over squared distance is clamped.
#pragma once

#include "base/lanes.h"
#include "base/vec.h"
#include "lights/light_set.h"
#include "scene/interpolate.h"

namespace lumigrove {

LUMI_HD inline float triangle_area(const Emitter& e) { return 0.5f * glm::length(glm::cross(e.e1, e.e2)); }

LUMI_HD inline vec3 mean_radiance(const LightView& lights, const Emitter& e, std::uint32_t index) {
  const EmissiveInstance& instance = lights.instances[e.source];
  return instance.mean_texture ? instance.radiance * instance.mean_texture[index - instance.first]
                               : instance.radiance;
}

// Non-finite or negative values (a degenerate triangle, an absurd transform) count as no light.
LUMI_HD inline float finite_or_zero(float x) { return x > 0 && x < 3e38f ? x : 0.0f; }

// Largest radiant intensity in any direction, Y, W/sr: L*A of a triangle, I of any other light. This is
// ||I|| of the light trees, which bound direction and distance separately.
LUMI_HD inline float emitter_intensity(const LightView& lights, std::uint32_t index) {
  const Emitter& e = lights.emitters[index];
  if (e.punctual()) return finite_or_zero(luminance(lights.punctual[e.index()].intensity));
  if (e.vpl()) return finite_or_zero(luminance(e.e2));
  return finite_or_zero(luminance(mean_radiance(lights, e, index)) * triangle_area(e));
}

// Total power, Y, W.
LUMI_HD inline float emitter_flux(const LightView& lights, std::uint32_t index) {
  const Emitter& e = lights.emitters[index];
  const float intensity = emitter_intensity(lights, index);
  if (e.triangle()) return intensity * kPi * (lights.instances[e.source].double_sided ? 2.0f : 1.0f);
  if (e.vpl()) return intensity * kPi;
  if (!lights.punctual[e.index()].spot) return intensity * 4 * kPi;
  // Integral of the squared linear ramp in cos over the cone; in the thinnest cones it does not rise to 1.
  const float cone = glm::max(0.0f, 1 - e.e2.x), ramp = glm::min(1 / e.e2.y, cone), top = ramp * e.e2.y;
  return intensity * 2 * kPi * (cone - ramp + ramp * top * top / 3);
}

// Lights that shine: emitters, then directional lights, then the environment, numbered in this order.
LUMI_HD inline std::uint32_t light_count(const LightView& lights) {
  return static_cast<std::uint32_t>(lights.emitters.size() + lights.directional.size()) +
         (lights.environment.present() ? 1u : 0u);
}

LUMI_HD inline Box3 emitter_bounds(const Emitter& e) {
  if (!e.triangle()) return {e.p0, e.p0};
  const vec3 p1 = e.p0 + e.e1, p2 = e.p0 + e.e2;
  return {glm::min(e.p0, glm::min(p1, p2)), glm::max(e.p0, glm::max(p1, p2))};
}

// Directions n' with |n' - axis| <= radius; radius 2 holds all directions.
struct NormalCone {
  vec3 axis;
  float radius;
};

// Light leaves an emitter only towards the side of these normals: a point x is lit only if n' (x - y) > 0 for one of
// them and a point y of the emitter.
LUMI_HD inline NormalCone emission_cone(const LightView& lights, const Emitter& e) {
  constexpr NormalCone kAll{vec3(0), 2};
  if (e.punctual()) {
    const bool forwards = lights.punctual[e.index()].spot && e.e2.x >= 0;
    return forwards ? NormalCone{e.e1, 0} : kAll;
  }
  if (e.vpl()) return {e.e1, 0};
  if (lights.instances[e.source].double_sided) return kAll;
  const vec3 n = glm::cross(e.e1, e.e2);
  const float squared = length_squared(n);
  return squared > 1e-37f && is_finite(squared) ? NormalCone{n * (1 / glm::sqrt(squared)), 0} : kAll;
}

// Index of the emitter that a hit triangle is, EmissiveInstance::kNoEmitters if none.
LUMI_HD inline std::uint32_t emitter_of_triangle(const LightView& lights, std::uint32_t instance,
                                                 std::uint32_t triangle) {
  const EmissiveInstance& e = lights.instances[instance];
  if (e.first == EmissiveInstance::kNoEmitters) return EmissiveInstance::kNoEmitters;
  const std::uint32_t rank = e.ranks ? e.ranks[triangle] : triangle;
  return rank == EmissiveInstance::kNoEmitters ? rank : e.first + rank;
}

// Identity of an emitter that lasts while the scene's structure lasts, also when other lights come and go. Virtual point
// lights have none.
LUMI_HD inline std::uint32_t stable_id(const LightView& lights, std::uint32_t index) {
  const Emitter& e = lights.emitters[index];
  if (e.punctual()) return lights.punctual[e.index()].stable_id;
  if (e.vpl()) return EmissiveInstance::kNoEmitters;
  const EmissiveInstance& instance = lights.instances[e.source];
  const std::uint32_t rank = index - instance.first;
  return instance.stable_base + (instance.triangles ? instance.triangles[rank] : rank);
}

// A point on an emitter and what arrives from it at a place `x`, nothing in between.
struct EmitterPoint {
  vec3 position = vec3(0);
  vec3 wi = vec3(0);  // unit, from x to position
  float distance = 0;
  vec3 incident = vec3(0);  // triangles: radiance; others: irradiance at normal incidence
  float area_to_solid =
      0;  // d^2 / cos at the light: converts a pdf per area to one per solid angle; 0 for a delta
  vec3 clear = vec3(0);  // virtual point lights: position, lifted off the surface that they are on
};

// KHR_lights_punctual: what is left of a light at squared distance d2. Range 0 is unlimited.
LUMI_HD inline float range_window(float d2, float range) {
  if (!(range > 0)) return 1;
  const float ratio2 = d2 / (range * range);
  return glm::clamp(1 - ratio2 * ratio2, 0.0f, 1.0f);
}

// Likewise, of a spot light in a direction at this cosine to its axis.
LUMI_HD inline float spot_profile(const Emitter& e, float cos_axis) {
  const float ramp = glm::clamp((cos_axis - e.e2.x) * e.e2.y, 0.0f, 1.0f);
  return ramp * ramp;
}

// The place of a light without area, as seen from x; distance 0 at the very same place.
LUMI_HD inline EmitterPoint point_seen_from(vec3 position, vec3 x) {
  EmitterPoint p;
  const vec3 to_light = position - x;
  const float d2 = length_squared(to_light);
  if (!(d2 > 0)) return p;
  p.position = position;
  p.distance = glm::sqrt(d2);
  p.wi = to_light / p.distance;
  return p;
}

LUMI_HD inline EmitterPoint punctual_point(const LightView& lights, const Emitter& e, vec3 x) {
  const PunctualView& light = lights.punctual[e.index()];
  EmitterPoint p = point_seen_from(e.p0, x);
  if (!(p.distance > 0)) return p;
  const float d2 = length_squared(e.p0 - x);
  float attenuation = range_window(d2, light.range) / d2;
  if (light.spot) attenuation *= spot_profile(e, -glm::dot(p.wi, e.e1));
  p.incident = light.intensity * attenuation;
  return p;
}

LUMI_HD inline EmitterPoint vpl_point(const LightView& lights, const Emitter& e, vec3 x) {
  EmitterPoint p = point_seen_from(e.p0, x);
  const float cos_light = -glm::dot(p.wi, e.e1);
  if (!(cos_light > 0)) return p;
  p.incident = e.e2 * glm::min(cos_light / length_squared(e.p0 - x), lights.vpl_clamp);
  p.clear = e.p0 + e.e1 * lights.vpls[e.index()].epsilon;
  return p;
}

// A point of a triangle emitter as its mesh counts vertices: p0 + u (p1 - p0) + v (p2 - p0).
struct MeshPoint {
  int mesh;
  std::uint32_t triangle;
  float u, v;
};
LUMI_HD inline MeshPoint mesh_point(const SceneView& scene, const EmissiveInstance& emissive,
                                    const Emitter& e, std::uint32_t index, float b1, float b2) {
  const InstanceView& instance = scene.instances[e.source];
  const std::uint32_t rank = index - emissive.first;
  const std::uint32_t triangle = emissive.triangles ? emissive.triangles[rank] : rank;
  const bool swapped = instance.flip < 0;  // e1 and e2 changed places in a mirrored instance
  return {instance.mesh, triangle, swapped ? b2 : b1, swapped ? b1 : b2};
}

LUMI_HD inline vec3 emissive_texture_at(const SceneView& scene, const MeshPoint& point) {
  const MeshView& mesh = scene.meshes[static_cast<std::size_t>(point.mesh)];
  const MaterialView& material = scene.materials[static_cast<std::size_t>(mesh.material)];
  const TexturePoint at = texture_point(mesh, mesh.triangles[point.triangle], point.u, point.v);
  return vec3(sample_texture(scene, material.emissive_texture, at.uv0, at.uv1));
}

// Is the point in a hole of an alpha mask? A ray passes there, so no light may leave.
LUMI_HD inline bool is_cut_out(const SceneView& scene, const MeshPoint& point) {
  const MeshView& mesh = scene.meshes[static_cast<std::size_t>(point.mesh)];
  return is_cut_out(scene, mesh, point.triangle, point.u, point.v);
}

// Radiance that a triangle emits at a point of it.
LUMI_HD LUMI_ALWAYS_INLINE vec3 radiance_at(const SceneView& scene, const EmissiveInstance& instance, const Emitter& e,
                                            std::uint32_t index, float b1, float b2) {
  if (!instance.textured && !instance.masked) return instance.radiance;
  const MeshPoint point = mesh_point(scene, instance, e, index, b1, b2);
  if (instance.masked && is_cut_out(scene, point)) return vec3(0);
  return instance.textured ? instance.radiance * emissive_texture_at(scene, point) : instance.radiance;
}

LUMI_HD LUMI_ALWAYS_INLINE EmitterPoint triangle_point(const SceneView& scene, const LightView& lights, const Emitter& e,
                                           std::uint32_t index, vec3 x, vec2 u) {
  EmitterPoint p;
  const float root = glm::sqrt(u.x);  // uniform by area
  const float b1 = 1 - root, b2 = u.y * root;
  p.position = e.p0 + e.e1 * b1 + e.e2 * b2;
  const vec3 to_light = p.position - x;
  const float d2 = length_squared(to_light);
  if (!(d2 > 0)) return p;
  const vec3 n = glm::cross(e.e1, e.e2);
  const EmissiveInstance& instance = lights.instances[e.source];
  const float inverse = 1 / glm::sqrt(d2);
  float cos_light = -glm::dot(to_light, n) * inverse / glm::length(n);
  if (instance.double_sided) cos_light = glm::abs(cos_light);
  if (!(cos_light > 0)) return p;
  p.distance = d2 * inverse;
  p.wi = to_light * inverse;
  p.incident = radiance_at(scene, instance, e, index, b1, b2);
  p.area_to_solid = d2 / cos_light;
  return p;
}

// `incident` is zero when nothing can arrive (back side, outside the cone or range, x on the light).
LUMI_HD LUMI_ALWAYS_INLINE EmitterPoint sample_emitter_point(const SceneView& scene, const LightView& lights,
                                                 std::uint32_t index, vec3 x, vec2 u) {
  const Emitter& e = lights.emitters[index];
  if (e.triangle()) return triangle_point(scene, lights, e, index, x, u);
  return e.vpl() ? vpl_point(lights, e, x) : punctual_point(lights, e, x);
}

// Density per solid angle at `x` with which sample_emitter_point finds the point `y` of triangle `index`.
LUMI_HD inline float pdf_emitter_point(const LightView& lights, std::uint32_t index, vec3 x, vec3 y) {
  const Emitter& e = lights.emitters[index];
  if (!e.triangle()) return 0;
  const vec3 to_light = y - x;
  const float d2 = length_squared(to_light);
  const vec3 n = glm::cross(e.e1, e.e2);  // |n| = 2A
  float cos_times_2area_d = -glm::dot(to_light, n);
  if (lights.instances[e.source].double_sided) cos_times_2area_d = glm::abs(cos_times_2area_d);
  return cos_times_2area_d > 0 ? 2 * d2 * glm::sqrt(d2) / cos_times_2area_d : 0.0f;
}

}  // namespace lumigrove
