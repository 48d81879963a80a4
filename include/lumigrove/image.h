// Rendered images: layers of float or integer channels, metadata, and files (OpenImageIO underneath).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "lumigrove/error.h"

namespace lumigrove {

// One AOV. `name` is empty for the beauty (channels R,G,B,A at the EXR root), otherwise the EXR layer name.
// Exactly one of the arrays is filled: width*height*channels values, interleaved, row 0 on top.
struct Layer {
  std::string name;
  std::vector<std::string> channels;   // "R","G","B","A" · "X","Y","Z" · "Z" · "id"
  std::vector<float> values;
  std::vector<std::uint32_t> ids;      // identifiers; 0xffffffff = none
};

struct Image {
  int width = 0, height = 0;
  std::vector<Layer> layers;           // beauty first
  std::map<std::string, std::string> metadata;  // keys start with "lumigrove:" in files

  const Layer* find(const std::string& layer_name) const;  // nullptr when absent
};

enum class ToneCurve : std::uint8_t { kFilmic, kSrgb };

// How HDR becomes 8 bits: colour * 2^exposure_ev, then the curve.
struct ToneMap {
  float exposure_ev = 0;
  ToneCurve curve = ToneCurve::kFilmic;
};

// Linear RGB -> sRGB-encoded RGB in [0,1] (three floats a pixel in and out).
std::vector<float> tone_map(const std::vector<float>& rgb, const ToneMap& tone);

// By extension: .exr keeps all layers (half for colour, float for P, Z and variance, uint32 for ids) and metadata;
// .png, .jpg: the tone-mapped beauty. Writes a temporary beside `file`, then renames; throws Error.
void write_image(const Image& image, const std::filesystem::path& file, const ToneMap& tone = {});

// Any image OpenImageIO reads; 8-bit images are decoded from sRGB to linear. Throws Error.
Image read_image(const std::filesystem::path& file);

}  // namespace lumigrove
