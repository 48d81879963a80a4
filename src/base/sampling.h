// Warps from the unit square to the shapes that emitters and lobes need, each beside its exact density.
// `u` is uniform in [0,1)^2. Directions are unit and local: z is the axis; densities over directions are per
// steradian, others per unit of area.
#pragma once

#include "base/vec.h"

namespace lumigrove {

LUMI_HD inline float safe_sqrt(float x) { return glm::sqrt(glm::max(x, 0.0f)); }

// Unit disc, uniform by area; polar map.
LUMI_HD inline vec2 sample_disc(vec2 u) {
  const float r = glm::sqrt(u.x), phi = 2 * kPi * u.y;
  return r * vec2(glm::cos(phi), glm::sin(phi));
}
LUMI_HD inline float pdf_disc() { return kInvPi; }

// Hemisphere about +z with density proportional to the cosine: the disc, lifted (Malley).
LUMI_HD inline vec3 sample_cosine_hemisphere(vec2 u) {
  const vec2 d = sample_disc(u);
  return vec3(d, safe_sqrt(1 - u.x));  // |d|^2 = u.x
}
LUMI_HD inline float pdf_cosine_hemisphere(float cos_theta) { return glm::max(cos_theta, 0.0f) * kInvPi; }

LUMI_HD inline vec3 sample_uniform_sphere(vec2 u) {
  const float z = 1 - 2 * u.x;
  const float r = 2 * safe_sqrt(u.x * (1 - u.x)), phi = 2 * kPi * u.y;
  return vec3(r * glm::cos(phi), r * glm::sin(phi), z);
}
LUMI_HD inline float pdf_uniform_sphere() { return 0.25f * kInvPi; }

// Directions within the cone cos(theta) >= cos_max about +z, -1 <= cos_max < 1. Keeps its precision for thin
// cones.
LUMI_HD inline vec3 sample_uniform_cone(vec2 u, float cos_max) {
  const float h = u.x * (1 - cos_max);  // 1 - cos(theta)
  const float r = safe_sqrt(h * (2 - h)), phi = 2 * kPi * u.y;
  return vec3(r * glm::cos(phi), r * glm::sin(phi), 1 - h);
}
LUMI_HD inline float pdf_uniform_cone(float cos_max) { return 1 / (2 * kPi * (1 - cos_max)); }

// Barycentric weights of the second and third vertex: p = (1-b.x-b.y) p0 + b.x p1 + b.y p2, uniform by area.
LUMI_HD inline vec2 sample_uniform_triangle(vec2 u) {
  const float root = glm::sqrt(1 - u.x);
  return vec2(1 - root, u.y * root);
}
LUMI_HD inline float pdf_uniform_triangle(float area) { return 1 / area; }

}  // namespace lumigrove
