#include "image/difference.h"

#include <cmath>

#include "base/srgb.h"
#include "base/vec.h"
#include "device/device.h"
#include "metrics/check.h"

namespace lumigrove {
namespace {

// Three floats a pixel from color(pixel).
template <class Color>
std::vector<float> make_picture(std::size_t pixels, const Color& color) {
  std::vector<float> picture(3 * pixels);
  launch(static_cast<int>(pixels), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    const vec3 c = color(at);
    picture[3 * at] = c.x;
    picture[3 * at + 1] = c.y;
    picture[3 * at + 2] = c.z;
  });
  return picture;
}

vec3 pixel(const RgbImage& image, std::size_t at) {
  return vec3(image.rgb[3 * at], image.rgb[3 * at + 1], image.rgb[3 * at + 2]);
}

}  // namespace

vec3 blue_white_red(float t) {
  t = glm::clamp(t, -1.0f, 1.0f);
  const vec3 end = t < 0 ? vec3(0.02f, 0.19f, 0.70f) : vec3(0.70f, 0.02f, 0.09f);
  return glm::mix(vec3(1), end, std::abs(t));
}

// Polynomial of degree 6, least squares over the 256 entries of "magma" (S. van der Walt, N. Smith,
// matplotlib 1.5, 2015, CC0); off by at most 0.024, in the first entries.
vec3 magma(float t) {
  t = glm::clamp(t, 0.0f, 1.0f);
  const vec3 coefficients[] = {{-0.0021f, -0.0007f, -0.0095f},  {0.2505f, 0.6945f, 2.4953f},
                               {8.3459f, -3.5960f, 0.3291f},    {-27.6670f, 14.2539f, -13.6466f},
                               {52.1707f, -27.9446f, 12.8811f}, {-50.7586f, 29.0539f, 4.2699f},
                               {18.6643f, -11.4900f, -5.5708f}};
  vec3 color(0);
  for (int power = 6; power >= 0; --power) color = color * t + coefficients[power];
  return glm::clamp(color, vec3(0), vec3(1));
}

std::vector<float> signed_difference(const RgbImage& reference, const RgbImage& test) {
  check_pair(reference, test);
  return make_picture(reference.rgb.size() / 3, [&](std::size_t at) {
    const float r = luminance(pixel(reference, at)), t = luminance(pixel(test, at));
    const float sum = std::abs(r) + std::abs(t);
    return blue_white_red(sum > 0 ? (t - r) / sum : 0.0f);
  });
}

std::vector<float> absolute_difference(const RgbImage& reference, const RgbImage& test, const ToneMap& tone) {
  check_pair(reference, test);
  return tone_map(
      make_picture(reference.rgb.size() / 3,
                   [&](std::size_t at) { return glm::abs(pixel(test, at) - pixel(reference, at)); }),
      tone);
}

std::vector<float> heat_map(const std::vector<float>& errors) {
  return make_picture(errors.size(), [&](std::size_t at) { return magma(errors[at]); });
}

void write_picture(const std::vector<float>& picture, int width, int height,
                   const std::filesystem::path& file) {
  Image image{width, height, {{"", {"R", "G", "B"}, picture, {}}}, {}};
  for (float& value : image.layers.front().values) value = srgb_to_linear(value);
  write_image(image, file, {0, ToneCurve::kSrgb});
}

}  // namespace lumigrove
