// Scene -> pbrt-v4 text, PLY meshes and textures, as an independent renderer's view of the same light.
// Written after pbrt-v4's file format documentation (pbrt.org/fileformat-v4). Its conventions that differ
// from ours:
//
//   handedness   pbrt is left-handed: "Scale -1 1 1" before LookAt un-mirrors a right-handed scene
//   fov          along the shorter side of the image; ours is vertical
//   units        an "rgb" light parameter is normalised by its illuminant, so that numbers mean what they
//   mean here:
//                radiance (area, infinite), W/sr (point, spot), W/m^2 (distant)
//   instances    pbrt does not light with emissive instances: they are written one by one in world space
//   texture v    grows upwards
//   spectra      pbrt renders spectrally; coloured light between coloured surfaces differs slightly from RGB
//
// pbrt's materials are not ours. "diffuse" is exact; metals ("conductor") and glossy dielectrics
// ("coateddiffuse") are approximations, marked in the file; with `force_diffuse` every material is exact.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <map>
#include <set>

#include "base/atomic_file.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "lumigrove/renderer.h"
#include "scene/asset_files.h"
#include "scene/image_encode.h"

namespace lumigrove {
namespace {

namespace fs = std::filesystem;

// Rougher dielectrics are written without their gloss, smoother ones with a coat.
constexpr float kRoughestCoat = 0.5f;
constexpr int kMaxDepth = 5;  // pbrt counts the direct bounce: ours with --max-bounces 4

std::string numbers(std::span<const float> values) { return fmt::format("{}", fmt::join(values, " ")); }
std::string numbers(vec3 v) { return numbers(std::span(&v.x, 3)); }

// Names from files inside a comment or string of ours.
std::string printable(const std::string& name) {
  std::string text = name;
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 32 || c == '"') c = ' ';
  return text;
}

vec4 texel(const Image8or32& image, std::size_t index) {
  vec4 t;
  for (int c = 0; c < 4; ++c) {
    const std::size_t at = 4 * index + static_cast<std::size_t>(c);
    const float stored =
        image.texels8.empty() ? image.texels32[at] : static_cast<float>(image.texels8[at]) / 255.0f;
    t[c] = image.srgb && c < 3 && !image.texels8.empty() ? srgb_to_linear(stored) : stored;
  }
  return t;
}

std::size_t texel_count(const Image8or32& image) {
  return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
}

// A float image from a function of the texels of another.
template <class Function>
Image8or32 map_texels(const Image8or32& source, Function&& function) {
  Image8or32 image{.name = source.name,
                   .width = source.width,
                   .height = source.height,
                   .srgb = false,
                   .texels8 = {},
                   .texels32 = {}};
  image.texels32.reserve(4 * texel_count(source));
  for (std::size_t i = 0; i < texel_count(source); ++i) {
    const vec4 t = function(texel(source, i));
    image.texels32.insert(image.texels32.end(), {t.x, t.y, t.z, t.w});
  }
  return image;
}

// Values in [0,1] as 8 bits, the depth that every reader of PNG files knows.
Image8or32 to_8_bits(const Image8or32& source) {
  Image8or32 image{.name = source.name,
                   .width = source.width,
                   .height = source.height,
                   .srgb = false,
                   .texels8 = {},
                   .texels32 = {}};
  image.texels8.reserve(source.texels32.size());
  for (const float value : source.texels32)
    image.texels8.push_back(static_cast<std::uint8_t>(std::lround(255 * std::clamp(value, 0.0f, 1.0f))));
  return image;
}

// Point of the unit square -> unit direction: pbrt's parameterisation of its environment images (Clarberg
// 2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD").
vec3 equal_area_direction(vec2 p) {
  const float u = 2 * p.x - 1, v = 2 * p.y - 1;
  const float inside = 1 - (std::abs(u) + std::abs(v));
  const float r = 1 - std::abs(inside);
  const float phi = (r == 0 ? 1 : (std::abs(v) - std::abs(u)) / r + 1) * (kPi / 4);
  const float radius = r * std::sqrt(std::max(0.0f, 2 - r * r));
  return vec3(std::copysign(std::cos(phi), u) * radius, std::copysign(std::sin(phi), v) * radius,
              std::copysign(1 - r * r, inside));
}

// Texel of an equirectangular image in a direction (see Environment).
vec4 equirectangular(const Image8or32& image, vec3 d) {
  const float u = 0.5f + std::atan2(d.x, -d.z) / (2 * kPi), v = std::acos(std::clamp(d.y, -1.0f, 1.0f)) / kPi;
  const int x = std::clamp(static_cast<int>(u * static_cast<float>(image.width)), 0, image.width - 1);
  const int y = std::clamp(static_cast<int>(v * static_cast<float>(image.height)), 0, image.height - 1);
  return texel(image, static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                          static_cast<std::size_t>(x));
}

Image8or32 equal_area_environment(const Image8or32& source) {
  constexpr int kSubsamples = 4;  // along each side of a texel
  const int side =
      std::clamp(static_cast<int>(std::sqrt(static_cast<double>(texel_count(source)))), 32, 4096);
  Image8or32 image{
      .name = source.name, .width = side, .height = side, .srgb = false, .texels8 = {}, .texels32 = {}};
  image.texels32.reserve(4 * texel_count(image));
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      vec4 sum(0);
      for (int s = 0; s < kSubsamples * kSubsamples; ++s) {
        const vec2 offset = (vec2(s % kSubsamples, s / kSubsamples) + 0.5f) / static_cast<float>(kSubsamples);
        sum +=
            equirectangular(source, equal_area_direction((vec2(x, y) + offset) / static_cast<float>(side)));
      }
      sum /= static_cast<float>(kSubsamples * kSubsamples);
      image.texels32.insert(image.texels32.end(), {sum.x, sum.y, sum.z, 1});
    }
  return image;
}

// --- PLY
// -------------------------------------------------------------------------------------------------------

struct PlyContent {
  std::vector<vec3> positions, normals;
  std::vector<vec2> uv;
  std::vector<uvec3> triangles;
};

template <class T>
void append(std::vector<std::uint8_t>& bytes, const T& value) {
  const auto* first = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), first, first + sizeof(T));
}

std::vector<std::uint8_t> encode_ply(const PlyContent& mesh) {
  std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty "
      "float "
      "z\n",
      mesh.positions.size());
  if (!mesh.normals.empty()) header += "property float nx\nproperty float ny\nproperty float nz\n";
  if (!mesh.uv.empty()) header += "property float u\nproperty float v\n";
  header += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                        mesh.triangles.size());
  std::vector<std::uint8_t> bytes(header.begin(), header.end());
  bytes.reserve(bytes.size() + 32 * mesh.positions.size() + 13 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    append(bytes, mesh.positions[i]);
    if (!mesh.normals.empty()) append(bytes, mesh.normals[i]);
    if (!mesh.uv.empty()) append(bytes, mesh.uv[i]);
  }
  for (const uvec3 t : mesh.triangles) {
    bytes.push_back(3);
    append(bytes, t);
  }
  return bytes;
}

// --- the writer
// ------------------------------------------------------------------------------------------------

class PbrtWriter {
 public:
  PbrtWriter(const Scene& scene, double seconds, const fs::path& file, bool force_diffuse)
      : scene_(scene),
        state_(evaluate(scene, seconds)),
        file_(file),
        folder_name_(file.stem().string() + "_files"),
        force_diffuse_(force_diffuse) {}

  void write(int camera, int width, int height, int spp);
  std::vector<std::string> take_warnings();

 private:
  template <class... T>
  void line(fmt::format_string<T...> format, T&&... values) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<T>(values)...);
    text_ += '\n';
  }
  void warn(const std::string& what) { warnings_.insert(what); }
  std::string write_companion(const std::string& name, const std::vector<std::uint8_t>& bytes);

  const Material& material_of(const Mesh& mesh) const {
    return scene_.materials[static_cast<std::size_t>(mesh.material)];
  }
  const Image8or32& image_of(const TextureUse& use) const {
    return scene_.images[static_cast<std::size_t>(use.image)];
  }
  void add_header(int camera, int width, int height, int spp);
  void add_image_texture(const std::string& name, const char* type, const std::string& file,
                         const TextureUse& use);
  std::string reflectance(std::size_t index, const Material& m);
  std::string surface(std::size_t index, const Material& m);
  void add_alpha(std::size_t index, const Material& m);
  std::string normal_map(std::size_t index, const Material& m);
  void add_material(std::size_t index);
  void check_texture_coordinates(const Material& m);

  void add_light(const LightInstance& light);
  void add_environment();
  PlyContent ply_of(const Mesh& mesh) const;
  void add_shape(const Mesh& mesh, const std::string& ply);
  void add_emissive(const MeshInstance& instance, std::size_t number);
  void add_meshes();

  const Scene& scene_;
  SceneState state_;
  fs::path file_;
  std::string folder_name_;
  bool force_diffuse_;
  std::string text_;
  std::set<std::string> warnings_;
  std::map<int, std::string> emission_files_;  // material -> image of its textured emission
};

bool emits(const Material& m) { return max_component(m.emission) > 0; }

// Nothing of the surface passes the alpha test.
bool invisible(const Material& m) {
  return m.alpha_mode == AlphaMode::kMask && m.base_color_texture.image < 0 && m.alpha < m.alpha_cutoff;
}

bool has_alpha_texture(const Material& m) {
  return m.alpha_mode == AlphaMode::kMask && m.base_color_texture.image >= 0;
}

// pbrt has one set of texture coordinates a mesh: that of the first texture in this order.
std::vector<const TextureUse*> used_textures(const Material& m) {
  std::vector<const TextureUse*> uses;
  for (const TextureUse* use : {&m.base_color_texture, &m.emissive_texture, &m.normal_texture})
    if (use->image >= 0) uses.push_back(use);
  return uses;
}

// pbrt's v grows upwards. The transform is that of KHR_texture_transform.
vec2 pbrt_uv(const TextureUse& use, vec2 uv) {
  uv *= use.scale;
  const float c = std::cos(use.rotation), s = std::sin(use.rotation);
  uv = vec2(c * uv.x + s * uv.y, -s * uv.x + c * uv.y) + use.offset;
  return vec2(uv.x, 1 - uv.y);
}

std::string PbrtWriter::write_companion(const std::string& name, const std::vector<std::uint8_t>& bytes) {
  const std::string relative = folder_name_ + "/" + name;
  write_file_atomically(file_.parent_path() / relative, bytes);
  return relative;
}

// --- camera and film
// -------------------------------------------------------------------------------------------

float degrees(float radians) { return radians * (180 / kPi); }

// The angle along the shorter side, in degrees.
float pbrt_fov(float vertical_fov, int width, int height) {
  if (width >= height) return degrees(vertical_fov);
  const float aspect = static_cast<float>(width) / static_cast<float>(height);
  return degrees(2 * std::atan(std::tan(0.5f * vertical_fov) * aspect));
}

void PbrtWriter::add_header(int camera, int width, int height, int spp) {
  if (camera >= static_cast<int>(state_.cameras.size()))
    throw Error(fmt::format("{}: the scene has {} cameras, there is no camera {}", scene_.name,
                            state_.cameras.size(), camera));
  const CameraInstance view =
      camera < 0 ? default_camera(state_) : state_.cameras[static_cast<std::size_t>(camera)];
  line("# '{}' for pbrt-v4, written by Lumigrove {}.", printable(scene_.name), version());
  line("# Light units: radiance, W/sr, W/m^2 in linear sRGB. Materials marked \"approximate\" differ from");
  line("# Lumigrove's; pbrt renders spectrally, which changes light between coloured surfaces slightly.");
  line("Scale -1 1 1");
  line("LookAt {}  {}  {}", numbers(view.position), numbers(view.position + view.forward), numbers(view.up));
  line("Camera \"perspective\" \"float fov\" [ {} ]", pbrt_fov(view.camera.vertical_fov, width, height));
  line(
      "Film \"rgb\" \"integer xresolution\" [ {} ] \"integer yresolution\" [ {} ] \"string filename\" "
      "\"{}.exr\"",
      width, height, printable(file_.stem().string()));
  line("PixelFilter \"box\"");
  line("Sampler \"independent\" \"integer pixelsamples\" [ {} ]", spp);
  line("Integrator \"path\" \"integer maxdepth\" [ {} ]", kMaxDepth);
  line("WorldBegin\n");
}

// --- materials
// -------------------------------------------------------------------------------------------------

void PbrtWriter::add_image_texture(const std::string& name, const char* type, const std::string& file,
                                   const TextureUse& use) {
  if (use.wrap_u != use.wrap_v || use.wrap_u == Wrap::kMirror)
    warn("pbrt wraps textures in one way for both directions and cannot mirror: repeated instead");
  const bool clamp = use.wrap_u == Wrap::kClamp && use.wrap_v == Wrap::kClamp;
  line(
      "Texture \"{}\" \"{}\" \"imagemap\" \"string filename\" \"{}\" \"string wrap\" \"{}\" \"string "
      "filter\" \"{}\"",
      name, type, file, clamp ? "clamp" : "repeat",
      use.nearest || std::string_view(type) == "float" ? "point" : "bilinear");
}

// The parameter "reflectance" of a material: base colour times its texture.
std::string PbrtWriter::reflectance(std::size_t index, const Material& m) {
  const TextureUse& use = m.base_color_texture;
  if (use.image < 0) return fmt::format("\"rgb reflectance\" [ {} ]", numbers(m.base_color));
  const Image8or32& image = image_of(use);
  std::string file;
  if (m.base_color == vec3(1) && image.srgb) {
    file =
        write_companion(fmt::format("color{}.png", index), encode_png(image, TextureContent::kColor).bytes);
  } else {
    const Image8or32 tinted = map_texels(image, [&](vec4 t) { return vec4(m.base_color, 1) * t; });
    file = write_companion(fmt::format("color{}.exr", index), encode_exr(tinted));
  }
  add_image_texture(fmt::format("color{}", index), "spectrum", file, use);
  return fmt::format("\"texture reflectance\" \"color{}\"", index);
}

float mean_channel(const Image8or32& image, int channel) {
  double sum = 0;
  for (std::size_t i = 0; i < texel_count(image); ++i) sum += static_cast<double>(texel(image, i)[channel]);
  return static_cast<float>(sum / static_cast<double>(texel_count(image)));
}

// Type and roughness of a material, with a comment when pbrt has nothing equal.
std::string PbrtWriter::surface(std::size_t index, const Material& m) {
  if (force_diffuse_) return fmt::format("\"string type\" \"diffuse\" {}", reflectance(index, m));
  float metallic = m.metallic, roughness = m.roughness;
  if (m.metallic_roughness_texture.image >= 0) {
    roughness *= mean_channel(image_of(m.metallic_roughness_texture), 1);
    metallic *= mean_channel(image_of(m.metallic_roughness_texture), 2);
    warn("metalness and roughness textures are replaced by their mean");
  }
  const float alpha = std::max(roughness * roughness, 0.0064f);
  const std::string gloss = fmt::format("\"float roughness\" [ {} ] \"bool remaproughness\" false", alpha);
  warn("pbrt's materials differ from Lumigrove's; --force-diffuse writes ones that are the same");
  if (metallic >= 0.5f) {
    line("# approximate: metalness {}, pbrt's conductor has Smith shadowing and no Schlick Fresnel",
         metallic);
    return fmt::format("\"string type\" \"conductor\" {} {}", reflectance(index, m), gloss);
  }
  if (roughness > kRoughestCoat) {
    line("# approximate: without the gloss of F0 = 0.04, roughness {}", roughness);
    return fmt::format("\"string type\" \"diffuse\" {}", reflectance(index, m));
  }
  line("# approximate: a dielectric coat of eta 1.5 instead of a gloss lobe added to the diffuse one");
  return fmt::format("\"string type\" \"coateddiffuse\" {} {}", reflectance(index, m), gloss);
}

// Cut-outs: what passes the alpha test is 1, the rest 0.
void PbrtWriter::add_alpha(std::size_t index, const Material& m) {
  const Image8or32 mask = map_texels(image_of(m.base_color_texture), [&](vec4 t) {
    return vec4(vec3(m.alpha * t.w >= m.alpha_cutoff ? 1.0f : 0.0f), 1);
  });
  const std::string file = write_companion(fmt::format("alpha{}.png", index),
                                           encode_png(to_8_bits(mask), TextureContent::kData).bytes);
  add_image_texture(fmt::format("alpha{}", index), "float", file, m.base_color_texture);
}

std::string PbrtWriter::normal_map(std::size_t index, const Material& m) {
  if (m.normal_texture.image < 0) return "";
  const Image8or32 map = map_texels(image_of(m.normal_texture), [&](vec4 t) {
    const vec3 n = (2.0f * vec3(t) - 1.0f) * vec3(m.normal_scale, m.normal_scale, 1);
    return vec4(0.5f + 0.5f * glm::normalize(n), 1);
  });
  const std::string file = write_companion(fmt::format("normal{}.png", index),
                                           encode_png(to_8_bits(map), TextureContent::kData).bytes);
  return fmt::format(" \"string normalmap\" \"{}\"", file);
}

void PbrtWriter::check_texture_coordinates(const Material& m) {
  const std::vector<const TextureUse*> uses = used_textures(m);
  for (const TextureUse* use : uses)
    if (use->uv_set != uses[0]->uv_set || use->offset != uses[0]->offset || use->scale != uses[0]->scale ||
        use->rotation != uses[0]->rotation)
      warn("textures of one material use different coordinates; pbrt gets those of the first");
}

void PbrtWriter::add_material(std::size_t index) {
  const Material& m = scene_.materials[index];
  check_texture_coordinates(m);
  if (!m.name.empty()) line("# {}", printable(m.name));
  const std::string surface_text = surface(index, m);  // writes lines of its own
  line("MakeNamedMaterial \"material{}\" {}{}", index, surface_text, normal_map(index, m));
  if (has_alpha_texture(m)) add_alpha(index, m);
  if (emits(m) && m.emissive_texture.image >= 0) {
    const Image8or32 glow =
        map_texels(image_of(m.emissive_texture), [&](vec4 t) { return vec4(m.emission, 1) * t; });
    emission_files_[static_cast<int>(index)] =
        write_companion(fmt::format("emission{}.exr", index), encode_exr(glow));
    warn("pbrt keeps a copy of an emissive texture for every triangle that uses it");
  }
}

// --- lights
// ----------------------------------------------------------------------------------------------------

void PbrtWriter::add_light(const LightInstance& light) {
  const PunctualLight& l = light.light;
  if (max_component(l.color) <= 0) return;
  if (l.range > 0) warn("pbrt's lights have no range: they reach infinitely far");
  if (!l.name.empty()) line("# {}", printable(l.name));
  const vec3 to = light.position + light.direction;
  switch (l.type) {
    case LightType::kPoint:
      line("LightSource \"point\" \"rgb I\" [ {} ] \"point3 from\" [ {} ]", numbers(l.color),
           numbers(light.position));
      break;
    case LightType::kSpot:
      line("# approximate: between the cones pbrt falls off by smoothstep, Lumigrove by a square");
      line(
          "LightSource \"spot\" \"rgb I\" [ {} ] \"point3 from\" [ {} ] \"point3 to\" [ {} ] \"float "
          "coneangle\" [ {} "
          "] \"float conedeltaangle\" [ {} ]",
          numbers(l.color), numbers(light.position), numbers(to), degrees(l.outer_cone),
          degrees(l.outer_cone - l.inner_cone));
      break;
    case LightType::kDirectional:
      line("LightSource \"distant\" \"rgb L\" [ {} ] \"point3 from\" [ 0 0 0 ] \"point3 to\" [ {} ]",
           numbers(l.color), numbers(light.direction));
      break;
  }
}

void PbrtWriter::add_environment() {
  const Environment& environment = scene_.environment;
  if (max_component(environment.radiance) <= 0) return;
  if (environment.image < 0) {
    line("LightSource \"infinite\" \"rgb L\" [ {} ]\n", numbers(environment.radiance));
    return;
  }
  const Image8or32& source = scene_.images[static_cast<std::size_t>(environment.image)];
  const Image8or32 square =
      map_texels(equal_area_environment(source), [&](vec4 t) { return vec4(environment.radiance, 1) * t; });
  const std::string file = write_companion("environment.exr", encode_exr(square));
  line("LightSource \"infinite\" \"string filename\" \"{}\"\n", file);
}

// --- meshes
// ----------------------------------------------------------------------------------------------------

PlyContent PbrtWriter::ply_of(const Mesh& mesh) const {
  PlyContent ply{mesh.positions, mesh.normals, {}, mesh.triangles};
  const std::vector<const TextureUse*> uses = used_textures(material_of(mesh));
  if (uses.empty()) return ply;
  const std::vector<vec2>& uv = uses[0]->uv_set == 0 ? mesh.uv0 : mesh.uv1;
  ply.uv.reserve(uv.size());
  for (const vec2 p : uv) ply.uv.push_back(pbrt_uv(*uses[0], p));
  return ply;
}

void PbrtWriter::add_shape(const Mesh& mesh, const std::string& ply) {
  const Material& m = material_of(mesh);
  if (!mesh.colors.empty()) warn("pbrt has no vertex colours; they are left out");
  line("  NamedMaterial \"material{}\"", mesh.material);
  line("  Shape \"plymesh\" \"string filename\" \"{}\"{}", ply,
       has_alpha_texture(m) ? fmt::format(" \"texture alpha\" \"alpha{}\"", mesh.material) : "");
}

// World space; the side that emits stays the same under mirroring. pbrt turns the emitting side towards
// vertex normals where a mesh has them, so that they are kept only when they agree with the winding
// everywhere.
PlyContent to_world(PlyContent ply, const mat4x3& m) {
  const mat3 cofactors = normal_matrix(m);
  const bool mirrors = glm::determinant(mat3(m[0], m[1], m[2])) < 0;
  for (vec3& p : ply.positions) p = transform_point(m, p);
  for (vec3& n : ply.normals) {
    n = cofactors * n * (mirrors ? -1.0f : 1.0f);
    if (glm::dot(n, n) > 0) n = glm::normalize(n);
  }
  bool agree = true;
  for (uvec3& t : ply.triangles) {
    if (mirrors) std::swap(t.y, t.z);
    const vec3 p = ply.positions[t.x];
    const vec3 winding = glm::cross(ply.positions[t.y] - p, ply.positions[t.z] - p);
    for (int k = 0; k < 3 && !ply.normals.empty(); ++k)
      agree = agree && glm::dot(winding, ply.normals[t[k]]) > 0;
  }
  if (!agree) ply.normals.clear();
  return ply;
}

void PbrtWriter::add_emissive(const MeshInstance& instance, std::size_t number) {
  const Mesh& mesh = scene_.meshes[static_cast<std::size_t>(instance.mesh)];
  const Material& m = material_of(mesh);
  const std::string ply = write_companion(fmt::format("emitter{}.ply", number),
                                          encode_ply(to_world(ply_of(mesh), instance.to_world)));
  line("AttributeBegin");
  const auto file = emission_files_.find(mesh.material);
  const std::string radiance = file == emission_files_.end()
                                   ? fmt::format("\"rgb L\" [ {} ]", numbers(m.emission))
                                   : fmt::format("\"string filename\" \"{}\"", file->second);
  line("  AreaLightSource \"diffuse\" {} \"bool twosided\" {}", radiance, m.double_sided);
  add_shape(mesh, ply);
  line("AttributeEnd");
}

std::string pbrt_matrix(const mat4x3& m) {
  const mat4 full(vec4(m[0], 0), vec4(m[1], 0), vec4(m[2], 0), vec4(m[3], 1));
  return numbers(std::span(glm::value_ptr(full), 16));
}

void PbrtWriter::add_meshes() {
  std::map<int, std::vector<std::size_t>> instances_of;  // meshes that do not emit
  for (std::size_t i = 0; i < state_.instances.size(); ++i) {
    const Mesh& mesh = scene_.meshes[static_cast<std::size_t>(state_.instances[i].mesh)];
    if (mesh.triangles.empty() || invisible(material_of(mesh))) continue;
    if (emits(material_of(mesh)))
      add_emissive(state_.instances[i], i);
    else
      instances_of[state_.instances[i].mesh].push_back(i);
  }
  for (const auto& [index, instances] : instances_of) {
    const Mesh& mesh = scene_.meshes[static_cast<std::size_t>(index)];
    const std::string ply = write_companion(fmt::format("mesh{}.ply", index), encode_ply(ply_of(mesh)));
    const bool shared = instances.size() > 1;
    if (shared) {
      line("ObjectBegin \"mesh{}\"", index);
      add_shape(mesh, ply);
      line("ObjectEnd");
    }
    for (const std::size_t i : instances) {
      line("AttributeBegin");
      line("  ConcatTransform [ {} ]", pbrt_matrix(state_.instances[i].to_world));
      if (shared)
        line("  ObjectInstance \"mesh{}\"", index);
      else
        add_shape(mesh, ply);
      line("AttributeEnd");
    }
  }
}

void PbrtWriter::write(int camera, int width, int height, int spp) {
  add_header(camera, width, height, spp);
  const fs::path folder = file_.parent_path() / folder_name_;
  std::error_code error;
  const bool created = fs::create_directory(folder, error);
  if (error) throw Error(fmt::format("{}: cannot be created: {}", folder.string(), error.message()));
  try {
    std::set<int> used;
    for (const MeshInstance& instance : state_.instances)
      used.insert(scene_.meshes[static_cast<std::size_t>(instance.mesh)].material);
    for (const int material : used) add_material(static_cast<std::size_t>(material));
    text_ += '\n';
    add_environment();
    for (const LightInstance& light : state_.lights) add_light(light);
    text_ += '\n';
    add_meshes();
    const auto* first = reinterpret_cast<const std::uint8_t*>(text_.data());
    write_file_atomically(file_, {first, text_.size()});
  } catch (...) {
    if (created) fs::remove_all(folder, error);
    throw;
  }
}

std::vector<std::string> PbrtWriter::take_warnings() { return {warnings_.begin(), warnings_.end()}; }

}  // namespace

std::vector<std::string> export_pbrt(const Scene& scene, double seconds, int camera, int width, int height,
                                     int spp, const fs::path& file, bool force_diffuse) {
  if (lower_case_extension(file) != ".pbrt")
    throw Error(fmt::format("{}: a pbrt file must end in .pbrt", file.string()));
  if (width < 1 || height < 1 || spp < 1)
    throw Error(fmt::format("{}: image size and samples must be at least 1, not {} x {} and {}",
                            file.string(), width, height, spp));
  if (printable(file.filename().string()) != file.filename().string())
    throw Error(
        fmt::format("{}: a pbrt file name must not contain quotes or control characters", file.string()));
  PbrtWriter writer(scene, seconds, file, force_diffuse);
  writer.write(camera, width, height, spp);
  return writer.take_warnings();
}

}  // namespace lumigrove
