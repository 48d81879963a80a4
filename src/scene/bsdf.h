// Reflection of a surface: Lambert plus a Cook-Torrance GGX gloss lobe, added.
//
//   f = diffuse/pi + D G F / (4 NdotL NdotV)
//   alpha = roughness^2, a2 = alpha^2, D = a2 / (pi (NdotH^2 (a2-1) + 1)^2)
//   G = prod_{L,V} N. / (N. (1-k) + k) with k = a2/2, F = F0 + (1-F0)(1-VdotH)^5
//
// Where it is zero. Light arrives only from above both normals: f, density and samples are zero unless
// NdotL > 0 and wi is above the geometric plane, so that no light leaks through a surface, whatever its
// shading normals. Gloss also needs NdotV > 0, and `specular` other than black (a surface without gloss has
// F0 = 0; Schlick's term alone would bring it back at grazing angles).
//
// Sampling. A lobe is chosen by luminance, then the cosine or the visible GGX normals (spherical caps: Dupuy
// and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", Computer Graphics Forum 42(8), 2023) are
// sampled. A direction drawn below one of the planes is returned with pdf 0 and weight 0 (light lost, never
// resampled), so bsdf_pdf integrates to one less the probability of those.
//
// Energy. The diffuse lobe reflects exactly `diffuse`. The plain sum of lobes and the G above follow the
// published demos; near grazing neither conserves energy: with F = 1 the gloss lobe reflects at most 1 up
// to 1.3 rad from the normal and at most 1.6 at 1.5 rad (tests/bsdf_test.cpp).
#pragma once

#include "base/sampling.h"
#include "scene/surface.h"

namespace lumigrove {

LUMI_HD inline vec3 fresnel_schlick(vec3 f0, float cos_theta) {
  const float m = 1 - cos_theta, m2 = m * m;
  return f0 + (1.0f - f0) * (m2 * m2 * m);
}

// GGX density of normals for the half vector's direction h (any length), per steradian. |h - n(n.h)|^2
// instead of 1 - NdotH^2: the difference of near-equal numbers would spoil narrow lobes.
LUMI_HD inline float ggx_normal_density(vec3 n, vec3 h, float a2) {
  const float n_dot_h = glm::dot(n, h);
  const float q = length_squared(h - n * n_dot_h) + a2 * n_dot_h * n_dot_h;
  const float h2 = length_squared(h);
  return a2 * h2 * h2 / (kPi * q * q);
}

// Schlick's shadowing of one direction over its cosine: G = product of these times both cosines.
LUMI_HD inline float schlick_shadowing_over_cosine(float cosine, float k) {
  return 1 / (cosine * (1 - k) + k);
}

// Smith's masking of one direction, which normalises the density of visible normals.
LUMI_HD inline float smith_masking(float cosine, float a2) {
  return 2 * cosine / (cosine + glm::sqrt(a2 + (1 - a2) * cosine * cosine));
}

// Has the surface a gloss lobe that its viewer can see?
LUMI_HD inline bool has_gloss(const Surface& s) {
  return max_component(s.specular) > 0 && glm::dot(s.normal, s.wo) > 0;
}

// Do virtual point lights light it? `wanted`: at all; mirrors are left to a ray of their own.
LUMI_HD inline bool vpls_light_gloss(bool wanted, float mirror_roughness, const Surface& s) {
  return wanted && s.roughness > mirror_roughness && has_gloss(s);
}

LUMI_HD inline bool above_surface(const Surface& s, vec3 wi) {
  return glm::dot(s.normal, wi) > 0 && glm::dot(s.geometric_normal, wi) > 0;
}

// The gloss lobe's part of f(wi, wo) for wi above the surface, 1/sr.
LUMI_HD inline vec3 gloss_above_surface(const Surface& s, vec3 wi) {
  const float alpha = s.roughness * s.roughness, a2 = alpha * alpha, k = 0.5f * a2;
  const vec3 h = wi + s.wo;
  const float d = ggx_normal_density(s.normal, h, a2);
  const float g = schlick_shadowing_over_cosine(glm::dot(s.normal, wi), k) *
                  schlick_shadowing_over_cosine(glm::dot(s.normal, s.wo), k);
  const float v_dot_h = glm::min(0.5f * glm::length(h), 1.0f);  // wi, wo unit: |wi + wo| = 2 VdotH
  return fresnel_schlick(s.specular, v_dot_h) * (0.25f * d * g);
}

// f(wi, wo), 1/sr; without the cosine. Zero below either normal.
LUMI_HD inline vec3 bsdf_eval(const Surface& s, vec3 wi) {
  if (!above_surface(s, wi)) return vec3(0);
  const vec3 f = s.diffuse * kInvPi;
  return has_gloss(s) ? f + gloss_above_surface(s, wi) : f;
}

// Its two parts.
LUMI_HD inline vec3 bsdf_eval_diffuse(const Surface& s, vec3 wi) {
  return above_surface(s, wi) ? s.diffuse * kInvPi : vec3(0);
}
LUMI_HD inline vec3 bsdf_eval_gloss(const Surface& s, vec3 wi) {
  return above_surface(s, wi) && has_gloss(s) ? gloss_above_surface(s, wi) : vec3(0);
}

// Probability that bsdf_sample takes the diffuse lobe: by luminance, gloss with the Fresnel factor of the
// macroscopic normal. 1 without gloss, 0 when the diffuse lobe is black.
LUMI_HD inline float diffuse_lobe_probability(const Surface& s) {
  if (!has_gloss(s)) return 1;
  const float cos_v = glm::min(glm::dot(s.normal, s.wo), 1.0f);
  const float diffuse = luminance(s.diffuse), gloss = luminance(fresnel_schlick(s.specular, cos_v));
  return diffuse / (diffuse + gloss);  // gloss > 0
}

// Density of bsdf_sample at wi, 1/sr.
LUMI_HD inline float bsdf_pdf(const Surface& s, vec3 wi) {
  if (!above_surface(s, wi)) return 0;
  const float p_diffuse = diffuse_lobe_probability(s);
  float pdf = p_diffuse * pdf_cosine_hemisphere(glm::dot(s.normal, wi));
  if (p_diffuse < 1) {
    const float alpha = s.roughness * s.roughness, a2 = alpha * alpha;
    const float cos_v = glm::dot(s.normal, s.wo);
    const float visible = smith_masking(cos_v, a2) * ggx_normal_density(s.normal, wi + s.wo, a2) / cos_v;
    pdf += (1 - p_diffuse) * 0.25f * visible;  // dh = dwi / (4 VdotH)
  }
  return pdf;
}

// Half vector with the density of the normals visible from `wo` (local, wo.z > 0). Unit.
LUMI_HD inline vec3 sample_visible_ggx_normal(vec3 wo, float alpha, vec2 u) {
  const vec3 stretched = glm::normalize(vec3(alpha * wo.x, alpha * wo.y, wo.z));
  const float z = 1 - u.x * (1 + stretched.z);  // uniform on the spherical cap above -stretched
  const float r = safe_sqrt(1 - z * z), phi = 2 * kPi * u.y;
  const vec3 h = vec3(r * glm::cos(phi), r * glm::sin(phi), z) + stretched;
  return glm::normalize(vec3(alpha * h.x, alpha * h.y, glm::max(h.z, 0.0f)));
}

struct BsdfSample {
  vec3 wi;        // unit; undefined when pdf == 0
  vec3 weight;    // f cos / pdf
  float pdf = 0;  // 1/sr, of both lobes together; 0: nothing sampled
};

// From the gloss lobe alone; `weight` and `pdf` are this lobe's. Nothing where the surface has none.
LUMI_HD inline BsdfSample bsdf_sample_gloss(const Surface& s, vec2 u) {
  BsdfSample sample;
  if (!has_gloss(s)) return sample;
  const Frame frame = make_frame(s.normal);
  const float alpha = s.roughness * s.roughness, a2 = alpha * alpha;
  const vec3 half = frame.to_world(sample_visible_ggx_normal(frame.to_local(s.wo), alpha, u));
  sample.wi = glm::normalize(2 * glm::dot(s.wo, half) * half - s.wo);
  if (!above_surface(s, sample.wi)) return sample;
  const float cos_v = glm::dot(s.normal, s.wo);
  sample.pdf = 0.25f * smith_masking(cos_v, a2) * ggx_normal_density(s.normal, sample.wi + s.wo, a2) / cos_v;
  if (sample.pdf > 0)
    sample.weight = gloss_above_surface(s, sample.wi) * (glm::dot(s.normal, sample.wi) / sample.pdf);
  return sample;
}

// From the diffuse lobe alone.
LUMI_HD inline BsdfSample bsdf_sample_diffuse(const Surface& s, vec2 u) {
  BsdfSample sample;
  sample.wi = make_frame(s.normal).to_world(sample_cosine_hemisphere(u));
  if (!above_surface(s, sample.wi)) return sample;
  sample.pdf = pdf_cosine_hemisphere(glm::dot(s.normal, sample.wi));
  sample.weight = s.diffuse;
  return sample;
}

// u: lobe, direction, direction; uniform in [0,1).
LUMI_HD inline BsdfSample bsdf_sample(const Surface& s, vec3 u) {
  const Frame frame = make_frame(s.normal);
  BsdfSample sample;
  if (u.x < diffuse_lobe_probability(s)) {
    sample.wi = frame.to_world(sample_cosine_hemisphere(vec2(u.y, u.z)));
  } else {
    const vec3 h = sample_visible_ggx_normal(frame.to_local(s.wo), s.roughness * s.roughness, vec2(u.y, u.z));
    const vec3 half = frame.to_world(h);
    sample.wi = glm::normalize(2 * glm::dot(s.wo, half) * half - s.wo);
  }
  sample.pdf = bsdf_pdf(s, sample.wi);
  sample.weight =
      sample.pdf > 0 ? bsdf_eval(s, sample.wi) * (glm::dot(s.normal, sample.wi) / sample.pdf) : vec3(0);
  return sample;
}

}  // namespace lumigrove
