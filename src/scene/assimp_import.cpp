// OBJ, PLY, FBX and the other formats of Assimp: parsed in a guarded child process, then textures are loaded
// here.
#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "base/guarded_call.h"
#include "scene/asset_files.h"
#include "scene/assimp_reader.h"
#include "scene/image_decode.h"
#include "scene/import.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

void check_file(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) throw Error(fmt::format("{}: no such file", file.string()));
  if (!fs::is_regular_file(file, error)) throw Error(fmt::format("{}: not a regular file", file.string()));
  const std::string extension = lower_case_extension(file);
  if (!assimp_reads(extension))
    throw Error(fmt::format("{}: scenes of type '{}' cannot be read (supported: .gltf, .glb, {})",
                            file.string(), extension, assimp_extensions()));
  if (fs::file_size(file, error) == 0 && !error)
    throw Error(fmt::format("{}: the file is empty", file.string()));
}

// Assimp 5.2 waits for ever for the end of an unfinished PLY header and believes every element count in it.
void check_ply(const fs::path& file) {
  constexpr std::size_t kLongestHeader = 1 << 16;
  std::string header(kLongestHeader, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(header.data(), static_cast<std::streamsize>(header.size()));
  header.resize(static_cast<std::size_t>(stream.gcount()));
  std::istringstream lines(header);
  double elements = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string keyword, name;
    double count = 0;
    words >> keyword;
    if (keyword == "end_header") {
      if (elements <= static_cast<double>(fs::file_size(file))) return;
      throw Error(fmt::format("{}: the header promises {} elements, more than the file can hold",
                              file.string(), elements));
    }
    if (keyword == "element" && words >> name >> count) elements += count;
  }
  throw Error(fmt::format("{}: the PLY header has no end", file.string()));
}

// Far more than a sound file needs: Assimp parses some 10 MB a second into some 20 times the memory.
GuardLimits limits_for(const fs::path& file) {
  const double megabytes = static_cast<double>(fs::file_size(file)) * 1e-6;
  GuardLimits limits;
  limits.cpu_seconds = 10 + 2 * megabytes;
  limits.memory_bytes = (std::size_t{1} << 30) + static_cast<std::size_t>(200e6 * megabytes);
  return limits;
}

// Authoring tools on Windows write full paths of their own disk. Such a path means nothing here; the file of
// that name in the scene's folder is what travelled with the scene.
std::string without_drive(const std::string& reference) {
  if (reference.size() < 3 || reference[1] != ':') return reference;
  return reference.substr(reference.find_last_of("\\/:") + 1);
}

class TextureLoader {
 public:
  TextureLoader(ForeignScene& foreign, const fs::path& file) : foreign_(foreign), file_(file) {}

  Image8or32 load(const ForeignTexture& texture);

 private:
  Image8or32 load_file(int index, bool srgb);
  Image8or32 with_opacity(const ForeignTexture& texture);
  Image8or32 packed_surface(const ForeignTexture& texture);

  ForeignScene& foreign_;
  const fs::path& file_;
};

Image8or32 TextureLoader::load_file(int index, bool srgb) {
  const ForeignFile& source = foreign_.files[static_cast<std::size_t>(index)];
  if (source.width > 0)
    return {.name = source.reference,
            .width = source.width,
            .height = source.height,
            .srgb = srgb,
            .texels8 = source.embedded,
            .texels32 = {}};
  const std::string label = fmt::format("{}: texture {}", file_.string(), source.reference);
  Image8or32 image;
  if (!source.embedded.empty()) {
    image = decode_image(source.embedded, label, srgb);
  } else {
    const std::string reference = without_drive(source.reference);
    const fs::path path = resolve_inside(file_.parent_path(), reference, file_.string() + ": texture");
    image = decode_image(read_file(path), label, srgb);
    if (reference != source.reference)
      foreign_.scene.warnings.push_back(fmt::format("{}: for texture '{}' the file '{}' was taken",
                                                    file_.string(), source.reference, reference));
  }
  image.name = source.reference;
  return image;
}

// Channel as stored, in [0,1] for 8-bit images.
float stored(const Image8or32& image, int x, int y, int channel) {
  const std::size_t at = 4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                              static_cast<std::size_t>(x)) +
                         static_cast<std::size_t>(channel);
  return image.texels8.empty() ? image.texels32[at] : static_cast<float>(image.texels8[at]) / 255.0f;
}

// The same channel of an image that covers a grid of another size: the texel at the middle of each cell.
float stored_at(const Image8or32& image, const Image8or32& grid, int x, int y, int channel) {
  const auto scaled = [](int i, int from, int to) {
    return static_cast<int>((2 * std::int64_t{i} + 1) * to / (2 * std::int64_t{from}));
  };
  return stored(image, scaled(x, grid.width, image.width), scaled(y, grid.height, image.height), channel);
}

// A new image of 8 bits when `model` has 8, else of floats; `texel(x, y, channel)` gives stored values.
template <class Texel>
Image8or32 make_image(const Image8or32& model, int width, int height, Texel&& texel) {
  Image8or32 image{.name = model.name,
                   .width = width,
                   .height = height,
                   .srgb = model.srgb,
                   .texels8 = {},
                   .texels32 = {}};
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int channel = 0; channel < 4; ++channel) {
        const float value = texel(image, x, y, channel);
        if (model.texels8.empty())
          image.texels32.push_back(value);
        else
          image.texels8.push_back(
              static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0f, 1.0f))));
      }
  return image;
}

bool has_alpha(const Image8or32& image) {
  for (std::size_t i = 3; i < image.texels8.size(); i += 4)
    if (image.texels8[i] != 255) return true;
  for (std::size_t i = 3; i < image.texels32.size(); i += 4)
    if (image.texels32[i] != 1.0f) return true;
  return false;
}

// An opacity map speaks through its alpha channel if it has one, otherwise through its grey.
Image8or32 TextureLoader::with_opacity(const ForeignTexture& texture) {
  const Image8or32 opacity = load_file(texture.opacity, false);
  const int channel = has_alpha(opacity) ? 3 : 0;
  const Image8or32 white{.name = opacity.name,
                         .width = 1,
                         .height = 1,
                         .srgb = texture.srgb,
                         .texels8 = {255, 255, 255, 255},
                         .texels32 = {}};
  const Image8or32 color = texture.color >= 0 ? load_file(texture.color, texture.srgb) : white;
  return make_image(color, std::max(color.width, opacity.width), std::max(color.height, opacity.height),
                    [&](const Image8or32& grid, int x, int y, int c) {
                      return c == 3 ? stored_at(opacity, grid, x, y, channel)
                                    : stored_at(color, grid, x, y, c);
                    });
}

// glTF's layout: roughness in green, metalness in blue. One file in both slots is laid out so already.
Image8or32 TextureLoader::packed_surface(const ForeignTexture& texture) {
  if (texture.roughness == texture.metallic) return load_file(texture.roughness, false);
  const Image8or32 none{
      .name = {}, .width = 1, .height = 1, .srgb = false, .texels8 = {255, 255, 255, 255}, .texels32 = {}};
  const Image8or32 roughness = texture.roughness >= 0 ? load_file(texture.roughness, false) : none;
  const Image8or32 metallic = texture.metallic >= 0 ? load_file(texture.metallic, false) : none;
  return make_image(texture.roughness >= 0 ? roughness : metallic, std::max(roughness.width, metallic.width),
                    std::max(roughness.height, metallic.height),
                    [&](const Image8or32& grid, int x, int y, int c) {
                      if (c == 1) return stored_at(roughness, grid, x, y, 0);
                      return c == 2 ? stored_at(metallic, grid, x, y, 0) : 1.0f;
                    });
}

Image8or32 TextureLoader::load(const ForeignTexture& texture) {
  if (texture.roughness >= 0 || texture.metallic >= 0) return packed_surface(texture);
  return texture.opacity >= 0 ? with_opacity(texture) : load_file(texture.color, texture.srgb);
}

}  // namespace

Scene import_assimp(const fs::path& file) {
  check_file(file);
  if (lower_case_extension(file) == ".ply") check_ply(file);
  const std::vector<std::uint8_t> bytes =
      call_guarded(file.string() + ": Assimp, reading it,", limits_for(file), [&] {
        ForeignScene foreign = read_with_assimp(file);
        return to_bytes(foreign);
      });
  ForeignScene foreign = from_bytes(bytes);
  TextureLoader loader(foreign, file);
  for (const ForeignTexture& texture : foreign.textures) foreign.scene.images.push_back(loader.load(texture));
  Scene scene = std::move(foreign.scene);
  if (scene.meshes.empty() && scene.lights.empty())
    throw Error(fmt::format("{}: contains neither triangles nor lights", file.string()));
  validate(scene);
  return scene;
}

}  // namespace lumigrove
