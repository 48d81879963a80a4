#include "scene/image_encode.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/srgb.h"

namespace lumigrove {
namespace {

std::vector<std::uint8_t> encode(const Image8or32& image, const char* file_name, OIIO::TypeDesc stored,
                                 OIIO::TypeDesc given, const void* texels) {
  std::vector<std::uint8_t> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto output = OIIO::ImageOutput::create(file_name, &memory);
  if (!output) throw Error(fmt::format("image '{}' cannot be encoded: {}", image.name, OIIO::geterror()));
  OIIO::ImageSpec spec(image.width, image.height, 4, stored);
  spec.alpha_channel = 3;
  spec.attribute("oiio:UnassociatedAlpha", 1);
  spec.attribute("compression", "zip");
  if (!output->open(file_name, spec) || !output->write_image(given, texels) || !output->close())
    throw Error(fmt::format("image '{}' cannot be encoded: {}", image.name, output->geterror()));
  return bytes;
}

// Texel values as linear floats.
std::vector<float> linear_texels(const Image8or32& image) {
  if (!image.texels32.empty()) return image.texels32;
  std::vector<float> texels(image.texels8.size());
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const float value = static_cast<float>(image.texels8[i]) / 255.0f;
    texels[i] = image.srgb && i % 4 != 3 ? srgb_to_linear(value) : value;
  }
  return texels;
}

float largest_color(const std::vector<float>& texels) {
  float largest = 0;
  for (std::size_t i = 0; i < texels.size(); ++i)
    if (i % 4 != 3) largest = std::max(largest, texels[i]);
  return largest;
}

}  // namespace

EncodedImage encode_png(const Image8or32& image, TextureContent content) {
  EncodedImage encoded;
  const bool srgb = content != TextureContent::kData;
  if (!image.texels8.empty() && image.srgb == srgb) {
    encoded.bytes =
        encode(image, "image.png", OIIO::TypeDesc::UINT8, OIIO::TypeDesc::UINT8, image.texels8.data());
    return encoded;
  }
  const std::vector<float> texels = linear_texels(image);
  const float largest = largest_color(texels);
  if (largest > 1 && content == TextureContent::kEmission)
    encoded.scale = std::exp2(std::ceil(std::log2(largest)));  // dividing by a power of two loses nothing
  encoded.rounded = true;
  encoded.clamped = largest > encoded.scale;
  std::vector<std::uint16_t> stored(texels.size());
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const bool alpha = i % 4 == 3;
    const float value = std::clamp(alpha ? texels[i] : texels[i] / encoded.scale, 0.0f, 1.0f);
    stored[i] =
        static_cast<std::uint16_t>(std::lround(65535 * (srgb && !alpha ? linear_to_srgb(value) : value)));
  }
  encoded.bytes = encode(image, "image.png", OIIO::TypeDesc::UINT16, OIIO::TypeDesc::UINT16, stored.data());
  return encoded;
}

std::vector<std::uint8_t> encode_exr(const Image8or32& image) {
  const std::vector<float> texels = linear_texels(image);
  return encode(image, "image.exr", OIIO::TypeDesc::FLOAT, OIIO::TypeDesc::FLOAT, texels.data());
}

}  // namespace lumigrove
