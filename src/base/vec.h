// Vector words used by every kernel: luminance, affine maps, orthonormal frames. Types come from lumigrove/vec.h.
#pragma once

#include "lumigrove/vec.h"

namespace lumigrove {

// BT.709 luminance of linear RGB.
LUMI_HD inline float luminance(vec3 c) { return 0.2126f * c.x + 0.7152f * c.y + 0.0722f * c.z; }
LUMI_HD inline float max_component(vec3 c) { return glm::max(c.x, glm::max(c.y, c.z)); }
LUMI_HD inline float length_squared(vec3 v) { return glm::dot(v, v); }
LUMI_HD inline bool is_finite(float x) { return x - x == 0.0f; }
LUMI_HD inline bool is_finite(vec3 v) { return is_finite(v.x) && is_finite(v.y) && is_finite(v.z); }

LUMI_HD inline vec3 transform_point(const mat4x3& m, vec3 p) { return m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3]; }
LUMI_HD inline vec3 transform_vector(const mat4x3& m, vec3 v) { return m[0] * v.x + m[1] * v.y + m[2] * v.z; }
// Columns of the cofactor matrix: maps normals under any invertible affine map (length not kept).
LUMI_HD inline mat3 normal_matrix(const mat4x3& m) {
  return mat3(glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1]));
}

// Orthonormal frame about unit `n` (Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1)).
struct Frame {
  vec3 x, y, z;
  LUMI_HD vec3 to_world(vec3 v) const { return x * v.x + y * v.y + z * v.z; }
  LUMI_HD vec3 to_local(vec3 v) const { return vec3(glm::dot(x, v), glm::dot(y, v), glm::dot(z, v)); }
};
LUMI_HD inline Frame make_frame(vec3 n) {
  const float sign = n.z >= 0.0f ? 1.0f : -1.0f;
  const float a = -1.0f / (sign + n.z);
  const float b = n.x * n.y * a;
  return {vec3(1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x), vec3(b, sign + n.y * n.y * a, -n.y), n};
}

}  // namespace lumigrove
