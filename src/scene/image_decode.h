// Texture images from memory: whatever OpenImageIO reads, as the RGBA texels of a scene.
#pragma once

#include <span>
#include <string>

#include "lumigrove/scene.h"

namespace lumigrove {

// Decodes a whole image file held in memory (PNG, JPEG, EXR, HDR, WebP, TIFF, ...; told by its content). Grey
// becomes RGB, a missing alpha 1; alpha is never multiplied in. 8-bit files fill texels8, encoded as `srgb`
// says; all others fill texels32, linear: 16-bit files are decoded from sRGB when `srgb`, float files are
// linear already. Throws Error "<name>: ...". Runs in one thread; calls may run side by side.
Image8or32 decode_image(std::span<const unsigned char> file, const std::string& name, bool srgb);

}  // namespace lumigrove
