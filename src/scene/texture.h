// Texture lookup: wrap modes, KHR_texture_transform, nearest or bilinear; no mip levels (a sample is a point).
#pragma once

#include "base/lanes.h"
#include "scene/scene_view.h"

namespace lumigrove {

LUMI_HD LUMI_ALWAYS_INLINE vec4 fetch_texel(const ImageView& image, const float* srgb_to_linear, int x, int y) {
  const std::size_t at = 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                              static_cast<std::size_t>(x));
  if (image.texels32) {
    const float* t = image.texels32 + at;
    return vec4(t[0], t[1], t[2], t[3]);
  }
  const std::uint8_t* t = image.texels8 + at;
  const float a = static_cast<float>(t[3]) * (1.0f / 255.0f);
  if (image.srgb) return vec4(srgb_to_linear[t[0]], srgb_to_linear[t[1]], srgb_to_linear[t[2]], a);
  return vec4(static_cast<float>(t[0]), static_cast<float>(t[1]), static_cast<float>(t[2]), 0) * (1.0f / 255.0f) +
         vec4(0, 0, 0, a);
}

LUMI_HD inline int wrap_texel(int i, int n, Wrap wrap) {
  if (i >= 0 && i < n) return i;
  if (wrap == Wrap::kClamp) return i < 0 ? 0 : (i >= n ? n - 1 : i);
  if (wrap == Wrap::kRepeat) {
    const int r = i % n;
    return r < 0 ? r + n : r;
  }
  const int period = 2 * n;
  int r = i % period;
  if (r < 0) r += period;
  return r < n ? r : period - 1 - r;
}

// glTF texture coordinates after KHR_texture_transform: translation * rotation * scale.
LUMI_HD inline vec2 transform_uv(const TextureUse& use, vec2 uv) {
  uv = uv * use.scale;
  if (use.rotation != 0.0f) {
    const float c = glm::cos(use.rotation), s = glm::sin(use.rotation);
    uv = vec2(c * uv.x + s * uv.y, -s * uv.x + c * uv.y);
  }
  return uv + use.offset;
}

LUMI_HD inline vec4 sample_texture(const SceneView& scene, const TextureUse& use, vec2 uv0, vec2 uv1) {
  const ImageView& image = scene.images[static_cast<std::size_t>(use.image)];
  vec2 uv = transform_uv(use, use.uv_set == 0 ? uv0 : uv1);
  // Non-finite or enormous coordinates would overflow the integer texel index.
  if (!(glm::abs(uv.x) < 1e6f)) uv.x = 0;
  if (!(glm::abs(uv.y) < 1e6f)) uv.y = 0;
  const float limit = 1e9f / static_cast<float>(image.width > image.height ? image.width : image.height);
  uv = glm::clamp(uv, vec2(-limit), vec2(limit));
  const float x = uv.x * static_cast<float>(image.width), y = uv.y * static_cast<float>(image.height);
  if (use.nearest) {
    const int xi = wrap_texel(static_cast<int>(glm::floor(x)), image.width, use.wrap_u);
    const int yi = wrap_texel(static_cast<int>(glm::floor(y)), image.height, use.wrap_v);
    return fetch_texel(image, scene.srgb_to_linear, xi, yi);
  }
  const float fx = glm::floor(x - 0.5f), fy = glm::floor(y - 0.5f);
  const float wx = x - 0.5f - fx, wy = y - 0.5f - fy;
  const int x0 = wrap_texel(static_cast<int>(fx), image.width, use.wrap_u);
  const int x1 = wrap_texel(static_cast<int>(fx) + 1, image.width, use.wrap_u);
  const int y0 = wrap_texel(static_cast<int>(fy), image.height, use.wrap_v);
  const int y1 = wrap_texel(static_cast<int>(fy) + 1, image.height, use.wrap_v);
  const vec4 top = fetch_texel(image, scene.srgb_to_linear, x0, y0) * (1 - wx) +
                   fetch_texel(image, scene.srgb_to_linear, x1, y0) * wx;
  const vec4 bottom = fetch_texel(image, scene.srgb_to_linear, x0, y1) * (1 - wx) +
                      fetch_texel(image, scene.srgb_to_linear, x1, y1) * wx;
  return top * (1 - wy) + bottom * wy;
}

}  // namespace lumigrove
