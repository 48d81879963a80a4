// glTF 2.0 -> Scene. Every triangle primitive becomes one Mesh; nodes that show the same glTF mesh, and glTF
// meshes that list the same primitive (the same accessors and material), share them. Only what the default scene reaches is kept (the first scene without a default, all root nodes
// without scenes).
//
// Where glTF leaves a choice or Lumigrove knows less: alphaMode BLEND is cut out at alpha 0.5; occlusion
// textures are not used (occlusion is traced); candela, lux and nits are taken one to one as W/sr, W/m^2 and
// W/(sr m^2); skins and morph targets stay in their bind pose; points, lines and orthographic cameras are
// left out.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "base/vec.h"
#include "device/device.h"
#include "lumigrove/scene.h"
#include "scene/gltf_file.h"
#include "scene/hierarchy.h"
#include "scene/image_decode.h"
#include "scene/import.h"

namespace lumigrove {
namespace {

std::vector<vec2> to_vec2(const std::vector<float>& v) {
  std::vector<vec2> out(v.size() / 2);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = vec2(v[2 * i], v[2 * i + 1]);
  return out;
}
std::vector<vec3> to_vec3(const std::vector<float>& v) {
  std::vector<vec3> out(v.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = vec3(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
  return out;
}
// Three or four floats an element; `fill` is the fourth where there are three.
std::vector<vec4> to_vec4(const std::vector<float>& v, int components, float fill) {
  const std::size_t n = static_cast<std::size_t>(components);
  std::vector<vec4> out(v.size() / n);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = vec4(v[n * i], v[n * i + 1], v[n * i + 2], n == 4 ? v[n * i + 3] : fill);
  return out;
}

vec3 to_vec3(const std::vector<double>& v, vec3 absent) {
  return v.size() == 3 ? vec3(glm::dvec3(v[0], v[1], v[2])) : absent;
}
vec4 to_vec4(const std::vector<double>& v, vec4 absent) {
  return v.size() == 4 ? vec4(glm::dvec4(v[0], v[1], v[2], v[3])) : absent;
}

const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const char* name) {
  const auto found = extensions.find(name);
  return found == extensions.end() || !found->second.IsObject() ? nullptr : &found->second;
}
float number(const tinygltf::Value& object, const char* key, float absent) {
  if (!object.Has(key) || !object.Get(key).IsNumber()) return absent;
  return static_cast<float>(object.Get(key).GetNumberAsDouble());
}
vec2 pair(const tinygltf::Value& object, const char* key, vec2 absent) {
  if (!object.Has(key)) return absent;
  const tinygltf::Value& array = object.Get(key);
  if (array.ArrayLen() != 2 || !array.Get(0).IsNumber() || !array.Get(1).IsNumber()) return absent;
  return vec2(glm::dvec2(array.Get(0).GetNumberAsDouble(), array.Get(1).GetNumberAsDouble()));
}
std::optional<vec3> triple(const tinygltf::Value& object, const char* key) {
  if (!object.Has(key)) return std::nullopt;
  const tinygltf::Value& array = object.Get(key);
  if (array.ArrayLen() != 3) return std::nullopt;
  glm::dvec3 v(0);
  for (int i = 0; i < 3; ++i) {
    if (!array.Get(i).IsNumber()) return std::nullopt;
    v[i] = array.Get(i).GetNumberAsDouble();
  }
  return vec3(v);
}
int integer(const tinygltf::Value& object, const char* key, int absent) {
  return object.Has(key) && object.Get(key).IsInt() ? object.Get(key).GetNumberAsInt() : absent;
}

Wrap to_wrap(int gl_name) {
  if (gl_name == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::kClamp;
  return gl_name == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::kMirror : Wrap::kRepeat;
}

// Triangles of a list, strip or fan over `count` indices (section 3.7.2.1 of the specification).
std::vector<uvec3> assemble_triangles(int mode, std::size_t count,
                                      const std::vector<std::uint32_t>* indices) {
  const auto at = [&](std::size_t i) { return indices ? (*indices)[i] : static_cast<std::uint32_t>(i); };
  std::vector<uvec3> triangles;
  if (mode == TINYGLTF_MODE_TRIANGLES) {
    triangles.reserve(count / 3);
    for (std::size_t i = 0; i + 2 < count; i += 3) triangles.emplace_back(at(i), at(i + 1), at(i + 2));
  } else {
    const bool strip = mode == TINYGLTF_MODE_TRIANGLE_STRIP;
    for (std::size_t i = 0; i + 2 < count; ++i)
      triangles.push_back(strip ? uvec3(at(i), at(i + 1 + i % 2), at(i + 2 - i % 2))
                                : uvec3(at(i + 1), at(i + 2), at(0)));
  }
  return triangles;
}

// What makes two primitives the same geometry: attributes, indices, material, mode.
using PrimitiveKey = std::tuple<std::map<std::string, int>, int, int, int>;

class Importer {
 public:
  explicit Importer(const std::filesystem::path& path) : file_(read_gltf_file(path)) {}

  Scene run() {
    scene_.name = file_.name;
    scene_.warnings = file_.warnings;
    for (const tinygltf::Material& material : file_.model.materials) import_material(material);
    decode_images();
    import_lights();
    import_cameras();
    import_nodes();
    for (const tinygltf::Animation& animation : file_.model.animations) import_animation(animation);
    import_environment();
    for (const std::string& warning : once_)
      scene_.warnings.push_back(fmt::format("{}: {}", file_.name, warning));
    validate(scene_);
    return std::move(scene_);
  }

 private:
  [[noreturn]] void fail(const std::string& sentence) const {
    throw Error(fmt::format("{}: {}", file_.name, sentence));
  }

  template <class T>
  const T& element(const std::vector<T>& list, int index, const char* kind, const std::string& user) const {
    if (index < 0 || static_cast<std::size_t>(index) >= list.size())
      fail(fmt::format("{} uses {} {}, which does not exist", user, kind, index));
    return list[static_cast<std::size_t>(index)];
  }

  // --- materials and images ---

  // Index of the scene's image for a glTF image in one of its two readings; decoded later, all side by side.
  int want_image(int index, bool srgb) {
    const auto [found, added] = images_.try_emplace({index, srgb}, static_cast<int>(images_.size()));
    return found->second;
  }

  template <class TextureInfo>
  TextureUse import_texture(const TextureInfo& info, bool srgb, const std::string& user) {
    TextureUse use;
    if (info.index == -1) return use;
    const tinygltf::Texture& texture = element(file_.model.textures, info.index, "texture", user);
    if (texture.source == -1)
      fail(fmt::format("{} uses texture {}, which has no image in a supported format", user, info.index));
    element(file_.images, texture.source, "image", user);
    use.image = want_image(texture.source, srgb);
    use.uv_set = info.texCoord;
    if (texture.sampler != -1) {
      const tinygltf::Sampler& sampler = element(file_.model.samplers, texture.sampler, "sampler", user);
      use.wrap_u = to_wrap(sampler.wrapS);
      use.wrap_v = to_wrap(sampler.wrapT);
      use.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
    }
    if (const tinygltf::Value* transform = find_extension(info.extensions, "KHR_texture_transform")) {
      use.offset = pair(*transform, "offset", vec2(0));
      use.scale = pair(*transform, "scale", vec2(1));
      use.rotation = number(*transform, "rotation", 0);
      use.uv_set = integer(*transform, "texCoord", use.uv_set);
    }
    if (use.uv_set != 0 && use.uv_set != 1) {
      once_.insert("texture coordinate sets beyond 1 are not supported; set 0 is used instead");
      use.uv_set = 0;
    }
    return use;
  }

  void import_alpha(const tinygltf::Material& source, Material& material, const std::string& user) {
    if (source.alphaMode == "OPAQUE") return;
    material.alpha_mode = AlphaMode::kMask;
    if (source.alphaMode == "MASK") {
      material.alpha_cutoff = static_cast<float>(source.alphaCutoff);
    } else if (source.alphaMode == "BLEND") {
      material.alpha_cutoff = 0.5f;
      once_.insert("alphaMode BLEND is not supported; such materials are cut out at alpha 0.5");
    } else {
      fail(fmt::format("{} has the unknown alphaMode '{}'", user, source.alphaMode));
    }
  }

  void import_material(const tinygltf::Material& source) {
    const std::string user = label("material", scene_.materials.size(), source.name);
    const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
    Material material;
    material.name = source.name;
    const vec4 factor = to_vec4(pbr.baseColorFactor, vec4(1));
    material.base_color = vec3(factor);
    material.alpha = factor.w;
    material.metallic = static_cast<float>(pbr.metallicFactor);
    material.roughness = static_cast<float>(pbr.roughnessFactor);
    material.emission = to_vec3(source.emissiveFactor, vec3(0));
    if (const auto* strength = find_extension(source.extensions, "KHR_materials_emissive_strength"))
      material.emission *= number(*strength, "emissiveStrength", 1);
    material.normal_scale = static_cast<float>(source.normalTexture.scale);
    material.double_sided = source.doubleSided;
    import_alpha(source, material, user);
    material.base_color_texture = import_texture(pbr.baseColorTexture, true, user);
    material.metallic_roughness_texture = import_texture(pbr.metallicRoughnessTexture, false, user);
    material.normal_texture = import_texture(source.normalTexture, false, user);
    material.emissive_texture = import_texture(source.emissiveTexture, true, user);
    scene_.materials.push_back(std::move(material));
  }

  // What the specification gives to primitives without a material.
  int default_material() {
    if (default_material_ < 0) {
      default_material_ = static_cast<int>(scene_.materials.size());
      Material material;
      material.name = "default";
      material.base_color = vec3(1);
      material.metallic = 1;
      scene_.materials.push_back(std::move(material));
    }
    return default_material_;
  }

  void decode_images() {
    std::vector<std::pair<int, bool>> wanted(images_.size());
    for (const auto& [key, at] : images_) wanted[static_cast<std::size_t>(at)] = key;
    scene_.images.resize(wanted.size());
    std::vector<std::string> errors(wanted.size());
    launch(
        static_cast<int>(wanted.size()),
        [&](int i) {
          const std::size_t at = static_cast<std::size_t>(i);
          const GltfImage& image = file_.images[static_cast<std::size_t>(wanted[at].first)];
          try {
            std::vector<unsigned char> storage;
            scene_.images[at] =
                decode_image(image_bytes(file_, image, storage), image.name, wanted[at].second);
          } catch (const std::exception& error) {
            errors[at] = error.what();
          }
        },
        1);
    for (const std::string& error : errors)  // the first by number, whichever failed first
      if (!error.empty()) throw Error(error.rfind(file_.name, 0) == 0 ? error : file_.name + ": " + error);
  }

  // --- meshes ---

  // The meshes that reached nodes show, in the order of the file.
  void import_meshes(const std::vector<int>& reached) {
    for (const int index : reached) {
      const tinygltf::Node& node = file_.model.nodes[static_cast<std::size_t>(index)];
      if (node.mesh == -1) continue;
      element(file_.model.meshes, node.mesh, "mesh",
              label("node", static_cast<std::size_t>(index), node.name));
      meshes_.try_emplace(node.mesh);
    }
    for (auto& [index, parts] : meshes_) {
      const tinygltf::Mesh& source = file_.model.meshes[static_cast<std::size_t>(index)];
      const std::string user = label("mesh", static_cast<std::size_t>(index), source.name);
      for (const tinygltf::Primitive& primitive : source.primitives)
        if (const int mesh = add_primitive(primitive, source.name, user); mesh != -1) parts.push_back(mesh);
    }
  }

  // The scene mesh of a primitive, imported the first time it is met; -1 for points and lines.
  int add_primitive(const tinygltf::Primitive& source, const std::string& name, const std::string& user) {
    const auto [at, is_new] =
        primitives_.try_emplace({source.attributes, source.indices, source.material, source.mode}, -1);
    if (!is_new) return at->second;
    if (std::optional<Mesh> mesh = import_primitive(source, user)) {
      mesh->name = name;
      at->second = static_cast<int>(scene_.meshes.size());
      scene_.meshes.push_back(std::move(*mesh));
    }
    return at->second;
  }

  std::optional<Mesh> import_primitive(const tinygltf::Primitive& source, const std::string& user) {
    if (source.mode < TINYGLTF_MODE_POINTS || source.mode > TINYGLTF_MODE_TRIANGLE_FAN)
      fail(fmt::format("{} has the unknown primitive mode {}", user, source.mode));
    if (source.mode < TINYGLTF_MODE_TRIANGLES) {
      once_.insert("points and lines are not supported and are left out");
      return std::nullopt;
    }
    if (source.attributes.count("POSITION") == 0) {
      once_.insert("primitives without positions are left out");
      return std::nullopt;
    }
    if (!source.targets.empty())
      once_.insert("morph targets are not supported; meshes keep their base shape");
    Mesh mesh;
    mesh.positions = to_vec3(attribute(source, "POSITION", 3, user));
    mesh.normals = to_vec3(attribute(source, "NORMAL", 3, user));
    mesh.tangents = to_vec4(attribute(source, "TANGENT", 4, user), 4, 1);
    mesh.uv0 = to_vec2(attribute(source, "TEXCOORD_0", 2, user));
    mesh.uv1 = to_vec2(attribute(source, "TEXCOORD_1", 2, user));
    mesh.colors = vertex_colors(source, user);
    mesh.triangles = triangles(source, mesh.positions.size(), user);
    mesh.material = source.material == -1 ? default_material() : source.material;
    return mesh;
  }

  std::vector<float> attribute(const tinygltf::Primitive& primitive, const char* name, int components,
                               const std::string& user) const {
    const auto found = primitive.attributes.find(name);
    if (found == primitive.attributes.end()) return {};
    return read_floats(file_, found->second, components, fmt::format("{} {}", user, name));
  }

  std::vector<vec4> vertex_colors(const tinygltf::Primitive& primitive, const std::string& user) const {
    const auto found = primitive.attributes.find("COLOR_0");
    if (found == primitive.attributes.end()) return {};
    const std::string what = user + " COLOR_0";
    const int components = component_count(file_, found->second, what) == 3 ? 3 : 4;
    return to_vec4(read_floats(file_, found->second, components, what), components, 1);
  }

  std::vector<uvec3> triangles(const tinygltf::Primitive& primitive, std::size_t vertices,
                               const std::string& user) const {
    if (primitive.indices == -1) return assemble_triangles(primitive.mode, vertices, nullptr);
    const std::vector<std::uint32_t> indices = read_indices(file_, primitive.indices, user + " indices");
    return assemble_triangles(primitive.mode, indices.size(), &indices);
  }

  // --- lights and cameras ---

  void import_lights() {
    for (const tinygltf::Light& source : file_.model.lights) {
      PunctualLight light;
      light.name = source.name;
      light.color = to_vec3(source.color, vec3(1)) * static_cast<float>(source.intensity);
      light.range = static_cast<float>(source.range);
      if (source.type == "spot") {
        light.type = LightType::kSpot;
        light.inner_cone = static_cast<float>(source.spot.innerConeAngle);
        light.outer_cone = static_cast<float>(source.spot.outerConeAngle);
      } else if (source.type == "directional") {
        light.type = LightType::kDirectional;
      } else if (source.type != "point") {
        fail(fmt::format("{} has the unknown type '{}'", label("light", scene_.lights.size(), source.name),
                         source.type));
      }
      scene_.lights.push_back(std::move(light));
    }
  }

  void import_cameras() {
    for (const tinygltf::Camera& source : file_.model.cameras) {
      const bool perspective = source.type == "perspective";
      cameras_.push_back(perspective ? static_cast<int>(scene_.cameras.size()) : -1);
      if (!perspective) {
        once_.insert("orthographic cameras are not supported and are left out");
        continue;
      }
      scene_.cameras.push_back({source.name, static_cast<float>(source.perspective.yfov),
                                static_cast<float>(source.perspective.znear)});
    }
  }

  // --- nodes ---

  std::vector<int> root_nodes() const {
    const std::vector<tinygltf::Scene>& scenes = file_.model.scenes;
    if (!scenes.empty())
      return element(scenes, std::max(file_.model.defaultScene, 0), "scene", "the asset").nodes;
    std::vector<bool> is_child(file_.model.nodes.size(), false);
    for (const tinygltf::Node& node : file_.model.nodes)
      for (const int child : node.children)
        if (child >= 0 && static_cast<std::size_t>(child) < is_child.size())
          is_child[static_cast<std::size_t>(child)] = true;
    std::vector<int> roots;
    for (std::size_t i = 0; i < is_child.size(); ++i)
      if (!is_child[i]) roots.push_back(static_cast<int>(i));
    if (roots.empty() && !is_child.empty()) fail("every node is the child of another");
    return roots;
  }

  // Parents of the nodes that `roots` reach (-1: a root, -2: not reached). Each node is entered once, so that
  // hostile hierarchies end.
  std::vector<int> parents_of_reached(const std::vector<int>& roots) const {
    constexpr int kRoot = -1, kNotReached = -2;
    std::vector<int> parents(file_.model.nodes.size(), kNotReached);
    std::vector<std::pair<int, int>> open;  // node, parent
    for (const int root : roots) open.emplace_back(root, kRoot);
    while (!open.empty()) {
      const auto [index, parent] = open.back();
      open.pop_back();
      const tinygltf::Node& node = element(file_.model.nodes, index, "node", "the hierarchy");
      int& known = parents[static_cast<std::size_t>(index)];
      if (known != kNotReached)
        fail(fmt::format("{} appears twice in the hierarchy",
                         label("node", static_cast<std::size_t>(index), node.name)));
      known = parent;
      for (const int child : node.children) open.emplace_back(child, index);
    }
    return parents;
  }

  // The reached nodes in the order of the file: light and instance numbers survive a round trip.
  void import_nodes() {
    const std::vector<int> parents = parents_of_reached(root_nodes());
    std::vector<int> reached;
    nodes_.assign(parents.size(), -1);
    for (std::size_t i = 0; i < parents.size(); ++i) {
      if (parents[i] < -1) continue;
      nodes_[i] = static_cast<int>(reached.size());
      reached.push_back(static_cast<int>(i));
    }
    import_meshes(reached);
    for (const int index : reached) {
      const std::size_t i = static_cast<std::size_t>(index);
      const tinygltf::Node& source = file_.model.nodes[i];
      const int parent = parents[i] < 0 ? -1 : nodes_[static_cast<std::size_t>(parents[i])];
      scene_.nodes.push_back(import_node(source, parent, label("node", i, source.name)));
    }
  }

  Node import_node(const tinygltf::Node& source, int parent, const std::string& user) {
    Node node;
    node.name = source.name;
    node.parent = parent;
    node.translation = to_vec3(source.translation, vec3(0));
    node.rotation = to_vec4(source.rotation, vec4(0, 0, 0, 1));
    node.scale = to_vec3(source.scale, vec3(1));
    if (source.matrix.size() == 16) {
      node.has_matrix = true;
      for (int c = 0; c < 4; ++c)
        for (int r = 0; r < 4; ++r)
          node.matrix[c][r] = static_cast<float>(source.matrix[static_cast<std::size_t>(4 * c + r)]);
    }
    if (source.mesh != -1) node.meshes = meshes_.at(source.mesh);
    if (source.camera != -1) node.camera = element(cameras_, source.camera, "camera", user);
    if (node.camera >= 0) {
      std::string& name = scene_.cameras[static_cast<std::size_t>(node.camera)].name;
      if (name.empty()) name = source.name;  // so that it can be chosen by name
    }
    if (const tinygltf::Value* punctual = find_extension(source.extensions, "KHR_lights_punctual")) {
      node.light = integer(*punctual, "light", -1);
      element(scene_.lights, node.light, "light", user);
    }
    return node;
  }

  // --- animations ---

  void import_animation(const tinygltf::Animation& source) {
    Animation animation{source.name, {}};
    const std::string user = label("animation", scene_.animations.size(), source.name);
    for (const tinygltf::AnimationChannel& channel : source.channels) {
      element(file_.model.nodes, channel.target_node, "node", user);
      const int node = nodes_[static_cast<std::size_t>(channel.target_node)];
      if (node < 0) continue;  // belongs to another scene of the file
      if (scene_.nodes[static_cast<std::size_t>(node)].has_matrix) {
        once_.insert("animation of a node that is placed by a matrix is not valid and is ignored");
        continue;
      }
      animation.channels.push_back(import_channel(source, channel, node, user));
    }
    if (!animation.channels.empty()) scene_.animations.push_back(std::move(animation));
  }

  AnimationChannel import_channel(const tinygltf::Animation& animation,
                                  const tinygltf::AnimationChannel& source, int node,
                                  const std::string& user) const {
    const tinygltf::AnimationSampler& sampler = element(animation.samplers, source.sampler, "sampler", user);
    AnimationChannel channel;
    channel.node = node;
    channel.property = source.target_path == "translation" ? AnimatedProperty::kTranslation
                       : source.target_path == "rotation"  ? AnimatedProperty::kRotation
                                                           : AnimatedProperty::kScale;
    if (sampler.interpolation == "STEP") {
      channel.interpolation = Interpolation::kStep;
    } else if (sampler.interpolation == "CUBICSPLINE") {
      channel.interpolation = Interpolation::kCubicSpline;
    } else if (sampler.interpolation != "LINEAR") {
      fail(fmt::format("{} has the unknown interpolation '{}'", user, sampler.interpolation));
    }
    const int components = channel.property == AnimatedProperty::kRotation ? 4 : 3;
    channel.times = read_floats(file_, sampler.input, 1, user + " input");
    channel.values = to_vec4(read_floats(file_, sampler.output, components, user + " output"), components, 0);
    return channel;
  }

  // --- what our own exporter adds ---

  // Environment light has no ratified extension; export_gltf keeps it in `extras` of the scene.
  void import_environment() {
    if (file_.model.scenes.empty()) return;
    const tinygltf::Value& extras =
        element(file_.model.scenes, std::max(file_.model.defaultScene, 0), "scene", "the asset").extras;
    if (!extras.IsObject() || !extras.Has("lumigrove_environment")) return;
    const tinygltf::Value& source = extras.Get("lumigrove_environment");
    const std::optional<vec3> radiance = triple(source, "radiance");
    if (!radiance) fail("lumigrove_environment has no radiance of three numbers");
    scene_.environment.radiance = *radiance;
    if (!source.Has("image")) return;
    const int view = integer(source.Get("image"), "bufferView", -1);
    scene_.environment.image = static_cast<int>(scene_.images.size());
    scene_.images.push_back(decode_image(view_bytes(file_, view), file_.name + ": environment.exr", false));
    scene_.images.back().name = "environment";
  }

  GltfFile file_;
  Scene scene_;
  std::map<std::pair<int, bool>, int> images_;  // glTF image and sRGB? -> scene image
  std::map<int, std::vector<int>> meshes_;      // glTF mesh -> scene meshes
  std::map<PrimitiveKey, int> primitives_;      // -> scene mesh or -1
  std::vector<int> cameras_;                    // glTF camera -> scene camera or -1
  std::vector<int> nodes_;                      // glTF node -> scene node or -1
  int default_material_ = -1;
  std::set<std::string> once_;  // warnings, each given once
};

}  // namespace

Scene import_gltf(const std::filesystem::path& file) {
  try {
    return Importer(file).run();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw Error(fmt::format("{}: not enough memory to load it", file.string()));
  } catch (const std::exception& error) {  // from tinygltf or the JSON library
    throw Error(fmt::format("{}: cannot be loaded ({})", file.string(), error.what()));
  }
}

}  // namespace lumigrove
