#include "scene/builtin/procedural_image.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/srgb.h"
#include "scene/builtin/noise.h"

namespace lumigrove::builtin {
namespace {

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0f, 1.0f)));
}

template <class Texel>
int add_image(Scene& scene, std::string name, int size, bool srgb, const Texel& texel) {
  Image8or32 image;
  image.name = std::move(name);
  image.width = image.height = size;
  image.srgb = srgb;
  image.texels8.reserve(static_cast<std::size_t>(size) * static_cast<std::size_t>(size) * 4);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) {
      const vec3 value = texel((vec2(x, y) + 0.5f) / static_cast<float>(size));
      image.texels8.insert(image.texels8.end(), {to_byte(value.x), to_byte(value.y), to_byte(value.z), 255});
    }
  scene.images.push_back(std::move(image));
  return static_cast<int>(scene.images.size()) - 1;
}

}  // namespace

int add_color_image(Scene& scene, std::string name, int size, const std::function<vec3(vec2)>& color) {
  return add_image(scene, std::move(name), size, true, [&](vec2 p) {
    const vec3 c = glm::clamp(color(p), 0.0f, 1.0f);
    return vec3(linear_to_srgb(c.x), linear_to_srgb(c.y), linear_to_srgb(c.z));
  });
}

int add_roughness_image(Scene& scene, std::string name, int size,
                        const std::function<float(vec2)>& roughness) {
  return add_image(scene, std::move(name), size, false, [&](vec2 p) { return vec3(1, roughness(p), 0); });
}

TextureUse tiled(int image, vec2 metres) {
  TextureUse use;
  use.image = image;
  use.scale = 1.0f / metres;
  return use;
}

// Four copies, each shifted by one period, cross-faded so that opposite edges meet.
float tiling_noise(vec2 p, float frequency, int octaves, std::uint32_t seed) {
  const auto at = [&](float dx, float dy) {
    return fractal_noise((p + vec2(dx, dy)) * frequency + 300.0f, octaves, seed);
  };
  return glm::mix(glm::mix(at(0, 0), at(-1, 0), p.x), glm::mix(at(0, -1), at(-1, -1), p.x), p.y);
}

BrickPoint running_bond(vec2 p, int columns, int rows) {
  const float y = p.y * static_cast<float>(rows);
  const int row = std::min(static_cast<int>(y), rows - 1);
  float x = p.x * static_cast<float>(columns) + (row % 2 == 0 ? 0.0f : 0.5f);
  const int column = static_cast<int>(x) % columns;
  x -= std::floor(x);
  const float fy = y - static_cast<float>(row);
  const float aspect = static_cast<float>(rows) / static_cast<float>(columns);
  return {row, column, std::min({x * aspect, (1 - x) * aspect, fy, 1 - fy})};
}

}  // namespace lumigrove::builtin
