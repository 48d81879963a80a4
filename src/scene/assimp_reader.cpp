#include "scene/assimp_reader.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/GltfMaterial.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string_view>

#include "base/srgb.h"
#include "base/vec.h"
#include "scene/asset_files.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 13> kExtensions = {
    ".obj", ".ply", ".fbx", ".stl", ".dae", ".3ds", ".3mf", ".off", ".x", ".x3d", ".ac", ".ase", ".lwo"};

// Meshes become indexed triangles; v grows downwards; texture transforms go into the coordinates.
constexpr unsigned kSteps = aiProcess_Triangulate | aiProcess_JoinIdenticalVertices | aiProcess_SortByPType |
                            aiProcess_FlipUVs | aiProcess_TransformUVCoords;

vec3 to_vec3(const aiVector3D& v) { return vec3(v.x, v.y, v.z); }
vec3 to_vec3(const aiColor3D& c) { return vec3(c.r, c.g, c.b); }
vec4 to_vec4(const aiQuaternion& q) { return vec4(q.x, q.y, q.z, q.w); }

mat4 to_mat4(const aiMatrix4x4& m) {  // Assimp stores rows
  return mat4(vec4(m.a1, m.b1, m.c1, m.d1), vec4(m.a2, m.b2, m.c2, m.d2), vec4(m.a3, m.b3, m.c3, m.d3),
              vec4(m.a4, m.b4, m.c4, m.d4));
}

// " v .5 0 0" -> "v 0.5 0 0": Assimp 5.2 leaves out, without a word, lines that begin with a blank and vertices with a
// number that begins with a point, so that every later index means another vertex.
std::string as_assimp_reads(std::span<const unsigned char> obj) {
  std::string text;
  text.reserve(obj.size());
  const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
  bool line_begins = true, in_vertex = false;
  char before = '\n';
  for (const unsigned char byte : obj) {
    const char c = static_cast<char>(byte);
    if (line_begins && is_blank(c)) continue;
    if (line_begins) in_vertex = c == 'v';
    line_begins = c == '\n' && before != '\\';  // else it continues
    if (in_vertex && c == '.' && is_blank(before)) text += '0';
    text += c;
    if (c != '\r') before = c;
  }
  return text;
}

Assimp::IOStream* open_obj(const fs::path& path) {
  const std::string text = as_assimp_reads(read_file(path));
  auto* bytes = new std::uint8_t[text.size()];  // the stream deletes it
  std::copy(text.begin(), text.end(), bytes);
  return new Assimp::MemoryIOStream(bytes, text.size(), true);
}

// Files of the scene's folder, and a record of what else was asked for.
class FolderFiles : public Assimp::DefaultIOSystem {
 public:
  FolderFiles(const fs::path& scene_file, std::set<std::string>& outside, std::set<std::string>& missing)
      : folder_(fs::canonical(fs::absolute(scene_file).parent_path())),
        outside_(outside),
        missing_(missing) {}

  bool Exists(const char* name) const override {
    const fs::path path = folder_ / name;
    return allowed(path) && DefaultIOSystem::Exists(path.c_str());
  }

  Assimp::IOStream* Open(const char* name, const char* mode) override {
    if (mode[0] != 'r') return nullptr;
    const fs::path path = folder_ / name;
    if (!allowed(path)) {
      outside_.insert(name);
      return nullptr;
    }
    std::error_code error;
    if (!fs::is_regular_file(path, error)) {
      missing_.insert(name);
      return nullptr;
    }
    if (lower_case_extension(path) == ".obj") return open_obj(path);
    return DefaultIOSystem::Open(path.c_str(), mode);
  }

 private:
  bool allowed(const fs::path& path) const {
    std::error_code error;
    const fs::path target = fs::weakly_canonical(path, error);
    return !error &&
           std::mismatch(folder_.begin(), folder_.end(), target.begin(), target.end()).first == folder_.end();
  }

  fs::path folder_;
  std::set<std::string>&outside_, &missing_;
};

class Converter {
 public:
  Converter(const aiScene& source, const fs::path& file)
      : source_(source), name_(file.string()), extension_(lower_case_extension(file)) {}

  ForeignScene convert();

 private:
  Scene& scene() { return out_.scene; }
  void warn(const std::string& sentence) { scene().warnings.push_back(name_ + ": " + sentence); }
  void warn_counts();

  int file_index(const aiMaterial& material, std::initializer_list<aiTextureType> types, TextureUse& use);
  int texture_index(const ForeignTexture& texture);
  Material convert(const aiMaterial& source);
  void convert_textures(const aiMaterial& source, Material& m);
  void convert_opacity(const aiMaterial& source, const ForeignTexture& base, Material& m);
  Mesh convert(const aiMesh& source);
  void convert_meshes();
  void convert_nodes();
  int attachment_node(const aiString& name, const aiVector3D& position, vec3 forward, vec3 up,
                      const char* suffix);
  void convert_lights();
  std::optional<PunctualLight> convert(const aiLight& source);
  void convert_cameras();
  void convert_animations();
  void convert(const aiNodeAnim& source, double ticks_per_second, Animation& animation);

  const aiScene& source_;
  std::string name_, extension_;
  ForeignScene out_;
  std::map<std::string, int> node_of_name_;
  std::map<std::string, int> file_of_reference_;
  std::vector<int> mesh_of_source_;    // -1: not a triangle mesh
  std::map<std::string, int> counts_;  // "what": how many; one warning each
};

// --- materials
// -------------------------------------------------------------------------------------------------

Wrap to_wrap(aiTextureMapMode mode) {
  switch (mode) {
    case aiTextureMapMode_Clamp:
    case aiTextureMapMode_Decal:
      return Wrap::kClamp;
    case aiTextureMapMode_Mirror:
      return Wrap::kMirror;
    default:
      return Wrap::kRepeat;
  }
}

// The file behind the first of these slots that has one; fills how it is mapped. -1 when all are empty.
int Converter::file_index(const aiMaterial& material, std::initializer_list<aiTextureType> types,
                          TextureUse& use) {
  for (const aiTextureType type : types) {
    aiString path;
    if (material.Get(AI_MATKEY_TEXTURE(type, 0), path) != aiReturn_SUCCESS || path.length == 0) continue;
    if (path.C_Str()[0] == '$') continue;  // Assimp's name for "none"
    int uv_set = 0, wrap_u = aiTextureMapMode_Wrap, wrap_v = aiTextureMapMode_Wrap;
    material.Get(AI_MATKEY_UVWSRC(type, 0), uv_set);
    material.Get(AI_MATKEY_MAPPINGMODE_U(type, 0), wrap_u);
    material.Get(AI_MATKEY_MAPPINGMODE_V(type, 0), wrap_v);
    if (uv_set != 0 && uv_set != 1)
      ++counts_["textures use a third set of coordinates; the first is used instead"];
    use.uv_set = uv_set == 1 ? 1 : 0;
    use.wrap_u = to_wrap(static_cast<aiTextureMapMode>(wrap_u));
    use.wrap_v = to_wrap(static_cast<aiTextureMapMode>(wrap_v));

    const auto [at, is_new] =
        file_of_reference_.try_emplace(path.C_Str(), static_cast<int>(out_.files.size()));
    if (!is_new) return at->second;
    ForeignFile file{.reference = path.C_Str(), .embedded = {}};
    if (const aiTexture* embedded = source_.GetEmbeddedTexture(path.C_Str())) {
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(embedded->pcData);
      if (embedded->mHeight == 0) {  // an image file of mWidth bytes
        file.embedded.assign(bytes, bytes + embedded->mWidth);
      } else {
        file.width = static_cast<int>(embedded->mWidth);
        file.height = static_cast<int>(embedded->mHeight);
        const std::size_t texels = std::size_t{embedded->mWidth} * embedded->mHeight;
        for (std::size_t i = 0; i < texels; ++i) {
          const aiTexel& t = embedded->pcData[i];
          file.embedded.insert(file.embedded.end(), {t.r, t.g, t.b, t.a});
        }
      }
    }
    out_.files.push_back(std::move(file));
    return at->second;
  }
  return -1;
}

int Converter::texture_index(const ForeignTexture& texture) {
  const auto found = std::find(out_.textures.begin(), out_.textures.end(), texture);
  if (found == out_.textures.end()) {
    out_.textures.push_back(texture);
    return static_cast<int>(out_.textures.size()) - 1;
  }
  return static_cast<int>(found - out_.textures.begin());
}

// Phong exponent n -> linear roughness: the microfacet lobe of equal width has alpha^2 = 2 / (n + 2) (Walter
// et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"), and roughness = sqrt(alpha).
float roughness_of_exponent(float exponent) { return std::pow(2.0f / (exponent + 2.0f), 0.25f); }

Material Converter::convert(const aiMaterial& source) {
  Material m;
  aiString name;
  if (source.Get(AI_MATKEY_NAME, name) == aiReturn_SUCCESS) m.name = name.C_Str();

  aiColor3D color;
  if (source.Get(AI_MATKEY_BASE_COLOR, color) == aiReturn_SUCCESS ||
      source.Get(AI_MATKEY_COLOR_DIFFUSE, color) == aiReturn_SUCCESS)
    m.base_color = to_vec3(color);
  if (source.Get(AI_MATKEY_COLOR_EMISSIVE, color) == aiReturn_SUCCESS) m.emission = to_vec3(color);
  float value = 0;
  if (source.Get(AI_MATKEY_EMISSIVE_INTENSITY, value) == aiReturn_SUCCESS) m.emission *= value;
  source.Get(AI_MATKEY_METALLIC_FACTOR, m.metallic);
  const bool shiny = source.Get(AI_MATKEY_COLOR_SPECULAR, color) == aiReturn_SUCCESS && !color.IsBlack();
  // The most specific property wins.
  if (shiny && source.Get(AI_MATKEY_SHININESS, value) == aiReturn_SUCCESS && value > 0)
    m.roughness = roughness_of_exponent(value);
  if (source.Get(AI_MATKEY_GLOSSINESS_FACTOR, value) == aiReturn_SUCCESS) m.roughness = 1 - value;
  if (source.Get(AI_MATKEY_ROUGHNESS_FACTOR, value) == aiReturn_SUCCESS) m.roughness = value;
  int two_sided = 0;
  source.Get(AI_MATKEY_TWOSIDED, two_sided);
  m.double_sided = two_sided != 0;
  convert_textures(source, m);
  return m;
}

void Converter::convert_textures(const aiMaterial& source, Material& m) {
  ForeignTexture base{.srgb = true};
  base.color = file_index(source, {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}, m.base_color_texture);
  convert_opacity(source, base, m);

  ForeignTexture emissive{.srgb = true};
  emissive.color =
      file_index(source, {aiTextureType_EMISSION_COLOR, aiTextureType_EMISSIVE}, m.emissive_texture);
  if (emissive.color >= 0) {
    m.emissive_texture.image = texture_index(emissive);
    if (m.emission == vec3(0)) {
      m.emission = vec3(1);
      ++counts_["materials have an emissive texture but no emissive colour; 1 is taken"];
    }
  }

  ForeignTexture surface;
  surface.roughness = file_index(source, {aiTextureType_DIFFUSE_ROUGHNESS}, m.metallic_roughness_texture);
  surface.metallic = file_index(source, {aiTextureType_METALNESS}, m.metallic_roughness_texture);
  if (surface != ForeignTexture{}) {
    m.metallic_roughness_texture.image = texture_index(surface);
    float unused = 0;
    if (surface.metallic >= 0 && source.Get(AI_MATKEY_METALLIC_FACTOR, unused) != aiReturn_SUCCESS)
      m.metallic = 1;
  }

  ForeignTexture normal;
  normal.color = file_index(source, {aiTextureType_NORMALS, aiTextureType_NORMAL_CAMERA}, m.normal_texture);
  if (normal.color >= 0) m.normal_texture.image = texture_index(normal);
  if (source.GetTextureCount(aiTextureType_HEIGHT) > 0)
    ++counts_["materials have a bump map, which is ignored"];
  if (source.GetTextureCount(aiTextureType_SPECULAR) > 0)
    ++counts_["materials have a specular map, which is ignored"];
}

// Half-transparent surfaces do not exist here: opacity is a cut-out at one half, as alphaMode BLEND of glTF.
void Converter::convert_opacity(const aiMaterial& source, const ForeignTexture& base, Material& m) {
  ForeignTexture texture = base;
  TextureUse mapping;
  texture.opacity = file_index(source, {aiTextureType_OPACITY}, mapping);
  if (texture.opacity >= 0) {
    if (texture.color < 0) m.base_color_texture = mapping;
    m.alpha_mode = AlphaMode::kMask;
  }
  if (texture.color >= 0 || texture.opacity >= 0) m.base_color_texture.image = texture_index(texture);
  float opacity = 1;
  source.Get(AI_MATKEY_OPACITY, opacity);
  if (!(opacity < 1)) return;
  if (opacity <= 0) {  // exporters write it for opaque surfaces; nobody models what cannot be seen
    ++counts_["materials have an opacity of zero and are taken as opaque"];
    return;
  }
  m.alpha_mode = AlphaMode::kMask;
  m.alpha = opacity;
  ++counts_["materials are transparent; they are cut out where their opacity is below one half"];
}

// --- meshes
// ----------------------------------------------------------------------------------------------------

// Scans and models of these formats store display colours of 8 bits.
bool has_display_colors(const std::string& extension) {
  return extension == ".ply" || extension == ".obj" || extension == ".stl" || extension == ".off";
}

Mesh Converter::convert(const aiMesh& source) {
  Mesh mesh;
  mesh.name = source.mName.C_Str();
  mesh.material = static_cast<int>(source.mMaterialIndex);
  const std::size_t count = source.mNumVertices;
  const auto copy = [&](const aiVector3D* from, auto& to, auto&& element) {
    if (!from) return;
    to.reserve(count);
    for (std::size_t i = 0; i < count; ++i) to.push_back(element(from[i]));
  };
  const auto uv = [](const aiVector3D& v) { return vec2(v.x, v.y); };
  copy(source.mVertices, mesh.positions, [](const aiVector3D& v) { return to_vec3(v); });
  copy(source.mNormals, mesh.normals, [](const aiVector3D& v) { return to_vec3(v); });
  copy(source.mTextureCoords[0], mesh.uv0, uv);
  copy(source.mTextureCoords[1], mesh.uv1, uv);
  if (const aiColor4D* colors = source.mColors[0]) {
    const bool display = has_display_colors(extension_);
    const auto decode = [&](float c) { return display ? srgb_to_linear(std::clamp(c, 0.0f, 1.0f)) : c; };
    mesh.colors.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
      mesh.colors.emplace_back(decode(colors[i].r), decode(colors[i].g), decode(colors[i].b), colors[i].a);
  }
  mesh.triangles.reserve(source.mNumFaces);
  for (unsigned f = 0; f < source.mNumFaces; ++f) {
    const aiFace& face = source.mFaces[f];
    if (face.mNumIndices == 3)
      mesh.triangles.emplace_back(face.mIndices[0], face.mIndices[1], face.mIndices[2]);
  }
  if (source.mNumBones > 0) ++counts_["meshes have bones; they are shown in their rest pose"];
  if (source.mNumAnimMeshes > 0) ++counts_["meshes have morph targets, which are ignored"];
  return mesh;
}

void Converter::convert_meshes() {
  mesh_of_source_.assign(source_.mNumMeshes, -1);
  for (unsigned i = 0; i < source_.mNumMeshes; ++i) {
    const aiMesh& mesh = *source_.mMeshes[i];
    if (!(mesh.mPrimitiveTypes & aiPrimitiveType_TRIANGLE)) {
      ++counts_["meshes consist of points or lines and are left out"];
      continue;
    }
    mesh_of_source_[i] = static_cast<int>(scene().meshes.size());
    scene().meshes.push_back(convert(mesh));
  }
}

// --- nodes, lights, cameras
// ------------------------------------------------------------------------------------

void Converter::convert_nodes() {
  std::vector<std::pair<const aiNode*, int>> open;
  if (source_.mRootNode) open.emplace_back(source_.mRootNode, -1);
  while (!open.empty()) {
    const auto [source, parent] = open.back();
    open.pop_back();
    Node node;
    node.name = source->mName.C_Str();
    node.parent = parent;
    node.has_matrix = !source->mTransformation.IsIdentity();
    node.matrix = to_mat4(source->mTransformation);
    for (unsigned i = 0; i < source->mNumMeshes; ++i)
      if (source->mMeshes[i] < mesh_of_source_.size() && mesh_of_source_[source->mMeshes[i]] >= 0)
        node.meshes.push_back(mesh_of_source_[source->mMeshes[i]]);
    const int index = static_cast<int>(scene().nodes.size());
    node_of_name_.try_emplace(node.name, index);
    scene().nodes.push_back(std::move(node));
    for (unsigned i = source->mNumChildren; i-- > 0;) open.emplace_back(source->mChildren[i], index);
  }
}

// Lights and cameras have a place and directions of their own inside the node of the same name: a child node
// whose -Z and +Y are those directions.
int Converter::attachment_node(const aiString& name, const aiVector3D& position, vec3 forward, vec3 up,
                               const char* suffix) {
  forward = glm::dot(forward, forward) > 0 ? glm::normalize(forward) : vec3(0, 0, -1);
  vec3 right = glm::cross(forward, up);
  right = glm::dot(right, right) > 1e-12f ? glm::normalize(right) : make_frame(forward).x;
  Node node;
  node.name = std::string(name.C_Str()) + suffix;
  const auto found = node_of_name_.find(name.C_Str());
  node.parent = found == node_of_name_.end() ? -1 : found->second;
  node.has_matrix = true;
  node.matrix = mat4(vec4(right, 0), vec4(glm::cross(right, forward), 0), vec4(-forward, 0),
                     vec4(to_vec3(position), 1));
  scene().nodes.push_back(std::move(node));
  return static_cast<int>(scene().nodes.size()) - 1;
}

std::optional<PunctualLight> Converter::convert(const aiLight& source) {
  PunctualLight light;
  light.name = source.mName.C_Str();
  light.color = to_vec3(source.mColorDiffuse);
  switch (source.mType) {
    case aiLightSource_POINT:
      return light;
    case aiLightSource_DIRECTIONAL:
      light.type = LightType::kDirectional;
      return light;
    case aiLightSource_SPOT:  // Assimp's cone angles are those of the whole cone
      light.type = LightType::kSpot;
      light.outer_cone = std::clamp(0.5f * source.mAngleOuterCone, 0.0f, 0.5f * kPi);
      light.inner_cone = std::clamp(0.5f * source.mAngleInnerCone, 0.0f, light.outer_cone);
      return light;
    default:
      ++counts_["lights are neither point, spot nor directional and are left out"];
      return std::nullopt;
  }
}

void Converter::convert_lights() {
  for (unsigned i = 0; i < source_.mNumLights; ++i) {
    const aiLight& source = *source_.mLights[i];
    const std::optional<PunctualLight> light = convert(source);
    if (!light) continue;
    const int node =
        attachment_node(source.mName, source.mPosition, to_vec3(source.mDirection), vec3(0, 1, 0), "_light");
    scene().nodes[static_cast<std::size_t>(node)].light = static_cast<int>(scene().lights.size());
    scene().lights.push_back(*light);
    ++counts_
        ["lights have no physical unit in this format; their colour is taken as W/sr (W/m^2 if directional)"];
  }
}

void Converter::convert_cameras() {
  for (unsigned i = 0; i < source_.mNumCameras; ++i) {
    const aiCamera& source = *source_.mCameras[i];
    Camera camera;
    camera.name = source.mName.C_Str();
    const float aspect = source.mAspect > 0 ? source.mAspect : 1.0f;
    const float vertical = 2 * std::atan(std::tan(0.5f * source.mHorizontalFOV) / aspect);
    if (!(vertical > 0 && vertical < kPi)) {
      ++counts_["cameras have no usable field of view and are left out"];
      continue;
    }
    camera.vertical_fov = vertical;
    if (source.mClipPlaneNear >= 0) camera.znear = source.mClipPlaneNear;
    const int node = attachment_node(source.mName, source.mPosition, to_vec3(source.mLookAt),
                                     to_vec3(source.mUp), "_camera");
    scene().nodes[static_cast<std::size_t>(node)].camera = static_cast<int>(scene().cameras.size());
    scene().cameras.push_back(camera);
  }
}

// --- animation
// -------------------------------------------------------------------------------------------------

// Keys of one property; keys that do not come later than the one before are dropped.
template <class Key, class Convert>
AnimationChannel convert_keys(const Key* keys, unsigned count, double ticks_per_second, int node,
                              AnimatedProperty property, Convert&& to_value) {
  AnimationChannel channel{.node = node, .property = property, .times = {}, .values = {}};
  for (unsigned i = 0; i < count; ++i) {
    const float time = static_cast<float>(keys[i].mTime / ticks_per_second);
    if (!channel.times.empty() && !(time > channel.times.back())) continue;
    channel.times.push_back(time);
    channel.values.push_back(to_value(keys[i].mValue));
  }
  return channel;
}

void Converter::convert(const aiNodeAnim& source, double ticks_per_second, Animation& animation) {
  const auto found = node_of_name_.find(source.mNodeName.C_Str());
  if (found == node_of_name_.end()) return;
  Node& node = scene().nodes[static_cast<std::size_t>(found->second)];
  if (node.has_matrix) {
    aiVector3D scale, position;
    aiQuaternion rotation;
    const mat4& m = node.matrix;
    aiMatrix4x4(m[0][0], m[1][0], m[2][0], m[3][0], m[0][1], m[1][1], m[2][1], m[3][1], m[0][2], m[1][2],
                m[2][2], m[3][2], m[0][3], m[1][3], m[2][3], m[3][3])
        .Decompose(scale, rotation, position);
    node.translation = to_vec3(position);
    node.rotation = to_vec4(rotation);
    node.scale = to_vec3(scale);
    node.has_matrix = false;
    node.matrix = mat4(1);
  }
  const auto add = [&](AnimationChannel channel) {
    if (!channel.times.empty()) animation.channels.push_back(std::move(channel));
  };
  const auto vector = [](const aiVector3D& v) { return vec4(to_vec3(v), 0); };
  const auto quaternion = [](const aiQuaternion& q) { return to_vec4(q); };
  add(convert_keys(source.mPositionKeys, source.mNumPositionKeys, ticks_per_second, found->second,
                   AnimatedProperty::kTranslation, vector));
  add(convert_keys(source.mRotationKeys, source.mNumRotationKeys, ticks_per_second, found->second,
                   AnimatedProperty::kRotation, quaternion));
  add(convert_keys(source.mScalingKeys, source.mNumScalingKeys, ticks_per_second, found->second,
                   AnimatedProperty::kScale, vector));
}

void Converter::convert_animations() {
  if (source_.mNumAnimations == 0) return;
  if (source_.mNumAnimations > 1)
    warn(fmt::format("of {} animations only the first is used", source_.mNumAnimations));
  const aiAnimation& source = *source_.mAnimations[0];
  const double ticks_per_second = source.mTicksPerSecond > 0 ? source.mTicksPerSecond : 25.0;
  Animation animation;
  animation.name = source.mName.C_Str();
  for (unsigned i = 0; i < source.mNumChannels; ++i)
    convert(*source.mChannels[i], ticks_per_second, animation);
  if (!animation.channels.empty()) scene().animations.push_back(std::move(animation));
}

void Converter::warn_counts() {
  for (const auto& [what, count] : counts_) warn(fmt::format("{} {}", count, what));
}

ForeignScene Converter::convert() {
  scene().name = name_;
  for (unsigned i = 0; i < source_.mNumMaterials; ++i)
    scene().materials.push_back(convert(*source_.mMaterials[i]));
  convert_meshes();
  convert_nodes();
  convert_lights();
  convert_cameras();
  convert_animations();
  warn_counts();
  return std::move(out_);
}

// "Assimp's message" as the end of one sentence.
std::string reason(const Assimp::Importer& importer) {
  std::string text = importer.GetErrorString();
  text = text.substr(0, text.find('\n'));
  while (!text.empty() && (text.back() == '.' || text.back() == ' ')) text.pop_back();
  return text.empty() ? "unknown reason" : text;
}

}  // namespace

bool assimp_reads(const std::string& extension) {
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

std::string assimp_extensions() { return fmt::format("{}", fmt::join(kExtensions, ", ")); }

ForeignScene read_with_assimp(const fs::path& file) {
  std::set<std::string> outside, missing;
  Assimp::Importer importer;
  importer.SetIOHandler(new FolderFiles(file, outside, missing));  // the importer deletes it
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  const aiScene* source = importer.ReadFile(fs::absolute(file).string(), kSteps);
  if (!outside.empty())
    throw Error(fmt::format("{}: '{}' leaves the scene's folder", file.string(), *outside.begin()));
  if (!source) throw Error(fmt::format("{}: cannot be read: {}", file.string(), reason(importer)));
  ForeignScene foreign = Converter(*source, file).convert();
  for (const std::string& path : missing)
    if (lower_case_extension(path) == ".mtl")
      foreign.scene.warnings.push_back(fmt::format("{}: the material library '{}' does not exist",
                                                   file.string(), fs::path(path).filename().string()));
  return foreign;
}

}  // namespace lumigrove
