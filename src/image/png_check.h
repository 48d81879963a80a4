// A look at the frame of a PNG file before libpng sees it: libpng prints its complaints to stderr by itself.
#pragma once

#include <span>
#include <string>

namespace lumigrove {

// What is wrong with the chunks of a PNG (cut short, checksum), or nothing. Bytes that are no PNG pass: their reader
// refuses them without noise.
std::string png_damage(std::span<const unsigned char> file);

}  // namespace lumigrove
