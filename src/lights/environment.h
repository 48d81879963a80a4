// Light from the environment: radiance along a direction, sampling and its pdf (solid angle). Row 0 of the
// image is +Y, its centre column looks along -Z, u grows towards +X.
#pragma once

#include "base/vec.h"
#include "lights/light_set.h"
#include "scene/texture.h"

namespace lumigrove {

LUMI_HD inline vec2 direction_to_equirect(vec3 w) {
  const float u = 0.5f + glm::atan(w.x, -w.z) * (0.5f * kInvPi);
  return vec2(u, glm::acos(glm::clamp(w.y, -1.0f, 1.0f)) * kInvPi);
}
LUMI_HD inline vec3 equirect_to_direction(float phi, float cos_theta) {
  const float sin_theta = glm::sqrt(glm::max(0.0f, 1 - cos_theta * cos_theta));
  return vec3(sin_theta * glm::sin(phi), cos_theta, -sin_theta * glm::cos(phi));
}

LUMI_HD inline vec3 environment_radiance(const SceneView& scene, const EnvironmentView& environment, vec3 w) {
  if (environment.image < 0) return environment.radiance;
  TextureUse use;
  use.image = environment.image;
  use.wrap_v = Wrap::kClamp;
  const vec2 uv = direction_to_equirect(w);
  return environment.radiance * vec3(sample_texture(scene, use, uv, uv));
}

// Last i with cdf[i] <= u, among `n` intervals of a cdf with n + 1 entries.
LUMI_HD inline int find_interval(const float* cdf, int n, float u) {
  int lo = 0, hi = n;
  while (hi - lo > 1) {
    const int middle = (lo + hi) / 2;
    if (cdf[middle] <= u)
      lo = middle;
    else
      hi = middle;
  }
  return lo;
}

// A row's solid angle is 2 pi (cos at its top - cos at its bottom), shared equally by its texels.
LUMI_HD inline float texel_solid_angle(const EnvironmentView& environment, int row) {
  const float step = kPi / static_cast<float>(environment.height);
  const float cos_top = glm::cos(step * static_cast<float>(row)),
              cos_bottom = glm::cos(step * static_cast<float>(row + 1));
  return 2 * kPi * (cos_top - cos_bottom) / static_cast<float>(environment.width);
}

LUMI_HD inline float pdf_environment_texel(const EnvironmentView& environment, int row, int column) {
  const float* cdf = environment.column_cdf +
                     static_cast<std::size_t>(row) * static_cast<std::size_t>(environment.width + 1);
  return (environment.row_cdf[row + 1] - environment.row_cdf[row]) * (cdf[column + 1] - cdf[column]) /
         texel_solid_angle(environment, row);
}

// Constant environments: cosine-weighted about the normal; images: their own distribution.
LUMI_HD inline float pdf_environment(const EnvironmentView& environment, vec3 normal, vec3 wi) {
  if (environment.image < 0) return glm::max(0.0f, glm::dot(normal, wi)) * kInvPi;
  const vec2 uv = direction_to_equirect(wi);
  const int column =
      glm::clamp(static_cast<int>(uv.x * static_cast<float>(environment.width)), 0, environment.width - 1);
  const int row =
      glm::clamp(static_cast<int>(uv.y * static_cast<float>(environment.height)), 0, environment.height - 1);
  return pdf_environment_texel(environment, row, column);
}

struct EnvironmentSample {
  vec3 wi;
  float pdf;
};
LUMI_HD inline EnvironmentSample sample_environment(const EnvironmentView& environment, vec3 normal, vec2 u) {
  if (environment.image < 0) {
    const float r = glm::sqrt(u.x), phi = 2 * kPi * u.y, z = glm::sqrt(glm::max(0.0f, 1 - u.x));
    return {make_frame(normal).to_world(vec3(r * glm::cos(phi), r * glm::sin(phi), z)), z * kInvPi};
  }
  const int row = find_interval(environment.row_cdf, environment.height, u.x);
  const float* cdf = environment.column_cdf +
                     static_cast<std::size_t>(row) * static_cast<std::size_t>(environment.width + 1);
  const int column = find_interval(cdf, environment.width, u.y);
  const float row_width = environment.row_cdf[row + 1] - environment.row_cdf[row];
  const float v = row_width > 0 ? (u.x - environment.row_cdf[row]) / row_width : 0.5f;
  const float column_width = cdf[column + 1] - cdf[column];
  const float h = column_width > 0 ? (u.y - cdf[column]) / column_width : 0.5f;
  const float step = kPi / static_cast<float>(environment.height);
  const float cos_top = glm::cos(step * static_cast<float>(row)),
              cos_bottom = glm::cos(step * static_cast<float>(row + 1));
  const float phi =
      2 * kPi * ((static_cast<float>(column) + h) / static_cast<float>(environment.width) - 0.5f);
  return {equirect_to_direction(phi, cos_top + (cos_bottom - cos_top) * v),
          pdf_environment_texel(environment, row, column)};
}

}  // namespace lumigrove
