// The outer layer of a glTF asset: container (.gltf or .glb), JSON, buffers and image sources, all checked.
// tinygltf parses the JSON; files are read here, so that nothing outside the asset's folder is ever opened.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "scene/tinygltf.h"

namespace lumigrove {

struct GltfImage {
  std::string name;  // as given, else its path, else its number
  std::string uri;   // data URI or relative path; empty when a buffer view holds the image
  int buffer_view = -1;
};

struct GltfFile {
  std::string name;  // path as given, starts every message
  std::filesystem::path folder;
  tinygltf::Model model;                            // without buffers, images and skins
  std::vector<std::vector<unsigned char>> buffers;  // of the declared length
  std::vector<GltfImage> images;
  std::vector<std::string> warnings;  // complete sentences
};

// Reads and checks the container. Throws Error naming the file, for unknown required extensions too.
GltfFile read_gltf_file(const std::filesystem::path& file);

// The bytes of a buffer view. Throws Error when it does not exist or leaves its buffer.
std::span<const unsigned char> view_bytes(const GltfFile& file, int buffer_view);

// The encoded bytes of an image; `storage` keeps them alive when they do not lie in a buffer.
std::span<const unsigned char> image_bytes(const GltfFile& file, const GltfImage& image,
                                           std::vector<unsigned char>& storage);

// Elements of an accessor as floats, `components` each (normalized integers mapped to [0,1] or [-1,1], others
// as they are), sparse substitution included. `what` names the use in messages. Throws Error when the
// accessor does not exist, has another shape, or reads outside its buffer view.
std::vector<float> read_floats(const GltfFile& file, int accessor, int components, const std::string& what);

// A scalar accessor of unsigned integers.
std::vector<std::uint32_t> read_indices(const GltfFile& file, int accessor, const std::string& what);

// Number of components of the accessor's elements (VEC3: 3). Throws Error when it does not exist.
int component_count(const GltfFile& file, int accessor, const std::string& what);

}  // namespace lumigrove
