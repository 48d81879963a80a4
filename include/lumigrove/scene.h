// A scene as plain arrays: what importers fill, exporters read, and `evaluate` turns into one moment in time.
// Units: metres; linear RGB; radiance W/(sr m^2), intensity W/sr, irradiance W/m^2 (docs/units.md).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "lumigrove/error.h"
#include "lumigrove/vec.h"

namespace lumigrove {

enum class Wrap : std::uint8_t { kRepeat, kClamp, kMirror };

// Row 0 is the top row, v grows downwards (glTF). Exactly one of the two texel arrays is filled, RGBA interleaved.
struct Image8or32 {
  std::string name;            // file name or label, for messages
  int width = 0, height = 0;
  bool srgb = false;           // texels8 hold sRGB-encoded colour (alpha is linear)
  std::vector<std::uint8_t> texels8;
  std::vector<float> texels32;
};

// A use of an image by a material slot (sampler and KHR_texture_transform included).
struct TextureUse {
  int image = -1;              // index into Scene::images, -1 none
  int uv_set = 0;              // 0 or 1
  Wrap wrap_u = Wrap::kRepeat, wrap_v = Wrap::kRepeat;
  bool nearest = false;        // otherwise bilinear
  vec2 offset = vec2(0), scale = vec2(1);
  float rotation = 0;          // radians, as KHR_texture_transform
};

enum class AlphaMode : std::uint8_t { kOpaque, kMask };

// Metallic-roughness material (glTF 2.0). Emission is one-sided unless double_sided.
struct Material {
  std::string name;
  vec3 base_color = vec3(0.8f);
  float alpha = 1;
  float metallic = 0;
  float roughness = 1;
  vec3 emission = vec3(0);     // radiance, emissive_strength included
  float normal_scale = 1;
  float alpha_cutoff = 0.5f;
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  bool double_sided = false;
  TextureUse base_color_texture, metallic_roughness_texture, normal_texture, emissive_texture;
};

// One triangle mesh with one material (a glTF primitive). Optional arrays are empty or one entry a vertex.
struct Mesh {
  std::string name;
  std::vector<vec3> positions;
  std::vector<vec3> normals;
  std::vector<vec4> tangents;  // w = handedness
  std::vector<vec2> uv0, uv1;
  std::vector<vec4> colors;    // linear, multiplies base colour
  std::vector<uvec3> triangles;
  int material = 0;
};

enum class LightType : std::uint8_t { kPoint, kSpot, kDirectional };

// KHR_lights_punctual. Emits along the node's -Z. `color` includes the intensity: W/sr (point, spot) or W/m^2.
struct PunctualLight {
  std::string name;
  LightType type = LightType::kPoint;
  vec3 color = vec3(1);
  float range = 0;             // metres, 0 = unlimited
  float inner_cone = 0;        // radians, spot only
  float outer_cone = kPi / 4;  // radians, spot only
};

struct Camera {
  std::string name;
  float vertical_fov = 0.8f;   // radians
  float znear = 0.01f;
};

// A node of the hierarchy. When `has_matrix` is false the local map is T*R*S (rotation a unit quaternion x,y,z,w).
struct Node {
  std::string name;
  int parent = -1;             // index < own index is not required
  vec3 translation = vec3(0);
  vec4 rotation = vec4(0, 0, 0, 1);
  vec3 scale = vec3(1);
  bool has_matrix = false;
  mat4 matrix = mat4(1);
  std::vector<int> meshes;     // indices into Scene::meshes
  int light = -1, camera = -1;
};

enum class Interpolation : std::uint8_t { kLinear, kStep, kCubicSpline };
enum class AnimatedProperty : std::uint8_t { kTranslation, kRotation, kScale };

// One animated property of one node. values: one vec4 a key (xyz or quaternion); cubic splines hold three a key
// (in-tangent, value, out-tangent), as glTF.
struct AnimationChannel {
  int node = -1;
  AnimatedProperty property = AnimatedProperty::kTranslation;
  Interpolation interpolation = Interpolation::kLinear;
  std::vector<float> times;    // seconds, increasing
  std::vector<vec4> values;
};
struct Animation {
  std::string name;
  std::vector<AnimationChannel> channels;
};

// Light from infinitely far away: constant `radiance` times the optional equirectangular image (row 0 = +Y up,
// column centre = -Z, u grows towards +X).
struct Environment {
  vec3 radiance = vec3(0);
  int image = -1;
};

struct Scene {
  std::string name;            // file path or built-in name with its parameters
  std::vector<Node> nodes;
  std::vector<Mesh> meshes;
  std::vector<Material> materials;
  std::vector<Image8or32> images;
  std::vector<PunctualLight> lights;
  std::vector<Camera> cameras;
  std::vector<Animation> animations;
  Environment environment;
  std::vector<std::string> warnings;  // one sentence each, already complete
};

// --- one moment ---------------------------------------------------------------------------------------------

struct MeshInstance {
  int mesh = 0, node = 0;
  mat4x3 to_world = mat4x3(1);
  bool moves = false;          // an animation reaches this node or one above it
};
struct LightInstance {
  PunctualLight light;         // colour, cones, range (not scaled by the node)
  int node = 0;
  vec3 position = vec3(0);
  vec3 direction = vec3(0, 0, -1);  // unit, where it shines
};
struct CameraInstance {
  Camera camera;
  int node = 0;
  vec3 position = vec3(0), right = vec3(1, 0, 0), up = vec3(0, 1, 0), forward = vec3(0, 0, -1);  // orthonormal
};

// All nodes that carry something, at one time, in node order: indices are stable over time and identify lights.
struct SceneState {
  std::vector<MeshInstance> instances;
  std::vector<LightInstance> lights;
  std::vector<CameraInstance> cameras;
  Box3 bounds;                 // of all instanced geometry (positions of punctual lights not included)
  float diagonal = 1;          // D of methods' length constants: diagonal of `bounds`; 1 when there is no geometry
};

// World transforms of every node at `seconds` (clamped to each channel's keys); all animations play together.
// Throws Error on cycles in the hierarchy or non-finite transforms.
SceneState evaluate(const Scene& scene, double seconds);

// Last key time over all animations in seconds, 0 when nothing moves.
double duration(const Scene& scene);

// Checks indices, finite values and sizes; repairs what is harmless (drops zero-area or NaN triangles with one
// warning, clamps negative emission with one warning) and throws Error for what is not. Every importer and every
// built-in scene ends with it.
void validate(Scene& scene);

// Content hash (FNV-1a 64 over the arrays), hex; part of the receipt.
std::string content_hash(const Scene& scene);

// A view that shows the whole scene, for scenes without a camera: looking along -Z and slightly down.
CameraInstance default_camera(const SceneState& state);

// --- sources and sinks ---------------------------------------------------------------------------------------
// Every function here throws Error with one sentence naming the file or parameter at fault.

// Dispatches: a built-in name ("night-city", "night-city?lights=50000&seed=3") or a file by its extension
// (.gltf .glb by tinygltf; .obj .ply .fbx .stl .dae and some others by Assimp).
Scene load_scene(const std::string& name_or_path);

// Exporters write to a temporary beside `file` and rename; they expect a validated scene. They return one sentence for
// each thing that the format cannot hold exactly.
std::vector<std::string> export_gltf(const Scene& scene, const std::filesystem::path& file);  // .glb, .gltf (embedded)
// pbrt-v4 at one moment, seen by camera `camera` of evaluate()'s list (-1: the default view), `width` x `height` pixels;
// meshes and textures go to the folder <stem>_files beside `file`. pbrt's materials equal ours only for diffuse surfaces:
// `force_diffuse` writes every material so, for comparisons with Settings::force_diffuse.
std::vector<std::string> export_pbrt(const Scene& scene, double seconds, int camera, int width, int height, int spp,
                                     const std::filesystem::path& file, bool force_diffuse = false);

struct SceneParameter {
  std::string name, default_value, description;
};
struct BuiltinScene {
  std::string name, description;
  std::vector<SceneParameter> parameters;
  bool animated = false;
};
const std::vector<BuiltinScene>& builtin_scenes();                  // src/scene/builtin/builtin.cpp
bool is_builtin_scene(std::string_view name_with_parameters);
Scene make_builtin_scene(const std::string& name_with_parameters);  // throws Error listing the valid names/parameters

}  // namespace lumigrove
