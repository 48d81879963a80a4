// Rendered images: layers of float or integer channels, metadata, and files (OpenImageIO underneath).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "lumigrove/error.h"

namespace lumigrove {

// One AOV. `name` is empty for the beauty (channels R,G,B,A at the EXR root), otherwise the EXR layer name; a
// layer with one channel of its own name ("Z") is stored at the root too. Exactly one of the arrays is
// filled: width*height*channels values, interleaved, row 0 on top.
struct Layer {
  std::string name;
  std::vector<std::string> channels;  // "R","G","B","A" · "X","Y","Z" · "Z" · "id"
  std::vector<float> values;
  std::vector<std::uint32_t> ids;  // identifiers; 0xffffffff = none
};

struct Image {
  int width = 0, height = 0;
  std::vector<Layer> layers;                    // beauty first
  std::map<std::string, std::string> metadata;  // in .exr and .png, where keys get the prefix "lumigrove:"

  const Layer* find(const std::string& layer_name) const;  // nullptr when absent
};

enum class ToneCurve : std::uint8_t { kFilmic, kSrgb };

// How HDR becomes 8 bits: colour * 2^exposure_ev, then the curve. kFilmic is Narkowicz' fit of the ACES
// reference transform (2015) on 0.6 * colour, which takes back the exposure that the fit contains; both
// curves end with sRGB encoding.
struct ToneMap {
  float exposure_ev = 0;
  ToneCurve curve = ToneCurve::kFilmic;
};

// "filmic" or "srgb"; anything else throws Error.
ToneCurve tone_curve_from_name(const std::string& name);

// Linear RGB -> sRGB-encoded RGB in [0,1] (three floats a pixel in and out). NaN and negative values become
// 0, infinity 1.
std::vector<float> tone_map(const std::vector<float>& rgb, const ToneMap& tone);

// By extension: .exr keeps all layers and the metadata; .png, .jpg and .jpeg hold the tone-mapped beauty (its
// R,G,B). In EXR (one part, ZIP) colours and normals (N) are half floats, P, Z, variance and whatever else
// holds values are floats, ids are uint32. A half layer with a finite value beyond 65000 becomes float as a
// whole, so that nothing overflows. NaN and infinity are kept. Writes a temporary beside `file`, then
// renames. Throws Error on an unknown extension, layers whose sizes do not fit, a missing beauty (.png, .jpg)
// or a place that cannot be written.
void write_image(const Image& image, const std::filesystem::path& file, const ToneMap& tone = {});

// Any image that OpenImageIO reads; of files with several parts, the first. Root channels R,G,B,A make the
// beauty, every other layer keeps its name; layers follow in the file's order. Integer images (8 or 16 bits)
// are decoded from sRGB to linear unless the file says that they are linear, and premultiplied; one-channel
// images fill R, G and B. Throws Error naming the file.
Image read_image(const std::filesystem::path& file);

}  // namespace lumigrove
