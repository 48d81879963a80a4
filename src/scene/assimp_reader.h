// What Assimp makes of a file, as a scene whose images are still references. Assimp 5.2 can crash or hang on
// damaged files, so import_assimp runs this in a child process and hands the result over as bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "lumigrove/scene.h"

namespace lumigrove {

// An image file that materials refer to: a path as written in the scene file, or the file's bytes when
// embedded (with `width` > 0: bare RGBA texels).
struct ForeignFile {
  std::string reference;
  std::vector<std::uint8_t> embedded;
  int width = 0, height = 0;
};

// A texture to be made of the channels of up to four files (indices into ForeignScene::files, -1 none): RGB
// of `color`, alpha from `opacity`, green and blue from `roughness` and `metallic`.
struct ForeignTexture {
  int color = -1, opacity = -1, roughness = -1, metallic = -1;
  bool srgb = false;

  bool operator==(const ForeignTexture&) const = default;
};

struct ForeignScene {
  Scene scene;  // without images; TextureUse::image counts `textures`
  std::vector<ForeignFile> files;
  std::vector<ForeignTexture> textures;
};

// Parses `file` with Assimp in this process, reading only files inside its folder. Throws Error naming the
// file.
ForeignScene read_with_assimp(const std::filesystem::path& file);

// True for extensions (".obj", lower case) of the formats that are read through Assimp. Assimp knows more;
// these are in use, describe whole scenes or meshes, and its importers for them return sound data.
bool assimp_reads(const std::string& extension);

// ".obj, .ply, ..."
std::string assimp_extensions();

std::vector<std::uint8_t> to_bytes(ForeignScene& foreign);
ForeignScene from_bytes(const std::vector<std::uint8_t>& bytes);

}  // namespace lumigrove
