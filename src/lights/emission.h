// Light as it leaves its source: a ray, and the flux that it carries = emitted light / density of the ray. The mean
// flux of a light's rays is all that it sends out, or into the scene's box.
//
//   triangle     uniform point, cosine-weighted direction:            L pi A; twice that, on a random side, if
//                                                                     double-sided; nothing from a hole of a mask
//   point        uniform direction:                                   4 pi I
//   spot         uniform direction in its cone of solid angle W:      I ramp^2 W
//   directional  parallel to the light, through the box:              E (projected area of the box)
//   environment  direction from its distribution p, through the box:  L (projected area of the box) / p
//
// Rays from infinity start on the faces of the box that the light enters by, uniformly by projected area: unlike those
// from a disc over the bounding sphere, all of them enter the box.
#pragma once

#include "base/sampling.h"
#include "lights/emitter.h"
#include "lights/environment.h"
#include "scene/surface_kernel.h"

namespace lumigrove {

// All lights that can start a ray: emitters, then directional lights, then the environment.
struct LightSources {
  SceneView scene;
  LightView lights;
  Box3 box;  // holds the scene; empty: there is nothing that light from infinity could meet
};

// RGB, W. Zero: no light leaves here, and the ray means nothing.
struct EmittedRay {
  vec3 origin = vec3(0);
  vec3 direction = vec3(0);  // unit
  vec3 flux = vec3(0);
  float range = 0;  // range_window is still to be applied to the flux; 0 = unlimited
};

// --- boxes seen from far away --------------------------------------------------------------------------------

// A little larger, so that what lies on the faces is inside also after rounding; a flat box gets some height.
LUMI_HD inline Box3 with_margin(const Box3& box) {
  if (box.empty()) return box;
  const float largest = max_component(glm::max(glm::abs(box.lo), glm::abs(box.hi)));
  const float margin = 1e-4f * box.diagonal() + 8 * kSelfIntersection * largest;
  return {box.lo - margin, box.hi + margin};
}

// Of the faces across x, y and z, one of each pair. Along unit `w`.
LUMI_HD inline vec3 projected_face_areas(const Box3& box, vec3 w) {
  if (box.empty()) return vec3(0);
  const vec3 e = box.extent();
  return glm::abs(w) * vec3(e.y * e.z, e.z * e.x, e.x * e.y);
}

LUMI_HD inline float projected_area(const Box3& box, vec3 w) {
  const vec3 areas = projected_face_areas(box, w);
  return areas.x + areas.y + areas.z;
}

// Integral over the sphere of the projected area: pi times the surface, as of every convex body.
LUMI_HD inline float integral_of_projected_area(const Box3& box) {
  if (box.empty()) return 0;
  const vec3 e = box.extent();
  return 2 * kPi * (e.y * e.z + e.z * e.x + e.x * e.y);
}

// Where a ray along `w` enters the box, uniform over its cross-section: density 1 / projected_area. u.x chooses the
// face.
LUMI_HD inline vec3 sample_box_entry(const Box3& box, vec3 w, vec3 u) {
  const vec3 areas = projected_face_areas(box, w);
  const float r = u.x * (areas.x + areas.y + areas.z);
  const int axis = r < areas.x ? 0 : (r < areas.x + areas.y ? 1 : 2);
  const int next = (axis + 1) % 3, last = (axis + 2) % 3;
  const vec3 e = box.extent();
  vec3 p;
  p[axis] = w[axis] > 0 ? box.lo[axis] : box.hi[axis];
  p[next] = box.lo[next] + e[next] * u.y;
  p[last] = box.lo[last] + e[last] * u.z;
  return p;
}

// --- the lights ----------------------------------------------------------------------------------------------

// u.x, u.y: point; u.z, u.w: direction; side: which one, if there are two.
LUMI_HD inline EmittedRay emit_from_triangle(const LightSources& sources, std::uint32_t index, vec4 u, float side) {
  EmittedRay ray;
  const Emitter& e = sources.lights.emitters[index];
  const EmissiveInstance& instance = sources.lights.instances[e.source];
  const vec2 b = sample_uniform_triangle(vec2(u.x, u.y));
  ray.flux = instance.radiance * (kPi * triangle_area(e) * (instance.double_sided ? 2.0f : 1.0f));
  if (instance.textured || instance.masked) {
    const MeshPoint point = mesh_point(sources.scene, instance, e, index, b.x, b.y);
    if (instance.textured) ray.flux *= emissive_texture_at(sources.scene, point);
    if (instance.masked && is_cut_out(sources.scene, point)) ray.flux = vec3(0);
  }
  vec3 n = normalize_or(glm::cross(e.e1, e.e2), vec3(0));
  if (instance.double_sided && side < 0.5f) n = -n;
  ray.origin = e.p0 + e.e1 * b.x + e.e2 * b.y + n * self_intersection_offset({e.p0, e.e1, e.e2});
  ray.direction = make_frame(n).to_world(sample_cosine_hemisphere(vec2(u.z, u.w)));
  return ray;
}

LUMI_HD inline EmittedRay emit_from_punctual(const LightSources& sources, std::uint32_t index, vec2 u) {
  EmittedRay ray;
  const Emitter& e = sources.lights.emitters[index];
  const PunctualView& light = sources.lights.punctual[e.index()];
  ray.origin = e.p0;
  ray.range = light.range;
  if (!light.spot) {
    ray.direction = sample_uniform_sphere(u);
    ray.flux = light.intensity / pdf_uniform_sphere();
    return ray;
  }
  const float cos_outer = e.e2.x;
  const vec3 local = sample_uniform_cone(u, cos_outer);
  ray.direction = make_frame(e.e1).to_world(local);
  ray.flux = light.intensity * (spot_profile(e, local.z) / pdf_uniform_cone(cos_outer));
  return ray;
}

LUMI_HD inline EmittedRay emit_from_directional(const LightSources& sources, const DirectionalView& light, vec3 u) {
  EmittedRay ray;
  ray.direction = light.direction;
  ray.origin = sample_box_entry(sources.box, light.direction, u);
  ray.flux = light.irradiance * projected_area(sources.box, light.direction);
  return ray;
}

// u_direction: over the sphere; u: where the ray enters the box.
LUMI_HD inline EmittedRay emit_from_environment(const LightSources& sources, vec2 u_direction, vec3 u) {
  EmittedRay ray;
  const EnvironmentView& environment = sources.lights.environment;
  EnvironmentSample to_light{vec3(0), pdf_uniform_sphere()};
  if (environment.image < 0)
    to_light.wi = sample_uniform_sphere(u_direction);
  else
    to_light = sample_environment(environment, vec3(0), u_direction);
  if (!(to_light.pdf > 0)) return ray;
  ray.direction = -to_light.wi;
  ray.origin = sample_box_entry(sources.box, ray.direction, u);
  ray.flux = environment_radiance(sources.scene, environment, to_light.wi) *
             (projected_area(sources.box, ray.direction) / to_light.pdf);
  return ray;
}

// --- all of them -----------------------------------------------------------------------------------------------

// Y, W: what light number `index` sends out, or into the box. Of textures and images a mean, of masks as if they had no
// holes: exact enough to choose lights by. Zero only if emit() can carry nothing.
LUMI_HD inline float source_flux(const LightSources& sources, std::uint32_t index) {
  const LightView& lights = sources.lights;
  const auto local = static_cast<std::uint32_t>(lights.emitters.size());
  if (index < local) return finite_or_zero(emitter_flux(lights, index));
  if (index - local < lights.directional.size()) {
    const DirectionalView& light = lights.directional[index - local];
    return finite_or_zero(luminance(light.irradiance) * projected_area(sources.box, light.direction));
  }
  if (!(lights.scene_disc > 0)) return 0;
  const float through_disc = lights.environment_flux / lights.scene_disc;  // pi times the mean radiance
  return finite_or_zero(through_disc * kInvPi * integral_of_projected_area(sources.box));
}

// A ray from light number `index`, from five uniform numbers.
LUMI_HD inline EmittedRay emit(const LightSources& sources, std::uint32_t index, vec4 u, float v) {
  const LightView& lights = sources.lights;
  const auto local = static_cast<std::uint32_t>(lights.emitters.size());
  if (index < local) {
    if (lights.emitters[index].punctual()) return emit_from_punctual(sources, index, vec2(u));
    return emit_from_triangle(sources, index, u, v);
  }
  const vec3 u_entry(u.z, u.w, v);
  if (index - local < lights.directional.size())
    return emit_from_directional(sources, lights.directional[index - local], u_entry);
  return emit_from_environment(sources, vec2(u), u_entry);
}

}  // namespace lumigrove
