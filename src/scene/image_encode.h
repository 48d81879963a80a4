// Scene images as image files in memory, for exporters.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "lumigrove/scene.h"

namespace lumigrove {

// What the numbers of a texture mean to the program that will read the file.
enum class TextureContent : std::uint8_t {
  kColor,     // reflectance in [0,1], stored sRGB-encoded
  kEmission,  // light of any magnitude, stored sRGB-encoded after division by `scale`
  kData,      // normals, roughness, metalness: stored as they are
};

struct EncodedImage {
  std::vector<std::uint8_t> bytes;
  float scale = 1;       // stored value * scale = texel; a power of two, 1 except for kEmission above 1
  bool rounded = false;  // texels were rounded to 16 bits
  bool clamped = false;  // texels above 1 were clamped
};

// PNG with alpha not premultiplied. 8-bit texels whose encoding fits the content keep their bits; everything
// else becomes 16 bits a channel. Throws Error.
EncodedImage encode_png(const Image8or32& image, TextureContent content);

// Linear float OpenEXR, lossless for float images; 8-bit images are decoded first. Throws Error.
std::vector<std::uint8_t> encode_exr(const Image8or32& image);

}  // namespace lumigrove
