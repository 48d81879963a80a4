#include "scene/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "lumigrove/error.h"
#include "scene/asset_files.h"

namespace lumigrove {
namespace {

using Json = nlohmann::json;
using Bytes = std::vector<unsigned char>;

constexpr std::array<std::string_view, 4> kKnownExtensions = {
    "KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_texture_transform",
    "KHR_mesh_quantization"};
// tinygltf and the JSON writer recurse; no real asset nests deeper.
constexpr int kDeepestNesting = 200;

// --- container
// -----------------------------------------------------------------------------------------------

struct Container {
  std::span<const unsigned char> json;
  std::optional<std::span<const unsigned char>> binary;  // BIN chunk of a .glb
};

std::uint32_t little_endian_u32(std::span<const unsigned char> bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 4; k-- > 0;) value = value << 8 | bytes[at + k];
  return value;
}

bool is_glb(std::span<const unsigned char> bytes) {
  return bytes.size() >= 4 && std::memcmp(bytes.data(), "glTF", 4) == 0;
}

Container split_glb(std::span<const unsigned char> bytes, const std::string& name) {
  constexpr std::uint32_t kJson = 0x4e4f534a, kBin = 0x004e4942;
  constexpr std::size_t kHeader = 12, kChunkHeader = 8;
  const auto truncated = [&] {
    return Error(fmt::format("{}: the .glb file is truncated or damaged", name));
  };
  if (bytes.size() < kHeader + kChunkHeader) throw truncated();
  if (little_endian_u32(bytes, 4) != 2)
    throw Error(fmt::format("{}: .glb version {} is not supported", name, little_endian_u32(bytes, 4)));
  const std::size_t length = little_endian_u32(bytes, 8);
  if (length > bytes.size()) throw truncated();
  Container container;
  for (std::size_t at = kHeader; at + kChunkHeader <= length;) {
    const std::size_t size = little_endian_u32(bytes, at);
    const std::uint32_t type = little_endian_u32(bytes, at + 4);
    if (size > length - at - kChunkHeader) throw truncated();
    const std::span<const unsigned char> chunk = bytes.subspan(at + kChunkHeader, size);
    const bool first = at == kHeader;
    if (first != (type == kJson)) throw truncated();  // exactly the first chunk is JSON
    if (first) container.json = chunk;
    if (type == kBin && !container.binary) container.binary = chunk;
    at += kChunkHeader + size;
  }
  return container;
}

Json parse_json(std::span<const unsigned char> text, const std::string& name) {
  const auto shallow = [&](int depth, Json::parse_event_t, Json&) {
    if (depth > kDeepestNesting) throw Error(fmt::format("{}: the JSON is nested too deeply", name));
    return true;
  };
  try {
    Json json = Json::parse(text.begin(), text.end(), shallow);
    if (!json.is_object()) throw Error(fmt::format("{}: not a glTF asset (the JSON is not an object)", name));
    return json;
  } catch (const Json::parse_error& error) {
    throw Error(fmt::format("{}: not valid JSON near byte {}", name, error.byte));
  } catch (const Json::exception&) {
    throw Error(fmt::format("{}: the JSON holds a number that is out of range", name));
  }
}

// --- JSON in typed steps
// -------------------------------------------------------------------------------------

// Member `key` of an object as an array; an empty array when absent.
Json take_array(Json& object, const char* key, const std::string& name) {
  const auto found = object.find(key);
  if (found == object.end()) return Json::array();
  if (!found->is_array()) throw Error(fmt::format("{}: '{}' is not an array", name, key));
  Json array = std::move(*found);
  object.erase(found);
  return array;
}

std::string string_member(const Json& object, const char* key, const std::string& where) {
  const auto found = object.find(key);
  if (found == object.end()) return {};
  if (!found->is_string()) throw Error(fmt::format("{}: '{}' is not a string", where, key));
  return found->get<std::string>();
}

// Members that must be arrays or objects further down, checked before tinygltf walks them.
void check_shapes(const Json& json, const std::string& name) {
  for (const char* key : {"accessors", "animations", "buffers", "bufferViews", "cameras", "images",
                          "materials", "meshes", "nodes", "samplers", "scenes", "skins", "textures"}) {
    const auto found = json.find(key);
    if (found == json.end()) continue;
    if (!found->is_array()) throw Error(fmt::format("{}: '{}' is not an array", name, key));
    for (const Json& element : *found)
      if (!element.is_object())
        throw Error(fmt::format("{}: '{}' holds something that is not an object", name, key));
  }
}

void check_version(const Json& json, const std::string& name) {
  const auto asset = json.find("asset");
  if (asset == json.end() || !asset->is_object())
    throw Error(fmt::format("{}: not a glTF asset ('asset' is missing)", name));
  // A number (glTF 1.0 had one) is shown as it is.
  const auto found = asset->find("version");
  const std::string version = found == asset->end() ? ""
                              : found->is_string()  ? found->get<std::string>()
                                                    : found->dump(-1, ' ', true);
  const std::string minimum = string_member(*asset, "minVersion", name);
  if (version.rfind("2.", 0) != 0)
    throw Error(fmt::format("{}: glTF version '{}' is not supported, only 2.x", name, version));
  if (!minimum.empty() && minimum != "2.0")
    throw Error(fmt::format("{}: needs glTF {}, which is not supported", name, minimum));
}

std::vector<std::string> extension_names(const Json& json, const char* key, const std::string& name) {
  std::vector<std::string> names;
  const auto found = json.find(key);
  if (found == json.end()) return names;
  for (const Json& extension : *found) {
    if (!extension.is_string()) throw Error(fmt::format("{}: '{}' is not an array of strings", name, key));
    names.push_back(extension.get<std::string>());
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

void check_extensions(const Json& json, GltfFile& file) {
  const auto supported = [](const std::string& extension) {
    return std::find(kKnownExtensions.begin(), kKnownExtensions.end(), extension) != kKnownExtensions.end();
  };
  for (const std::string& extension : extension_names(json, "extensionsRequired", file.name))
    if (!supported(extension))
      throw Error(fmt::format("{}: requires the extension {}, which is not supported", file.name, extension));
  for (const std::string& extension : extension_names(json, "extensionsUsed", file.name))
    if (!supported(extension))
      file.warnings.push_back(
          fmt::format("{}: the extension {} is not supported and is ignored", file.name, extension));
}

// --- buffers and images
// --------------------------------------------------------------------------------------

int base64_value(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+' || c == '-') return 62;  // '-' and '_': the URL-safe alphabet
  if (c == '/' || c == '_') return 63;
  return -1;
}

Bytes base64_decode(std::string_view text, const std::string& where) {
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  Bytes bytes;
  bytes.reserve(text.size() * 3 / 4);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const int value = base64_value(c);
    if (value < 0) throw Error(fmt::format("{}: the data URI is not valid base64", where));
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    if ((count += 6) >= 8) bytes.push_back(static_cast<unsigned char>(bits >> (count -= 8)));
  }
  return bytes;
}

bool is_data_uri(const std::string& uri) { return uri.rfind("data:", 0) == 0; }

// "data:image/png;base64,iVBOR..."
Bytes decode_data_uri(const std::string& uri, const std::string& where) {
  const std::string_view all(uri);
  const std::size_t comma = all.find(',');
  const std::string_view header = all.substr(0, comma);
  constexpr std::string_view kBase64 = ";base64";
  const bool base64 =
      header.size() >= kBase64.size() && header.substr(header.size() - kBase64.size()) == kBase64;
  if (comma == std::string_view::npos || !base64)
    throw Error(fmt::format("{}: only base64 data URIs are supported", where));
  return base64_decode(all.substr(comma + 1), where);
}

Bytes read_uri(const GltfFile& file, const std::string& uri, const std::string& where) {
  if (is_data_uri(uri)) return decode_data_uri(uri, where);
  return read_file(resolve_inside(file.folder, percent_decode(uri, where), where));
}

void load_buffers(Json& json, const Container& container, GltfFile& file) {
  const Json buffers = take_array(json, "buffers", file.name);
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const std::string where = fmt::format("{}: buffer {}", file.name, i);
    const std::string uri = string_member(buffers[i], "uri", where);
    const auto declared = buffers[i].find("byteLength");
    if (declared == buffers[i].end() || !declared->is_number_unsigned())
      throw Error(fmt::format("{}: 'byteLength' is missing or not a number", where));
    const std::size_t length = declared->get<std::size_t>();
    if (uri.empty() && (i > 0 || !container.binary)) throw Error(fmt::format("{}: has no data", where));
    Bytes bytes =
        uri.empty() ? Bytes(container.binary->begin(), container.binary->end()) : read_uri(file, uri, where);
    if (bytes.size() < length)
      throw Error(fmt::format("{}: holds {} bytes instead of {}", where, bytes.size(), length));
    bytes.resize(length);
    file.buffers.push_back(std::move(bytes));
  }
}

void list_images(Json& json, GltfFile& file) {
  const Json images = take_array(json, "images", file.name);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const std::string where = fmt::format("{}: image {}", file.name, i);
    GltfImage image{string_member(images[i], "name", where), string_member(images[i], "uri", where), -1};
    const auto view = images[i].find("bufferView");
    if (view != images[i].end() && view->is_number_unsigned() && *view < std::size_t{1} << 31)
      image.buffer_view = *view;
    if (image.uri.empty() == (image.buffer_view < 0))
      throw Error(fmt::format("{}: must have either a 'uri' or a 'bufferView'", where));
    if (image.name.empty())
      image.name = image.uri.empty() || is_data_uri(image.uri) ? fmt::format("image {}", i) : image.uri;
    file.images.push_back(std::move(image));
  }
}

// --- what is left out before tinygltf
// ------------------------------------------------------------------------

// Channels that a node's translation, rotation and scale cannot express.
void drop_foreign_channels(Json& json, GltfFile& file) {
  std::size_t morphs = 0, others = 0;
  const auto found = json.find("animations");
  if (found == json.end()) return;
  for (Json& animation : *found) {
    const auto channels = animation.find("channels");
    if (channels == animation.end() || !channels->is_array()) continue;
    Json kept = Json::array();
    for (Json& channel : *channels) {
      const Json target = channel.is_object() ? channel.value("target", Json::object()) : Json::object();
      const Json path = target.is_object() ? target.value("path", Json()) : Json();
      const bool has_node = target.is_object() && target.contains("node");
      if (path == "weights") {
        ++morphs;
      } else if (!has_node || (path != "translation" && path != "rotation" && path != "scale")) {
        ++others;
      } else {
        kept.push_back(std::move(channel));
      }
    }
    *channels = std::move(kept);
  }
  if (morphs > 0)
    file.warnings.push_back(
        fmt::format("{}: {} animation channels move morph targets and are ignored", file.name, morphs));
  if (others > 0)
    file.warnings.push_back(fmt::format(
        "{}: {} animation channels move something other than a node and are ignored", file.name, others));
}

std::vector<std::size_t> lengths(const Json& json, const char* outer, const char* inner) {
  std::vector<std::size_t> result;
  const auto found = json.find(outer);
  if (found == json.end()) return result;
  for (const Json& element : *found) {
    const auto list = element.find(inner);
    result.push_back(list != element.end() && list->is_array() ? list->size() : 0);
  }
  return result;
}

void parse_model(const Json& json, GltfFile& file) {
  // tinygltf drops what it cannot parse and goes on; counting tells.
  const std::vector<std::size_t> primitives = lengths(json, "meshes", "primitives");
  const std::vector<std::size_t> channels = lengths(json, "animations", "channels");
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() > std::numeric_limits<unsigned>::max())
    throw Error(fmt::format("{}: the JSON is larger than 4 GiB", file.name));
  tinygltf::TinyGLTF parser;
  std::string errors, warnings;
  const bool parsed = parser.LoadASCIIFromString(&file.model, &errors, &warnings, text.data(),
                                                 static_cast<unsigned>(text.size()), "");
  bool complete = parsed && errors.empty() && file.model.meshes.size() == primitives.size() &&
                  file.model.animations.size() == channels.size();
  for (std::size_t i = 0; complete && i < primitives.size(); ++i)
    complete = file.model.meshes[i].primitives.size() == primitives[i];
  for (std::size_t i = 0; complete && i < channels.size(); ++i)
    complete = file.model.animations[i].channels.size() == channels[i];
  if (complete) return;
  errors = errors.substr(0, errors.find('\n'));
  throw Error(
      fmt::format("{}: not valid glTF ({})", file.name, errors.empty() ? "an element is malformed" : errors));
}

// --- accessors
// -----------------------------------------------------------------------------------------------

const tinygltf::Accessor& find_accessor(const GltfFile& file, int index, const std::string& what) {
  if (index < 0 || static_cast<std::size_t>(index) >= file.model.accessors.size())
    throw Error(fmt::format("{}: {}: accessor {} does not exist", file.name, what, index));
  return file.model.accessors[static_cast<std::size_t>(index)];
}

std::size_t component_bytes(int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return 4;
    default:
      return 0;
  }
}

template <class T>
T load(const unsigned char* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return value;
}

// Section 3.11 "Animations" and KHR_mesh_quantization give the same rules: c / max, signed ones not below -1.
float load_float(const unsigned char* at, int type, bool normalized) {
  const auto scaled = [&](float value, float largest) {
    return normalized ? std::max(value / largest, -1.0f) : value;
  };
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return scaled(static_cast<float>(load<std::int8_t>(at)), 127);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return scaled(static_cast<float>(*at), 255);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return scaled(static_cast<float>(load<std::int16_t>(at)), 32767);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return scaled(static_cast<float>(load<std::uint16_t>(at)), 65535);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return static_cast<float>(load<std::uint32_t>(at));
    default:
      return load<float>(at);
  }
}

std::uint32_t load_index(const unsigned char* at, int type) {
  if (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) return *at;
  if (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) return load<std::uint16_t>(at);
  return load<std::uint32_t>(at);
}

bool is_index_type(int type) {
  return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
         type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

// `count` elements of `size` bytes, `stride` apart, that all lie inside a buffer view.
struct Elements {
  const unsigned char* first = nullptr;
  std::size_t stride = 0;
  const unsigned char* operator[](std::size_t i) const { return first + i * stride; }
};

Elements elements_of(const GltfFile& file, int buffer_view, std::size_t offset, std::size_t count,
                     std::size_t size, const std::string& what) {
  const std::span<const unsigned char> view = view_bytes(file, buffer_view);
  const std::size_t declared = file.model.bufferViews[static_cast<std::size_t>(buffer_view)].byteStride;
  const std::size_t stride = declared == 0 ? size : declared;
  const bool fits = count == 0 || (offset <= view.size() && size <= view.size() - offset &&
                                   (count - 1) <= (view.size() - offset - size) / stride);
  if (!fits || stride < size)
    throw Error(fmt::format("{}: {}: an accessor reads outside its buffer view", file.name, what));
  return {view.data() + (count == 0 ? 0 : offset), stride};
}

// Calls store(i, bytes) for every element, then again for those that a sparse accessor replaces.
template <class Store>
void visit_elements(const GltfFile& file, const tinygltf::Accessor& accessor, std::size_t size,
                    const std::string& what, const Store& store) {
  if (accessor.bufferView >= 0) {
    const Elements elements =
        elements_of(file, accessor.bufferView, accessor.byteOffset, accessor.count, size, what);
    for (std::size_t i = 0; i < accessor.count; ++i) store(i, elements[i]);
  }
  if (!accessor.sparse.isSparse) return;
  const auto& sparse = accessor.sparse;
  const int type = sparse.indices.componentType;
  if (sparse.count < 0 || sparse.indices.byteOffset < 0 || sparse.values.byteOffset < 0 ||
      !is_index_type(type))
    throw Error(fmt::format("{}: {}: a sparse accessor is malformed", file.name, what));
  const std::size_t count = static_cast<std::size_t>(sparse.count);
  const Elements indices =
      elements_of(file, sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset), count,
                  component_bytes(type), what);
  const Elements values = elements_of(file, sparse.values.bufferView,
                                      static_cast<std::size_t>(sparse.values.byteOffset), count, size, what);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = load_index(indices[i], type);
    if (at >= accessor.count)
      throw Error(
          fmt::format("{}: {}: a sparse accessor replaces an element that does not exist", file.name, what));
    store(at, values[i]);
  }
}

// Without a buffer view an accessor is all zeros, so that its size costs the file nothing.
constexpr std::size_t kLargestCountWithoutData = std::size_t{1} << 24;

void check_accessor_count(const GltfFile& file, const tinygltf::Accessor& accessor, const std::string& what) {
  // With data, the count is bounded by the bytes of the file when the elements are located.
  const std::size_t largest =
      accessor.bufferView >= 0 ? view_bytes(file, accessor.bufferView).size() : kLargestCountWithoutData;
  if (accessor.count > largest)
    throw Error(fmt::format("{}: {}: an accessor declares {} elements, more than there are", file.name, what,
                            accessor.count));
}

}  // namespace

std::span<const unsigned char> view_bytes(const GltfFile& file, int buffer_view) {
  if (buffer_view < 0 || static_cast<std::size_t>(buffer_view) >= file.model.bufferViews.size())
    throw Error(fmt::format("{}: buffer view {} does not exist", file.name, buffer_view));
  const tinygltf::BufferView& view = file.model.bufferViews[static_cast<std::size_t>(buffer_view)];
  if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= file.buffers.size())
    throw Error(fmt::format("{}: buffer view {} uses a buffer that does not exist", file.name, buffer_view));
  const Bytes& buffer = file.buffers[static_cast<std::size_t>(view.buffer)];
  if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset)
    throw Error(fmt::format("{}: buffer view {} reads outside its buffer", file.name, buffer_view));
  return std::span(buffer).subspan(view.byteOffset, view.byteLength);
}

std::span<const unsigned char> image_bytes(const GltfFile& file, const GltfImage& image, Bytes& storage) {
  if (image.uri.empty()) return view_bytes(file, image.buffer_view);
  storage = read_uri(file, image.uri, fmt::format("{}: {}", file.name, image.name));
  return storage;
}

int component_count(const GltfFile& file, int accessor, const std::string& what) {
  return tinygltf::GetNumComponentsInType(
      static_cast<std::uint32_t>(find_accessor(file, accessor, what).type));
}

std::vector<float> read_floats(const GltfFile& file, int index, int components, const std::string& what) {
  const tinygltf::Accessor& accessor = find_accessor(file, index, what);
  const std::size_t bytes = component_bytes(accessor.componentType);
  if (component_count(file, index, what) != components || bytes == 0)
    throw Error(fmt::format("{}: {}: accessor {} has the wrong type", file.name, what, index));
  check_accessor_count(file, accessor, what);
  const std::size_t width = static_cast<std::size_t>(components);
  std::vector<float> values(accessor.count * width, 0.0f);
  visit_elements(file, accessor, bytes * width, what, [&](std::size_t i, const unsigned char* element) {
    for (std::size_t c = 0; c < width; ++c)
      values[i * width + c] = load_float(element + c * bytes, accessor.componentType, accessor.normalized);
  });
  return values;
}

std::vector<std::uint32_t> read_indices(const GltfFile& file, int index, const std::string& what) {
  const tinygltf::Accessor& accessor = find_accessor(file, index, what);
  if (accessor.type != TINYGLTF_TYPE_SCALAR || !is_index_type(accessor.componentType))
    throw Error(fmt::format("{}: {}: accessor {} has the wrong type", file.name, what, index));
  check_accessor_count(file, accessor, what);
  std::vector<std::uint32_t> values(accessor.count, 0);
  visit_elements(file, accessor, component_bytes(accessor.componentType), what,
                 [&](std::size_t i, const unsigned char* element) {
                   values[i] = load_index(element, accessor.componentType);
                 });
  return values;
}

GltfFile read_gltf_file(const std::filesystem::path& path) {
  GltfFile file;
  file.name = path.string();
  file.folder = path.parent_path();
  const Bytes bytes = read_file(path);
  const Container container =
      is_glb(bytes) ? split_glb(bytes, file.name) : Container{std::span(bytes), std::nullopt};
  Json json = parse_json(container.json, file.name);
  check_version(json, file.name);
  check_shapes(json, file.name);
  check_extensions(json, file);
  load_buffers(json, container, file);
  list_images(json, file);
  if (!take_array(json, "skins", file.name).empty())
    file.warnings.push_back(
        fmt::format("{}: skins are not supported; meshes are drawn in their bind pose", file.name));
  drop_foreign_channels(json, file);
  parse_model(json, file);
  return file;
}

}  // namespace lumigrove
