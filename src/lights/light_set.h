// All local emitters of one moment (emissive triangles, point and spot lights) as one indexed set, and beside
// it the lights at infinity (directional, environment). Rebuilt every frame. Order: mesh instances in node
// order, their emissive triangles in mesh order, then point and spot lights in node order; so an index means
// the same light for as long as the scene's structure lasts, and `stable_id` tells lights apart over time.
//
// Units: radiance W/(sr m^2), intensity W/sr, irradiance W/m^2, flux W. One-sided triangles emit on the side
// of cross(e1, e2); double-sided ones on both.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/large_array.h"
#include "base/vec.h"
#include "lights/vpl.h"
#include "lumigrove/scene.h"
#include "lumigrove/settings.h"
#include "scene/scene_view.h"

namespace lumigrove {

// 40 bytes. A triangle in world space: p0, edges e1 and e2 wound so that cross(e1, e2) points to the emitting
// side. A point or spot light: p0 = position, e1 = unit axis, e2 = (cos outer, 1 / (cos inner - cos outer),
// unused). A virtual point light: p0 = position, e1 = unit normal, e2 = intensity along it, W/sr.
struct Emitter {
  vec3 p0, e1, e2;
  // Mesh instance, or kPunctual | index into LightView::punctual, or kVpl | index into LightView::vpls.
  std::uint32_t source;

  static constexpr std::uint32_t kPunctual = 0x80000000u, kVpl = 0x40000000u;
  LUMI_HD bool triangle() const { return (source & (kPunctual | kVpl)) == 0; }  // the others have no area
  LUMI_HD bool punctual() const { return (source & kPunctual) != 0; }
  LUMI_HD bool vpl() const { return (source & kVpl) != 0; }
  LUMI_HD std::uint32_t index() const { return source & ~(kPunctual | kVpl); }  // without the kind
};

// What the triangles of one mesh instance share. `first` is kNoEmitters when the instance does not emit.
struct EmissiveInstance {
  vec3 radiance = vec3(0);                   // light scale included, texture not
  std::uint32_t first = kNoEmitters;         // index of its first emitter
  const std::uint32_t* triangles = nullptr;  // emitter - first -> mesh triangle; null: the same number
  const std::uint32_t* ranks =
      nullptr;  // mesh triangle -> emitter - first, kNoEmitters if dropped; null: same
  const vec3* mean_texture =
      nullptr;  // by emitter - first: emissive texture averaged over the triangle; null: 1
  std::uint32_t count = 0;
  std::uint32_t stable_base = 0;  // stable id of the mesh's triangle 0
  bool textured = false, double_sided = false;
  bool masked = false;             // has holes; its flux counts them as shining

  static constexpr std::uint32_t kNoEmitters = 0xffffffffu;
};

struct PunctualView {
  vec3 intensity;  // W/sr on the axis, light scale included
  float range;     // metres, 0 = unlimited
  std::uint32_t stable_id;
  bool spot;
};

struct DirectionalView {
  vec3 direction;   // unit, where the light travels
  vec3 irradiance;  // on a plane that faces it
};

// Environment: constant radiance, or an equirectangular image with a piecewise-constant distribution over its
// texels.
struct EnvironmentView {
  vec3 radiance = vec3(0);  // light scale included
  int image = -1;
  int width = 0, height = 0;
  const float* row_cdf = nullptr;     // height + 1, marginal over rows
  const float* column_cdf = nullptr;  // height * (width + 1), conditional within a row
  LUMI_HD bool present() const { return max_component(radiance) > 0; }
};

struct LightView {
  std::span<const Emitter> emitters;
  std::span<const EmissiveInstance> instances;  // parallel to SceneState::instances
  std::span<const PunctualView> punctual;
  std::span<const DirectionalView> directional;
  EnvironmentView environment;
  Box3 bounds;                 // of the local emitters
  float local_flux = 0;        // Y, sum over emitters
  float environment_flux = 0;  // Y, through the scene's bounding sphere
  float scene_disc = 0;        // m^2, cross-section of the scene's bounding sphere
  float diagonal = 1;          // D, metres
  std::span<const Vpl> vpls;      // sources of the emitters that are virtual point lights
  float vpl_clamp = kInfinity;    // most of cos / d^2 at one, 1/m^2
};

// What does not change from frame to frame: which triangles of each mesh emit, and how brightly their texture
// shines.
struct MeshEmission {
  bool emits = false, textured = false;
  std::vector<std::uint32_t> triangles, ranks;  // empty: every triangle emits
  std::vector<vec3> mean_texture;
  std::uint32_t count = 0;
};

class LightSet {
 public:
  // Integrates emissive textures over their triangles and drops those that cannot emit.
  LightSet(const Scene& scene, const SceneArrays& arrays);

  // The emitters of one moment. `settings`: light_scale, ignore_range. Keeps references to `arrays`' meshes.
  void gather(const SceneArrays& arrays, const SceneState& state, const Settings& settings);

  LightView view() const;
  std::size_t bytes() const;  // per-emitter storage: emitters and texture means
  double gather_ms() const { return gather_ms_; }

 private:
  void build_environment(const SceneArrays& arrays);

  Environment environment_;
  std::vector<MeshEmission> meshes_;
  LargeArray<Emitter> emitters_;
  std::vector<EmissiveInstance> instances_;
  std::vector<PunctualView> punctual_;
  std::vector<DirectionalView> directional_;
  std::vector<float> row_cdf_, column_cdf_;
  float environment_mean_ = 0;  // Y averaged over the sphere, of the image alone
  LightView view_;
  double gather_ms_ = 0;
};

}  // namespace lumigrove
