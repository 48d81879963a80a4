// Pictures for a page: 8-bit pixels, encoded so that all of them fit a number of bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "metrics/metrics.h"

namespace lumigrove {

struct Picture {
  int width = 0, height = 0;
  int channels = 3;  // 1 or 3
  std::vector<std::uint8_t> pixels;
};

Picture companded(const RgbImage& image, float gain);
Picture gray_picture(const std::vector<float>& values, int width, int height);  // of values in [0,1]

Picture reduced(const Picture& picture, int by);  // means of by*by pixels, of fewer at the right and the bottom

// One way to embed pictures.
struct Encoding {
  int quality = 0;   // of JPEG, 4:4:4; 0: PNG
  int reduction = 1; // means of so many pixels a side become one
  std::string text() const;  // "JPEG of quality 92", "PNG at 1/2 size"
};

struct EncodedPicture {
  int width = 0, height = 0;
  const char* type = "";  // MIME
  std::vector<std::uint8_t> bytes;
};
EncodedPicture encode_picture(const Picture& picture, const Encoding& encoding);  // throws Error

struct EncodedPictures {
  Encoding encoding;
  std::vector<EncodedPicture> pictures;  // empty when not even the smallest fit
  std::size_t bytes = 0;                 // of all of them
};
// With the best encoding whose sum is at most `limit` bytes.
EncodedPictures encode_within(const std::vector<Picture>& pictures, std::size_t limit);

}  // namespace lumigrove
