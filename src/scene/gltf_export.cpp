// Scene -> glTF 2.0. Arrays keep their order, so that reading the file back gives the same indices: scene
// mesh i is a primitive, nodes that show several meshes share one glTF mesh. What glTF cannot hold (the
// environment) goes to `extras` of the scene, where our importer finds it again.
#include <OpenImageIO/strutil.h>
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "base/atomic_file.h"
#include "base/vec.h"
#include "lumigrove/renderer.h"
#include "scene/asset_files.h"
#include "scene/image_encode.h"

namespace lumigrove {
namespace {

using Json = nlohmann::ordered_json;

// Constants of the glTF 2.0 specification (OpenGL's numbers).
constexpr int kFloat = 5126, kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr int kNearest = 9728, kLinear = 9729;
constexpr int kLinearMipmapLinear = 9987;
constexpr int kClampToEdge = 33071, kMirroredRepeat = 33648, kRepeat = 10497;
constexpr std::uint32_t kGlbMagic = 0x46546C67, kGlbVersion = 2, kGlbJson = 0x4E4F534A,
                        kGlbBinary = 0x004E4942;

constexpr int kNone = -1;

template <class Vector>
Json to_json(const Vector& v) {
  Json array = Json::array();
  for (int i = 0; i < v.length(); ++i) array.push_back(v[i]);
  return array;
}

// The smallest power of two that is at least `value`, and at least 1: dividing by it loses no bit.
float power_of_two_above(float value) {
  if (value <= 1) return 1;
  return std::exp2(std::ceil(std::log2(value)));
}

class GltfWriter {
 public:
  explicit GltfWriter(const Scene& scene) : scene_(scene) {}

  void write(const std::filesystem::path& file, bool binary);
  std::vector<std::string> take_warnings() { return std::move(warnings_); }

 private:
  // An image as a material slot sees it; 8-bit colour and emission are the same bytes.
  struct StoredImage {
    int index = kNone;
    float scale = 1;
  };

  Json document();
  void use_extension(const char* name) { extensions_.insert(name); }

  int append(const void* data, std::size_t bytes, int target = kNone);
  int add_accessor(const void* data, std::size_t count, std::size_t element_bytes, int component,
                   const char* type, int target);
  template <class T>
  int add_attribute(const std::vector<T>& values, const char* type);
  int add_keys(const std::vector<float>& times);
  int add_key_values(const AnimationChannel& channel);

  StoredImage store_image(int image, TextureContent content);
  int add_sampler(const TextureUse& use);
  int add_texture(int image, int sampler);
  Json texture_info(const TextureUse& use, int image);
  Json material(const Material& m);

  const Json& primitive(int mesh);
  int add_mesh(const std::vector<int>& meshes);
  void add_meshes();
  Json light(const PunctualLight& l);
  Json node(const Node& n, const std::vector<int>& children);
  void add_nodes();
  void add_animation(const Animation& animation);
  void add_environment();

  const Scene& scene_;
  std::vector<std::string> warnings_;
  std::vector<std::uint8_t> buffer_;
  std::set<std::string> extensions_;
  Json views_ = Json::array(), accessors_ = Json::array();
  Json images_ = Json::array(), samplers_ = Json::array(), textures_ = Json::array(),
       materials_ = Json::array();
  Json meshes_ = Json::array(), nodes_ = Json::array(), animations_ = Json::array();
  Json scene_extras_;
  std::map<std::pair<int, TextureContent>, StoredImage> stored_images_;
  std::map<std::pair<int, int>, int> texture_indices_;
  std::map<int, Json> primitives_;
  std::map<std::vector<int>, int> mesh_indices_;
  std::map<std::vector<float>, int> key_indices_;
};

// --- buffers and accessors
// -------------------------------------------------------------------------------------

int GltfWriter::append(const void* data, std::size_t bytes, int target) {
  const std::size_t offset = buffer_.size();
  const auto* first = static_cast<const std::uint8_t*>(data);
  buffer_.insert(buffer_.end(), first, first + bytes);
  buffer_.resize((buffer_.size() + 3) / 4 * 4);  // every view starts on a multiple of four
  Json view = {{"buffer", 0}, {"byteOffset", offset}, {"byteLength", bytes}};
  if (target != kNone) view["target"] = target;
  views_.push_back(std::move(view));
  return static_cast<int>(views_.size()) - 1;
}

int GltfWriter::add_accessor(const void* data, std::size_t count, std::size_t element_bytes, int component,
                             const char* type, int target) {
  accessors_.push_back({{"bufferView", append(data, count * element_bytes, target)},
                        {"componentType", component},
                        {"count", count},
                        {"type", type}});
  return static_cast<int>(accessors_.size()) - 1;
}

template <class T>
int GltfWriter::add_attribute(const std::vector<T>& values, const char* type) {
  return add_accessor(values.data(), values.size(), sizeof(T), kFloat, type, kArrayBuffer);
}

// Channels often share their keys; glTF asks for the bounds of every key accessor.
int GltfWriter::add_keys(const std::vector<float>& times) {
  const auto [at, is_new] = key_indices_.try_emplace(times, kNone);
  if (is_new) {
    at->second = add_accessor(times.data(), times.size(), sizeof(float), kFloat, "SCALAR", kNone);
    accessors_.back()["min"] = {times.front()};
    accessors_.back()["max"] = {times.back()};
  }
  return at->second;
}

int GltfWriter::add_key_values(const AnimationChannel& channel) {
  if (channel.property == AnimatedProperty::kRotation)
    return add_accessor(channel.values.data(), channel.values.size(), sizeof(vec4), kFloat, "VEC4", kNone);
  const std::vector<vec3> values(channel.values.begin(), channel.values.end());
  return add_accessor(values.data(), values.size(), sizeof(vec3), kFloat, "VEC3", kNone);
}

// --- images and materials
// --------------------------------------------------------------------------------------

GltfWriter::StoredImage GltfWriter::store_image(int image, TextureContent content) {
  const Image8or32& source = scene_.images[static_cast<std::size_t>(image)];
  // Only emission above 1 differs from colour.
  if (content == TextureContent::kEmission && !source.texels8.empty()) content = TextureContent::kColor;
  const auto [at, is_new] = stored_images_.try_emplace({image, content});
  if (!is_new) return at->second;
  const EncodedImage encoded = encode_png(source, content);
  if (encoded.rounded)
    warnings_.push_back(
        fmt::format("image '{}' is stored with 16 bits a channel: glTF has no float textures{}", source.name,
                    encoded.clamped ? ", and its values above 1 were clamped" : ""));
  Json json = {{"bufferView", append(encoded.bytes.data(), encoded.bytes.size())}, {"mimeType", "image/png"}};
  if (!source.name.empty()) json["name"] = source.name;
  images_.push_back(std::move(json));
  return at->second = {static_cast<int>(images_.size()) - 1, encoded.scale};
}

int wrap_code(Wrap wrap) {
  switch (wrap) {
    case Wrap::kClamp:
      return kClampToEdge;
    case Wrap::kMirror:
      return kMirroredRepeat;
    case Wrap::kRepeat:
      break;
  }
  return kRepeat;
}

int GltfWriter::add_sampler(const TextureUse& use) {
  const Json sampler = {{"magFilter", use.nearest ? kNearest : kLinear},
                        {"minFilter", use.nearest ? kNearest : kLinearMipmapLinear},
                        {"wrapS", wrap_code(use.wrap_u)},
                        {"wrapT", wrap_code(use.wrap_v)}};
  const auto found = std::find(samplers_.begin(), samplers_.end(), sampler);
  const int index = static_cast<int>(found - samplers_.begin());
  if (found == samplers_.end()) samplers_.push_back(sampler);
  return index;
}

int GltfWriter::add_texture(int image, int sampler) {
  const auto [at, is_new] =
      texture_indices_.try_emplace({image, sampler}, static_cast<int>(textures_.size()));
  if (is_new) textures_.push_back({{"sampler", sampler}, {"source", image}});
  return at->second;
}

Json GltfWriter::texture_info(const TextureUse& use, int image) {
  Json info = {{"index", add_texture(image, add_sampler(use))}};
  if (use.uv_set != 0) info["texCoord"] = use.uv_set;
  Json transform = Json::object();
  if (use.offset != vec2(0)) transform["offset"] = to_json(use.offset);
  if (use.rotation != 0) transform["rotation"] = use.rotation;
  if (use.scale != vec2(1)) transform["scale"] = to_json(use.scale);
  if (!transform.empty()) {
    use_extension("KHR_texture_transform");
    info["extensions"]["KHR_texture_transform"] = std::move(transform);
  }
  return info;
}

Json GltfWriter::material(const Material& m) {
  Json pbr = {{"baseColorFactor", to_json(vec4(m.base_color, m.alpha))},
              {"metallicFactor", m.metallic},
              {"roughnessFactor", m.roughness}};
  if (m.base_color_texture.image >= 0)
    pbr["baseColorTexture"] = texture_info(
        m.base_color_texture, store_image(m.base_color_texture.image, TextureContent::kColor).index);
  if (m.metallic_roughness_texture.image >= 0)
    pbr["metallicRoughnessTexture"] =
        texture_info(m.metallic_roughness_texture,
                     store_image(m.metallic_roughness_texture.image, TextureContent::kData).index);
  Json json = {{"pbrMetallicRoughness", std::move(pbr)}};
  if (!m.name.empty()) json["name"] = m.name;
  if (m.normal_texture.image >= 0) {
    json["normalTexture"] =
        texture_info(m.normal_texture, store_image(m.normal_texture.image, TextureContent::kData).index);
    json["normalTexture"]["scale"] = m.normal_scale;
  }
  vec3 emission = m.emission;
  if (m.emissive_texture.image >= 0) {
    const StoredImage stored = store_image(m.emissive_texture.image, TextureContent::kEmission);
    json["emissiveTexture"] = texture_info(m.emissive_texture, stored.index);
    emission *= stored.scale;
  }
  // emissiveFactor ends at 1; the rest is strength.
  const float strength = power_of_two_above(max_component(emission));
  if (emission != vec3(0)) json["emissiveFactor"] = to_json(emission / strength);
  if (strength != 1) {
    use_extension("KHR_materials_emissive_strength");
    json["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = strength;
  }
  if (m.alpha_mode == AlphaMode::kMask) {
    json["alphaMode"] = "MASK";
    json["alphaCutoff"] = m.alpha_cutoff;
  }
  if (m.double_sided) json["doubleSided"] = true;
  return json;
}

// --- meshes
// ----------------------------------------------------------------------------------------------------

// Written once, however many glTF meshes list it; null for a mesh without triangles.
const Json& GltfWriter::primitive(int mesh) {
  const auto [at, is_new] = primitives_.try_emplace(mesh);
  Json& json = at->second;
  if (!is_new) return json;
  const Mesh& m = scene_.meshes[static_cast<std::size_t>(mesh)];
  if (m.triangles.empty()) {
    warnings_.push_back(fmt::format("mesh '{}' has no triangles and is left out", m.name));
    return json;
  }
  Box3 bounds;
  for (const vec3 p : m.positions) bounds = unite(bounds, p);
  Json attributes = {{"POSITION", add_attribute(m.positions, "VEC3")}};
  accessors_.back()["min"] = to_json(bounds.lo);
  accessors_.back()["max"] = to_json(bounds.hi);
  if (!m.normals.empty()) attributes["NORMAL"] = add_attribute(m.normals, "VEC3");
  if (!m.tangents.empty()) attributes["TANGENT"] = add_attribute(m.tangents, "VEC4");
  if (!m.uv0.empty()) attributes["TEXCOORD_0"] = add_attribute(m.uv0, "VEC2");
  if (!m.uv1.empty()) attributes["TEXCOORD_1"] = add_attribute(m.uv1, "VEC2");
  if (!m.colors.empty()) attributes["COLOR_0"] = add_attribute(m.colors, "VEC4");
  json["attributes"] = std::move(attributes);
  json["indices"] = add_accessor(m.triangles.data(), 3 * m.triangles.size(), sizeof(std::uint32_t),
                                 kUnsignedInt, "SCALAR", kElementArrayBuffer);
  json["material"] = m.material;
  return json;
}

// One glTF mesh with these scene meshes as primitives; kNone when none of them has triangles.
int GltfWriter::add_mesh(const std::vector<int>& meshes) {
  const auto [at, is_new] = mesh_indices_.try_emplace(meshes, kNone);
  if (!is_new) return at->second;
  Json primitives = Json::array();
  for (const int mesh : meshes)
    if (const Json& json = primitive(mesh); !json.is_null()) primitives.push_back(json);
  if (primitives.empty()) return kNone;
  Json json = {{"primitives", std::move(primitives)}};
  if (const std::string& name = scene_.meshes[static_cast<std::size_t>(meshes.front())].name; !name.empty())
    json["name"] = name;
  meshes_.push_back(std::move(json));
  return at->second = static_cast<int>(meshes_.size()) - 1;
}

// Groups in the order of their first scene mesh, whichever nodes show them: this keeps mesh indices.
void GltfWriter::add_meshes() {
  std::set<std::vector<int>> groups;
  for (const Node& n : scene_.nodes)
    if (!n.meshes.empty()) groups.insert(n.meshes);
  for (const std::vector<int>& group : groups) add_mesh(group);
}

// --- lights, nodes, animation
// ----------------------------------------------------------------------------------

Json GltfWriter::light(const PunctualLight& l) {
  static constexpr const char* kTypes[] = {"point", "spot", "directional"};
  const float intensity = power_of_two_above(max_component(l.color));
  Json json = {{"type", kTypes[static_cast<int>(l.type)]},
               {"color", to_json(l.color / intensity)},
               {"intensity", intensity}};
  if (!l.name.empty()) json["name"] = l.name;
  if (l.range > 0 && l.type != LightType::kDirectional) json["range"] = l.range;
  if (l.type == LightType::kSpot) {
    // The specification wants inner < outer.
    const float inner = std::min(l.inner_cone, std::nextafter(l.outer_cone, 0.0f));
    json["spot"] = {{"innerConeAngle", inner}, {"outerConeAngle", l.outer_cone}};
  }
  return json;
}

Json GltfWriter::node(const Node& n, const std::vector<int>& children) {
  Json json = Json::object();
  if (!n.name.empty()) json["name"] = n.name;
  if (n.has_matrix) {
    Json matrix = Json::array();
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 4; ++row) matrix.push_back(n.matrix[column][row]);
    json["matrix"] = std::move(matrix);
  } else {
    if (n.translation != vec3(0)) json["translation"] = to_json(n.translation);
    if (n.rotation != vec4(0, 0, 0, 1)) json["rotation"] = to_json(n.rotation);
    if (n.scale != vec3(1)) json["scale"] = to_json(n.scale);
  }
  if (!n.meshes.empty())
    if (const int mesh = add_mesh(n.meshes); mesh != kNone) json["mesh"] = mesh;
  if (n.camera >= 0) json["camera"] = n.camera;
  if (n.light >= 0) json["extensions"]["KHR_lights_punctual"]["light"] = n.light;
  if (!children.empty()) json["children"] = children;
  return json;
}

void GltfWriter::add_nodes() {
  std::vector<std::vector<int>> children(scene_.nodes.size());
  for (std::size_t i = 0; i < scene_.nodes.size(); ++i)
    if (scene_.nodes[i].parent >= 0)
      children[static_cast<std::size_t>(scene_.nodes[i].parent)].push_back(static_cast<int>(i));
  for (std::size_t i = 0; i < scene_.nodes.size(); ++i) nodes_.push_back(node(scene_.nodes[i], children[i]));
}

void GltfWriter::add_animation(const Animation& animation) {
  static constexpr const char* kInterpolations[] = {"LINEAR", "STEP", "CUBICSPLINE"};
  static constexpr const char* kPaths[] = {"translation", "rotation", "scale"};
  Json samplers = Json::array(), channels = Json::array();
  for (const AnimationChannel& channel : animation.channels) {
    channels.push_back(
        {{"sampler", samplers.size()},
         {"target", {{"node", channel.node}, {"path", kPaths[static_cast<int>(channel.property)]}}}});
    samplers.push_back({{"input", add_keys(channel.times)},
                        {"interpolation", kInterpolations[static_cast<int>(channel.interpolation)]},
                        {"output", add_key_values(channel)}});
  }
  if (channels.empty()) return;
  Json json = {{"samplers", std::move(samplers)}, {"channels", std::move(channels)}};
  if (!animation.name.empty()) json["name"] = animation.name;
  animations_.push_back(std::move(json));
}

void GltfWriter::add_environment() {
  const Environment& environment = scene_.environment;
  if (environment.radiance == vec3(0)) return;
  warnings_.push_back(
      "glTF has no environment light: it is kept in the scene's extras, which only Lumigrove reads");
  Json json = {{"radiance", to_json(environment.radiance)}};
  if (environment.image >= 0) {
    const std::vector<std::uint8_t> exr =
        encode_exr(scene_.images[static_cast<std::size_t>(environment.image)]);
    json["image"] = {{"bufferView", append(exr.data(), exr.size())}, {"mimeType", "image/x-exr"}};
  }
  scene_extras_["lumigrove_environment"] = std::move(json);
}

// --- the file
// --------------------------------------------------------------------------------------------------

Json GltfWriter::document() {
  for (const Material& m : scene_.materials) materials_.push_back(material(m));
  add_meshes();
  add_nodes();
  for (const Animation& animation : scene_.animations) add_animation(animation);
  add_environment();

  Json json;
  json["asset"] = {{"version", "2.0"}, {"generator", fmt::format("Lumigrove {}", version())}};
  Json scene = Json::object(), roots = Json::array();
  for (std::size_t i = 0; i < scene_.nodes.size(); ++i)
    if (scene_.nodes[i].parent < 0) roots.push_back(i);
  if (!roots.empty()) scene["nodes"] = std::move(roots);
  if (!scene_extras_.is_null()) scene["extras"] = scene_extras_;
  json["scene"] = 0;
  json["scenes"] = Json::array({std::move(scene)});

  Json cameras = Json::array();
  for (const Camera& camera : scene_.cameras) {
    // The near distance must be positive in glTF.
    const float znear = camera.znear > 0 ? camera.znear : std::numeric_limits<float>::min();
    Json entry = {{"type", "perspective"},
                  {"perspective", {{"yfov", camera.vertical_fov}, {"znear", znear}}}};
    if (!camera.name.empty()) entry["name"] = camera.name;
    cameras.push_back(std::move(entry));
  }
  if (!scene_.lights.empty()) {
    use_extension("KHR_lights_punctual");
    Json lights = Json::array();
    for (const PunctualLight& l : scene_.lights) lights.push_back(light(l));
    json["extensions"]["KHR_lights_punctual"]["lights"] = std::move(lights);
  }
  if (!extensions_.empty()) json["extensionsUsed"] = extensions_;
  // glTF forbids empty arrays.
  const auto put = [&](const char* key, Json& value) {
    if (!value.empty()) json[key] = std::move(value);
  };
  put("nodes", nodes_);
  put("meshes", meshes_);
  put("materials", materials_);
  put("textures", textures_);
  put("samplers", samplers_);
  put("images", images_);
  put("cameras", cameras);
  put("animations", animations_);
  put("accessors", accessors_);
  put("bufferViews", views_);
  return json;
}

void append_word(std::vector<std::uint8_t>& bytes, std::size_t word) {
  static_assert(std::endian::native == std::endian::little, "glTF buffers are little-endian");
  const std::uint32_t value = static_cast<std::uint32_t>(word);
  const auto* first = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), first, first + sizeof(value));
}

std::vector<std::uint8_t> pack_glb(std::string json, const std::vector<std::uint8_t>& buffer) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::size_t total = 12 + 8 + json.size() + (buffer.empty() ? 0 : 8 + buffer.size());
  if (total > std::numeric_limits<std::uint32_t>::max())
    throw Error(
        fmt::format("the scene needs {} bytes, more than the 4 GiB that a .glb file can hold", total));
  std::vector<std::uint8_t> bytes;
  bytes.reserve(total);
  for (const std::size_t word : {std::size_t{kGlbMagic}, std::size_t{kGlbVersion}, total})
    append_word(bytes, word);
  append_word(bytes, json.size());
  append_word(bytes, kGlbJson);
  bytes.insert(bytes.end(), json.begin(), json.end());
  if (buffer.empty()) return bytes;
  append_word(bytes, buffer.size());
  append_word(bytes, kGlbBinary);
  bytes.insert(bytes.end(), buffer.begin(), buffer.end());
  return bytes;
}

void GltfWriter::write(const std::filesystem::path& file, bool binary) {
  Json json = document();
  if (!buffer_.empty()) {
    Json buffer = {{"byteLength", buffer_.size()}};
    if (!binary) {
      const std::string_view bytes(reinterpret_cast<const char*>(buffer_.data()), buffer_.size());
      buffer["uri"] = "data:application/octet-stream;base64," + OIIO::Strutil::base64_encode(bytes);
    }
    json["buffers"] = Json::array({std::move(buffer)});
  }
  // Names that are not UTF-8 would stop the serializer.
  const std::string text = json.dump(binary ? -1 : 1, ' ', false, Json::error_handler_t::replace);
  if (binary) return write_file_atomically(file, pack_glb(text, buffer_));
  const auto* first = reinterpret_cast<const std::uint8_t*>(text.data());
  write_file_atomically(file, {first, text.size()});
}

}  // namespace

std::vector<std::string> export_gltf(const Scene& scene, const std::filesystem::path& file) {
  const std::string extension = lower_case_extension(file);
  if (extension != ".glb" && extension != ".gltf")
    throw Error(fmt::format("{}: a glTF file must end in .glb or .gltf", file.string()));
  GltfWriter writer(scene);
  writer.write(file, extension == ".glb");
  return writer.take_warnings();
}

}  // namespace lumigrove
