#include "pictures.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <array>
#include <atomic>

#include "compand.h"
#include "lumigrove/error.h"

namespace lumigrove {
namespace {

// From the best to the smallest. Strong noise keeps its look at a low quality longer than at half the size.
constexpr std::array<Encoding, 11> kLadder = {
    {{0, 1}, {92, 1}, {85, 1}, {75, 1}, {60, 1}, {95, 2}, {85, 2}, {75, 2}, {75, 3}, {75, 4}, {70, 8}}};

// All pictures in one encoding; fewer than given when they exceed the limit.
EncodedPictures try_encoding(const std::vector<Picture>& pictures, const Encoding& encoding, std::size_t limit) {
  EncodedPictures result{encoding, std::vector<EncodedPicture>(pictures.size()), 0};
  std::atomic<std::size_t> bytes = 0;
  tbb::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t i) {
    if (bytes > limit) return;
    result.pictures[i] = encode_picture(pictures[i], encoding);
    bytes += result.pictures[i].bytes.size();
  });
  result.bytes = bytes;
  if (bytes > limit) result.pictures.clear();
  return result;
}

}  // namespace

std::string Encoding::text() const {
  const std::string format = quality == 0 ? "PNG" : fmt::format("JPEG of quality {}", quality);
  return reduction == 1 ? format : fmt::format("{} at 1/{} of the width and height", format, reduction);
}

Picture companded(const RgbImage& image, float gain) {
  Picture picture{image.width, image.height, 3, {}};
  picture.pixels.reserve(image.rgb.size());
  for (const float value : image.rgb) picture.pixels.push_back(compand(value, gain));
  return picture;
}

Picture gray_picture(const std::vector<float>& values, int width, int height) {
  Picture picture{width, height, 1, {}};
  picture.pixels.reserve(values.size());
  for (const float value : values)
    picture.pixels.push_back(static_cast<std::uint8_t>(255 * std::clamp(value, 0.0f, 1.0f) + 0.5f));
  return picture;
}

Picture reduced(const Picture& picture, int by) {
  if (by == 1) return picture;
  Picture small{(picture.width + by - 1) / by, (picture.height + by - 1) / by, picture.channels, {}};
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x)
      for (int c = 0; c < picture.channels; ++c) {
        int sum = 0, count = 0;
        for (int v = y * by; v < std::min((y + 1) * by, picture.height); ++v)
          for (int u = x * by; u < std::min((x + 1) * by, picture.width); ++u, ++count)
            sum += picture.pixels[(static_cast<std::size_t>(v) * picture.width + u) * picture.channels + c];
        small.pixels.push_back(static_cast<std::uint8_t>((sum + count / 2) / count));
      }
  return small;
}

EncodedPicture encode_picture(const Picture& picture, const Encoding& encoding) {
  const Picture small = reduced(picture, encoding.reduction);
  const bool png = encoding.quality == 0;
  const char* name = png ? "lumigrove.png" : "lumigrove.jpg";
  EncodedPicture encoded{small.width, small.height, png ? "image/png" : "image/jpeg", {}};
  OIIO::Filesystem::IOVecOutput memory(encoded.bytes);
  const auto output = OIIO::ImageOutput::create(name, &memory);
  if (!output) throw Error(fmt::format("a picture of the report cannot be encoded: {}", OIIO::geterror()));
  OIIO::ImageSpec spec(small.width, small.height, small.channels, OIIO::TypeDesc::UINT8);
  if (!png) {
    spec.attribute("Compression", fmt::format("jpeg:{}", encoding.quality));
    spec.attribute("jpeg:subsampling", "4:4:4");
  }
  if (!output->open(name, spec) || !output->write_image(OIIO::TypeDesc::UINT8, small.pixels.data()) || !output->close())
    throw Error(fmt::format("a picture of the report cannot be encoded: {}", output->geterror()));
  return encoded;
}

EncodedPictures encode_within(const std::vector<Picture>& pictures, std::size_t limit) {
  for (const Encoding& encoding : kLadder) {
    EncodedPictures result = try_encoding(pictures, encoding, limit);
    if (result.bytes <= limit) return result;
  }
  return {};
}

}  // namespace lumigrove
