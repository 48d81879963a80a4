// What the builders of light BVHs minimise. Plain functions, so that tests can ask for the same numbers.
#pragma once

#include "lights/emitter.h"

namespace lumigrove {

// Directions within `angle` of `axis`; pi holds all.
struct AngleCone {
  vec3 axis = vec3(0);
  float angle = 0;
};

// Some emitters together.
struct EmitterCluster {
  Box3 box;
  float intensity = -1;  // Y of the peak radiant intensity; below 0: no emitter
  AngleCone cone;        // of normals
};

inline float angle_between(vec3 a, vec3 b) { return 2 * std::asin(glm::min(1.0f, 0.5f * glm::length(a - b))); }

// Half-angle of the smallest cone that holds both. Never smaller for cones that hold these.
inline float united_angle(const AngleCone& a, const AngleCone& b) {
  const float larger = glm::max(a.angle, b.angle);
  if (larger >= kPi) return kPi;
  return glm::min(kPi, glm::max(larger, 0.5f * (a.angle + b.angle + angle_between(a.axis, b.axis))));
}

inline AngleCone unite(const AngleCone& a, const AngleCone& b) {
  const float angle = united_angle(a, b);
  if (angle >= kPi) return {a.axis, kPi};
  if (angle <= a.angle) return a;
  if (angle <= b.angle) return b;
  // From a's axis towards b's.
  vec3 aside = b.axis - a.axis * glm::dot(a.axis, b.axis);
  const float length = glm::length(aside);
  aside = length > 1e-6f ? aside / length : make_frame(a.axis).x;
  const float turn = angle - a.angle;
  return {glm::normalize(a.axis * std::cos(turn) + aside * std::sin(turn)), angle};
}

inline EmitterCluster unite(const EmitterCluster& a, const EmitterCluster& b) {
  if (a.intensity < 0) return b;
  if (b.intensity < 0) return a;
  return {unite(a.box, b.box), a.intensity + b.intensity, unite(a.cone, b.cone)};
}

inline EmitterCluster emitter_cluster(const LightView& lights, std::uint32_t e, float inverse_flux) {
  const NormalCone cone = emission_cone(lights, lights.emitters[e]);
  return {emitter_bounds(lights.emitters[e]), emitter_intensity(lights, e) * inverse_flux,
          {cone.axis, cone.radius > 0 ? kPi : 0.0f}};
}

// --- saoh --------------------------------------------------------------------------------------------------

// M_Omega: solid angle that emitters with normals in a cone light, weighted by their cosine; theta_e = pi/2.
inline float orientation_measure(float angle) {
  const float end = glm::min(angle + 0.5f * kPi, kPi), sine = std::sin(angle), cosine = std::cos(angle);
  return 2 * kPi * (1 - cosine) +
         0.5f * kPi * (2 * end * sine - std::cos(angle - 2 * end) - 2 * angle * sine + cosine);
}

// Energy times M_A times M_Omega. `margin` widens the box, so that lights on a line still prefer short ones.
inline float saoh_cost(const EmitterCluster& c, float margin) {
  const vec3 e = c.box.extent() + margin;
  return c.intensity * (e.x * e.y + e.y * e.z + e.z * e.x) * orientation_measure(c.cone.angle);
}

// --- agglomerative -----------------------------------------------------------------------------------------

// (1 - cos angle)^2
inline float cone_spread(float angle) {
  const float sine = std::sin(0.5f * angle);
  return 4 * sine * sine * sine * sine;
}

// (I_a + I_b) (diagonal^2 + (1 - cos beta)^2 scene_diagonal^2) of both together. Symmetric to the bit; never smaller for
// clusters that hold these.
inline float pair_cost(const EmitterCluster& a, const EmitterCluster& b, float scene_diagonal2) {
  const vec3 extent = unite(a.box, b.box).extent();
  return (a.intensity + b.intensity) *
         (length_squared(extent) + cone_spread(united_angle(a.cone, b.cone)) * scene_diagonal2);
}

}  // namespace lumigrove
