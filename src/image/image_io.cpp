#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include "base/atomic_file.h"
#include "base/srgb.h"
#include "image/png_check.h"
#include "lumigrove/image.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;
using OIIO::TypeDesc;

constexpr std::string_view kMetadataPrefix = "lumigrove:";
constexpr float kLargestHalf = 65000;  // 65504 is the last finite half; keep clear of rounding
constexpr std::int64_t kMostValues = std::int64_t{1} << 29;  // of an image in a file: 2 GiB as floats

enum class Format { kExr, kPng, kJpeg };

std::string lower_extension(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

Format format_of(const fs::path& file) {
  const std::string extension = lower_extension(file);
  if (extension == ".exr") return Format::kExr;
  if (extension == ".png") return Format::kPng;
  if (extension == ".jpg" || extension == ".jpeg") return Format::kJpeg;
  throw Error(fmt::format("{}: unknown image extension '{}'; valid are .exr, .png, .jpg and .jpeg",
                          file.string(), extension));
}

// OpenImageIO converts pixels on the calling thread; OpenEXR packs and unpacks with as many threads as oneTBB may use
// here. Neither changes a bit.
void limit_threads() {
  OIIO::attribute("threads", 1);
  OIIO::attribute("exr_threads", tbb::this_task_arena::max_concurrency());
}

// OpenImageIO's messages may have several lines; ours have one.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

[[noreturn]] void fail_write(const fs::path& file, const std::string& reason) {
  throw Error(fmt::format("{}: cannot be written: {}", file.string(), first_line(reason)));
}
[[noreturn]] void fail_read(const fs::path& file, const std::string& reason) {
  throw Error(fmt::format("{}: cannot be read: {}", file.string(), first_line(reason)));
}

// --- layers and channels
// ----------------------------------------------------------------------------------------

bool is_color(const std::string& channel) {
  return channel == "R" || channel == "G" || channel == "B" || channel == "A" || channel == "Y";
}

std::string file_channel(const Layer& layer, const std::string& channel) {
  if (layer.name.empty() || (layer.channels.size() == 1 && layer.name == channel)) return channel;
  return layer.name + "." + channel;
}

TypeDesc stored_type(const Layer& layer) {
  if (!layer.ids.empty()) return TypeDesc::UINT;
  const bool half =
      layer.name == "N" ||
      (layer.name != "variance" && std::all_of(layer.channels.begin(), layer.channels.end(), is_color));
  const bool fits = std::none_of(layer.values.begin(), layer.values.end(), [](float value) {
    return std::isfinite(value) && std::abs(value) > kLargestHalf;
  });
  return half && fits ? TypeDesc::HALF : TypeDesc::FLOAT;
}

void check_sizes(const Image& image, const fs::path& file) {
  if (image.width <= 0 || image.height <= 0)
    fail_write(file, fmt::format("the image is {}x{} pixels", image.width, image.height));
  const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if (image.layers.empty()) fail_write(file, "the image has no layers");
  std::size_t channels = 0;
  for (const Layer& layer : image.layers) {
    channels += layer.channels.size();
    const std::size_t wanted = pixels * layer.channels.size();
    const bool values_fit = layer.values.size() == wanted && layer.ids.empty();
    const bool ids_fit = layer.ids.size() == wanted && layer.values.empty();
    if (wanted == 0 || (!values_fit && !ids_fit))
      fail_write(file, fmt::format("layer '{}' does not have the size of the image", layer.name));
  }
  if (pixels > static_cast<std::size_t>(kMostValues) / channels)
    fail_write(file,
               fmt::format("{}x{} pixels of {} channels are too many", image.width, image.height, channels));
}

// --- writing
// ----------------------------------------------------------------------------------------------------

// Pixels of one layer in its stored type, interleaved as in the layer.
std::vector<std::byte> convert_layer(const Layer& layer, TypeDesc type) {
  const bool ids = !layer.ids.empty();
  const std::size_t count = ids ? layer.ids.size() : layer.values.size();
  std::vector<std::byte> bytes(count * type.size());
  const void* source = ids ? static_cast<const void*>(layer.ids.data()) : layer.values.data();
  OIIO::convert_types(ids ? TypeDesc::UINT : TypeDesc::FLOAT, source, type, bytes.data(),
                      static_cast<int>(count));
  return bytes;
}

// All layers side by side, as OpenImageIO wants pixels of mixed channel types.
std::vector<std::byte> interleave(const Image& image, const std::vector<TypeDesc>& layer_types,
                                  std::size_t pixel_bytes) {
  const std::size_t pixels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  std::vector<std::byte> interleaved(pixels * pixel_bytes);
  std::size_t offset = 0;
  for (std::size_t l = 0; l < image.layers.size(); ++l) {
    const std::vector<std::byte> layer = convert_layer(image.layers[l], layer_types[l]);
    const std::size_t bytes = image.layers[l].channels.size() * layer_types[l].size();
    for (std::size_t p = 0; p < pixels; ++p)
      std::memcpy(&interleaved[p * pixel_bytes + offset], &layer[p * bytes], bytes);
    offset += bytes;
  }
  return interleaved;
}

void add_metadata(OIIO::ImageSpec& spec, const Image& image) {
  for (const auto& [key, value] : image.metadata) spec.attribute(std::string(kMetadataPrefix) + key, value);
}

std::vector<std::uint8_t> encode(const fs::path& file, const char* format_name, const OIIO::ImageSpec& spec,
                                 TypeDesc given, const void* pixels) {
  std::vector<std::uint8_t> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  const auto output = OIIO::ImageOutput::create(format_name, &memory);
  if (!output) fail_write(file, OIIO::geterror());
  if (!output->open(format_name, spec) || !output->write_image(given, pixels) || !output->close())
    fail_write(file, output->geterror());
  return bytes;
}

std::vector<std::uint8_t> encode_exr(const Image& image, const fs::path& file) {
  OIIO::ImageSpec spec(image.width, image.height, 0, TypeDesc::FLOAT);
  std::vector<TypeDesc> layer_types;
  for (const Layer& layer : image.layers) {
    layer_types.push_back(stored_type(layer));
    for (const std::string& channel : layer.channels) {
      spec.channelnames.push_back(file_channel(layer, channel));
      spec.channelformats.push_back(layer_types.back());
    }
  }
  spec.nchannels = static_cast<int>(spec.channelnames.size());
  spec.attribute("compression", "zip");
  add_metadata(spec, image);
  const std::vector<std::byte> pixels = interleave(image, layer_types, spec.pixel_bytes(true));
  return encode(file, "lumigrove.exr", spec, TypeDesc::UNKNOWN, pixels.data());
}

// R,G,B of the beauty.
std::vector<float> beauty_rgb(const Image& image, const fs::path& file) {
  const Layer* beauty = image.find("");
  const std::size_t channels = beauty ? beauty->channels.size() : 0;
  if (channels < 3 || beauty->values.empty() || beauty->channels[0] != "R" || beauty->channels[1] != "G" ||
      beauty->channels[2] != "B")
    fail_write(file, "the image has no R,G,B channels to show");
  std::vector<float> rgb;
  rgb.reserve(beauty->values.size() / channels * 3);
  for (std::size_t at = 0; at < beauty->values.size(); at += channels)
    for (std::size_t c = 0; c < 3; ++c) rgb.push_back(beauty->values[at + c]);
  return rgb;
}

std::vector<std::uint8_t> encode_8bit(const Image& image, const fs::path& file, const ToneMap& tone,
                                      Format format) {
  const std::vector<float> encoded = tone_map(beauty_rgb(image, file), tone);
  std::vector<std::uint8_t> pixels(encoded.size());
  std::transform(encoded.begin(), encoded.end(), pixels.begin(),
                 [](float value) { return static_cast<std::uint8_t>(255 * value + 0.5f); });
  OIIO::ImageSpec spec(image.width, image.height, 3, TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  if (format == Format::kJpeg) spec.attribute("Compression", "jpeg:95");
  if (format == Format::kPng) add_metadata(spec, image);
  return encode(file, format == Format::kPng ? "lumigrove.png" : "lumigrove.jpg", spec, TypeDesc::UINT8,
                pixels.data());
}

// --- reading
// ----------------------------------------------------------------------------------------------------

// One channel of a file and where it belongs.
struct FileChannel {
  int index = 0;
  bool id = false;
  std::string layer, channel;
};

FileChannel place_channel(const OIIO::ImageSpec& spec, int index) {
  FileChannel place;
  place.index = index;
  place.id = spec.channelformat(index) == TypeDesc::UINT;
  const std::string name = spec.channel_name(index);
  const std::size_t dot = name.rfind('.');
  if (dot != std::string::npos) {
    place.layer = name.substr(0, dot);
    place.channel = name.substr(dot + 1);
  } else {
    place.channel = name;
    if (!is_color(name) && name != "I") place.layer = name;
  }
  return place;
}

// Position of a channel inside its layer, whatever order the file has.
std::size_t channel_rank(const std::string& channel) {
  constexpr std::string_view kOrder = "IRGBXYZA";
  return channel.size() == 1 ? kOrder.find(channel) : std::string_view::npos;
}

std::vector<std::vector<FileChannel>> group_layers(const OIIO::ImageSpec& spec) {
  std::vector<std::vector<FileChannel>> layers;
  for (int c = 0; c < spec.nchannels; ++c) {
    const FileChannel place = place_channel(spec, c);
    const auto same = std::find_if(layers.begin(), layers.end(), [&](const std::vector<FileChannel>& layer) {
      return layer.front().layer == place.layer && layer.front().id == place.id;
    });
    if (same == layers.end())
      layers.push_back({place});
    else
      same->push_back(place);
  }
  for (auto& layer : layers)
    std::stable_sort(layer.begin(), layer.end(), [](const FileChannel& a, const FileChannel& b) {
      return channel_rank(a.channel) < channel_rank(b.channel);
    });
  std::stable_partition(layers.begin(), layers.end(),
                        [](const auto& layer) { return layer.front().layer.empty(); });
  return layers;
}

// The pixels of an open file, each channel in its own type.
struct FilePixels {
  std::vector<std::byte> bytes;
  std::size_t count = 0, stride = 0;  // pixels, bytes of one
};

FilePixels read_pixels(OIIO::ImageInput& input, const fs::path& file) {
  const OIIO::ImageSpec& spec = input.spec();
  FilePixels pixels;
  pixels.count = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height);
  pixels.stride = spec.pixel_bytes(true);
  pixels.bytes.resize(pixels.count * pixels.stride);
  if (!input.read_image(0, 0, 0, spec.nchannels, TypeDesc::UNKNOWN, pixels.bytes.data()))
    fail_read(file, input.geterror());
  return pixels;
}

// One channel of all pixels as T: float for values (integers scaled to [0,1]), uint32 for ids.
template <class T>
std::vector<T> channel_values(const OIIO::ImageSpec& spec, const FilePixels& pixels, int channel) {
  const TypeDesc type = spec.channelformat(channel);
  const std::size_t offset = spec.pixel_bytes(0, channel, true);
  std::vector<std::byte> stored(pixels.count * type.size());
  for (std::size_t p = 0; p < pixels.count; ++p)
    std::memcpy(&stored[p * type.size()], &pixels.bytes[p * pixels.stride + offset], type.size());
  std::vector<T> values(pixels.count);
  OIIO::convert_types(type, stored.data(), OIIO::BaseTypeFromC<T>::value, values.data(),
                      static_cast<int>(pixels.count));
  return values;
}

template <class T>
std::vector<T> layer_values(const OIIO::ImageSpec& spec, const FilePixels& pixels,
                            const std::vector<FileChannel>& places) {
  std::vector<T> interleaved(pixels.count * places.size());
  for (std::size_t c = 0; c < places.size(); ++c) {
    const std::vector<T> values = channel_values<T>(spec, pixels, places[c].index);
    for (std::size_t p = 0; p < pixels.count; ++p) interleaved[p * places.size() + c] = values[p];
  }
  return interleaved;
}

Layer make_layer(const OIIO::ImageSpec& spec, const FilePixels& pixels,
                 const std::vector<FileChannel>& places) {
  Layer layer;
  layer.name = places.front().layer;
  for (const FileChannel& place : places) layer.channels.push_back(place.channel);
  if (places.front().id)
    layer.ids = layer_values<std::uint32_t>(spec, pixels, places);
  else
    layer.values = layer_values<float>(spec, pixels, places);
  return layer;
}

// Y or I (and A) -> R,G,B (and A).
void expand_gray(Layer& beauty) {
  if (beauty.channels.front() != "Y" && beauty.channels.front() != "I") return;
  const std::size_t channels = beauty.channels.size();
  std::vector<float> values;
  values.reserve(beauty.values.size() / channels * (channels + 2));
  for (std::size_t at = 0; at < beauty.values.size(); at += channels) {
    values.insert(values.end(), 3, beauty.values[at]);
    for (std::size_t c = 1; c < channels; ++c) values.push_back(beauty.values[at + c]);
  }
  beauty.values = std::move(values);
  beauty.channels.erase(beauty.channels.begin());
  beauty.channels.insert(beauty.channels.begin(), {"R", "G", "B"});
}

// sRGB-encoded, not premultiplied -> linear, premultiplied.
void decode_srgb(Layer& beauty) {
  const std::size_t channels = beauty.channels.size();
  const bool alpha = beauty.channels.back() == "A";
  for (std::size_t at = 0; at < beauty.values.size(); at += channels)
    for (std::size_t c = 0; c + (alpha ? 1 : 0) < channels; ++c)
      beauty.values[at + c] =
          srgb_to_linear(beauty.values[at + c]) * (alpha ? beauty.values[at + channels - 1] : 1.0f);
}

bool holds_srgb(const OIIO::ImageSpec& spec) {
  const bool integer = spec.format == TypeDesc::UINT8 || spec.format == TypeDesc::UINT16;
  return integer && spec.get_string_attribute("oiio:ColorSpace") != "Linear";
}

// Before libpng complains in its own words.
void check_png(const fs::path& file) {
  std::vector<unsigned char> bytes(static_cast<std::size_t>(fs::file_size(file)));
  OIIO::Filesystem::read_bytes(file.string(), bytes.data(), bytes.size());
  if (const std::string damage = png_damage(bytes); !damage.empty()) fail_read(file, damage);
}

void read_metadata(const OIIO::ImageSpec& spec, Image& image) {
  for (const OIIO::ParamValue& attribute : spec.extra_attribs) {
    const std::string name = attribute.name().string();
    if (attribute.type() == TypeDesc::STRING && name.starts_with(kMetadataPrefix))
      image.metadata[name.substr(kMetadataPrefix.size())] = attribute.get_string();
  }
}

void check_readable(const OIIO::ImageSpec& spec, const fs::path& file) {
  if (spec.deep) fail_read(file, "it holds deep pixels, which are not supported");
  if (spec.width <= 0 || spec.height <= 0 || spec.depth > 1 || spec.nchannels <= 0)
    fail_read(file, fmt::format("it has {}x{}x{} pixels of {} channels", spec.width, spec.height, spec.depth,
                                spec.nchannels));
  if (std::int64_t{spec.width} * spec.height > kMostValues / spec.nchannels)
    fail_read(file, fmt::format("{}x{} pixels of {} channels are too many", spec.width, spec.height,
                                spec.nchannels));
}

}  // namespace

const Layer* Image::find(const std::string& layer_name) const {
  const auto found = std::find_if(layers.begin(), layers.end(),
                                  [&](const Layer& layer) { return layer.name == layer_name; });
  return found == layers.end() ? nullptr : &*found;
}

void write_image(const Image& image, const fs::path& file, const ToneMap& tone) {
  limit_threads();
  const Format format = format_of(file);
  check_sizes(image, file);
  write_file_atomically(
      file, format == Format::kExr ? encode_exr(image, file) : encode_8bit(image, file, tone, format));
}

Image read_image(const fs::path& file) {
  limit_threads();
  std::error_code error;
  if (!fs::exists(file, error)) fail_read(file, "there is no such file");
  if (!fs::is_regular_file(file, error)) fail_read(file, "it is not a regular file");
  if (lower_extension(file) == ".png") check_png(file);
  OIIO::ImageSpec options;
  options.attribute("oiio:UnassociatedAlpha", 1);
  const auto input = OIIO::ImageInput::open(file.string(), &options);
  if (!input) fail_read(file, OIIO::geterror());
  const OIIO::ImageSpec& spec = input->spec();
  check_readable(spec, file);
  const FilePixels pixels = read_pixels(*input, file);

  Image image;
  image.width = spec.width;
  image.height = spec.height;
  for (const auto& places : group_layers(spec)) image.layers.push_back(make_layer(spec, pixels, places));
  if (image.layers.front().name.empty() && !image.layers.front().values.empty()) {
    if (holds_srgb(spec)) decode_srgb(image.layers.front());
    expand_gray(image.layers.front());
  }
  read_metadata(spec, image);
  return image;
}

}  // namespace lumigrove
