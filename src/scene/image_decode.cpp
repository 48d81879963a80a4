#include "scene/image_decode.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <array>
#include <cstring>
#include <string_view>

#include "base/srgb.h"
#include "image/png_check.h"

namespace lumigrove {
namespace {

constexpr int kLargestSide = 1 << 16;
constexpr std::int64_t kLargestPixelCount = std::int64_t{1} << 28;  // 1 GiB of 8-bit texels

struct Signature {
  std::size_t offset;
  std::string_view bytes;
  const char* extension;
};
using namespace std::string_view_literals;
constexpr std::array kSignatures = {
    Signature{0, "\x89PNG"sv, "png"},
    Signature{0, "\xff\xd8\xff"sv, "jpg"},
    Signature{0, "\x76\x2f\x31\x01"sv, "exr"},
    Signature{0, "#?"sv, "hdr"},
    Signature{8, "WEBP"sv, "webp"},
    Signature{0, "II*\0"sv, "tif"},
    Signature{0, "MM\0*"sv, "tif"},
    Signature{0, "GIF8"sv, "gif"},
    Signature{0, "DDS "sv, "dds"},
    Signature{0, "BM"sv, "bmp"},
};

// OpenImageIO chooses its reader by file name; the content is the better witness, the name serves formats
// without a signature (TGA).
std::string extension_of(std::span<const unsigned char> file, const std::string& name) {
  for (const Signature& s : kSignatures)
    if (file.size() >= s.offset + s.bytes.size() &&
        std::memcmp(file.data() + s.offset, s.bytes.data(), s.bytes.size()) == 0)
      return s.extension;
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? "" : name.substr(dot + 1);
}

std::string first_line_of(const std::string& text) { return text.substr(0, text.find('\n')); }

void check_size(const OIIO::ImageSpec& spec, const std::string& name) {
  const bool good = spec.width > 0 && spec.height > 0 && spec.depth <= 1 && spec.nchannels > 0 &&
                    spec.width <= kLargestSide && spec.height <= kLargestSide &&
                    std::int64_t{spec.width} * spec.height <= kLargestPixelCount;
  if (!good)
    throw Error(fmt::format("{}: an image of {} x {} pixels with {} channels cannot be used as a texture",
                            name, spec.width, spec.height, spec.nchannels));
}

template <class T>
std::vector<T> read_rgba(OIIO::ImageInput& input, OIIO::TypeDesc type, T opaque, const std::string& name) {
  const OIIO::ImageSpec spec = input.spec();
  const int channels = std::min(spec.nchannels, 4);
  const std::size_t pixels = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height);
  std::vector<T> raw(pixels * static_cast<std::size_t>(channels));
  if (!input.read_image(0, 0, 0, channels, type, raw.data())) {
    const std::string reason = first_line_of(input.geterror());
    throw Error(fmt::format("{}: the image is damaged ({})", name, reason));
  }
  if (channels == 4) return raw;
  std::vector<T> rgba(4 * pixels);
  const bool grey = channels <= 2, alpha = channels == 2;
  for (std::size_t p = 0; p < pixels; ++p) {
    const T* in = &raw[p * static_cast<std::size_t>(channels)];
    T* out = &rgba[4 * p];
    for (int c = 0; c < 3; ++c) out[c] = grey ? in[0] : in[c];
    out[3] = alpha ? in[1] : opaque;
  }
  return rgba;
}

}  // namespace

Image8or32 decode_image(std::span<const unsigned char> file, const std::string& name, bool srgb) {
  const std::string extension = extension_of(file, name);
  if (file.empty() || extension.empty()) throw Error(fmt::format("{}: not an image in a known format", name));
  if (const std::string damage = png_damage(file); !damage.empty())
    throw Error(fmt::format("{}: the image is damaged ({})", name, damage));
  OIIO::Filesystem::IOMemReader memory(file.data(), file.size());
  OIIO::ImageSpec config;
  config["oiio:UnassociatedAlpha"] = 1;
  void* proxy = &memory;
  config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open("memory." + extension, &config);
  if (!input)
    throw Error(fmt::format("{}: cannot be read as an image ({})", name, first_line_of(OIIO::geterror())));
  input->threads(1);
  check_size(input->spec(), name);
  Image8or32 image{.name = name,
                   .width = input->spec().width,
                   .height = input->spec().height,
                   .srgb = srgb,
                   .texels8 = {},
                   .texels32 = {}};
  const OIIO::TypeDesc format = input->spec().format;
  if (format == OIIO::TypeDesc::UINT8) {
    image.texels8 = read_rgba<std::uint8_t>(*input, OIIO::TypeDesc::UINT8, 255, name);
    return image;
  }
  image.texels32 = read_rgba<float>(*input, OIIO::TypeDesc::FLOAT, 1.0f, name);
  image.srgb = false;
  if (srgb && !format.is_floating_point())
    for (std::size_t i = 0; i < image.texels32.size(); ++i)
      if (i % 4 != 3) image.texels32[i] = srgb_to_linear(image.texels32[i]);
  return image;
}

}  // namespace lumigrove
