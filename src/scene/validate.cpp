// What every scene promises to the rest of the engine: indices in range, finite numbers, arrays of matching
// length, triangles with an area. Harmless faults are repaired and reported in one warning a kind; the others
// are errors.
#include <fmt/format.h>

#include <algorithm>
#include <cfloat>
#include <limits>
#include <map>

#include "base/vec.h"
#include "lumigrove/scene.h"
#include "scene/hierarchy.h"

namespace lumigrove {
namespace {

// Beyond this, areas and squared distances overflow single precision.
constexpr float kLargestCoordinate = 1e9f;
constexpr std::size_t kLargestArray = std::numeric_limits<std::int32_t>::max();
constexpr int kLargestImageSide = 1 << 16;

bool is_finite(vec2 v) { return lumigrove::is_finite(v.x) && lumigrove::is_finite(v.y); }
bool is_finite(vec4 v) { return lumigrove::is_finite(vec3(v)) && lumigrove::is_finite(v.w); }
using lumigrove::is_finite;

class Validator {
 public:
  explicit Validator(Scene& scene) : scene_(scene) {}

  void run() {
    check_counts();
    check_images();
    check_materials();
    for (std::size_t i = 0; i < scene_.meshes.size(); ++i) check_mesh(i);
    check_lights();
    check_cameras();
    check_nodes();
    check_animations();
    check_environment();
    for (const auto& [what, count] : repairs_)
      scene_.warnings.push_back(fmt::format("{}: {} {}", scene_.name, count, what));
  }

 private:
  [[noreturn]] void fail(const std::string& sentence) const { throw Error(scene_.name + ": " + sentence); }

  void require(bool good, const char* kind, std::size_t index, const std::string& name,
               const char* fault) const {
    if (!good) fail(label(kind, index, name) + " " + fault);
  }

  void repaired(const char* what, std::size_t count = 1) {
    if (count > 0) repairs_[what] += count;
  }

  // Moves `value` into [low, high]; `what` is reported when that changed it.
  template <class T>
  void clamp(T& value, float low, float high, const char* what) {
    const T inside = glm::clamp(value, T(low), T(high));
    if (inside == value) return;
    value = inside;
    repaired(what);
  }

  static bool in_range(int index, std::size_t count) {
    return index >= 0 && static_cast<std::size_t>(index) < count;
  }
  static bool in_range_or_none(int index, std::size_t count) { return index == -1 || in_range(index, count); }

  void check_counts() const {
    const std::size_t largest =
        std::max({scene_.nodes.size(), scene_.meshes.size(), scene_.materials.size(), scene_.images.size(),
                  scene_.lights.size(), scene_.cameras.size(), scene_.animations.size()});
    if (largest > kLargestArray) fail(fmt::format("{} objects of one kind are too many", largest));
  }

  void check_images() {
    for (std::size_t i = 0; i < scene_.images.size(); ++i) {
      Image8or32& image = scene_.images[i];
      const auto good = [&](bool condition, const char* fault) {
        require(condition, "image", i, image.name, fault);
      };
      good(image.width > 0 && image.height > 0, "has no pixels");
      good(image.width <= kLargestImageSide && image.height <= kLargestImageSide,
           "is more than 65536 pixels wide or high");
      good(image.texels8.empty() != image.texels32.empty(), "must have 8-bit or float texels, and not both");
      const std::size_t values =
          4 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
      good(std::max(image.texels8.size(), image.texels32.size()) == values,
           "has a number of texels that does not fit its size");
      std::size_t bad = 0;
      for (float& value : image.texels32)
        if (!(value >= 0.0f && value < kInfinity)) value = 0, ++bad;
      repaired("negative or non-finite texture values were set to zero", bad);
    }
  }

  void check_texture(const TextureUse& use, std::size_t material, const std::string& name) {
    const auto good = [&](bool condition, const char* fault) {
      require(condition, "material", material, name, fault);
    };
    good(in_range_or_none(use.image, scene_.images.size()), "uses an image that does not exist");
    good(use.uv_set == 0 || use.uv_set == 1, "uses a texture coordinate set other than 0 and 1");
    good(is_finite(use.offset) && is_finite(use.scale) && is_finite(use.rotation),
         "has a texture transform that is not finite");
  }

  void check_materials() {
    for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
      Material& m = scene_.materials[i];
      for (const TextureUse* use :
           {&m.base_color_texture, &m.metallic_roughness_texture, &m.normal_texture, &m.emissive_texture})
        check_texture(*use, i, m.name);
      const bool finite = is_finite(m.base_color) && is_finite(m.emission) && is_finite(m.alpha) &&
                          is_finite(m.metallic) && is_finite(m.roughness) && is_finite(m.normal_scale) &&
                          is_finite(m.alpha_cutoff);
      require(finite, "material", i, m.name, "has a value that is not finite");
      clamp(m.emission, 0, kInfinity, "materials with negative emission now emit nothing in that channel");
      clamp(m.base_color, 0, 1, "base colours were clamped to [0,1]");
      clamp(m.alpha, 0, 1, "alpha values were clamped to [0,1]");
      clamp(m.metallic, 0, 1, "metallic values were clamped to [0,1]");
      clamp(m.roughness, 0, 1, "roughness values were clamped to [0,1]");
    }
  }

  void check_mesh(std::size_t index) {
    Mesh& mesh = scene_.meshes[index];
    const auto good = [&](bool condition, const char* fault) {
      require(condition, "mesh", index, mesh.name, fault);
    };
    const std::size_t count = mesh.positions.size();
    good(in_range(mesh.material, scene_.materials.size()), "uses a material that does not exist");
    good(count <= kLargestArray && mesh.triangles.size() <= kLargestArray, "is too large");
    const auto fits = [&](std::size_t size) { return size == 0 || size == count; };
    good(fits(mesh.normals.size()) && fits(mesh.tangents.size()) && fits(mesh.uv0.size()) &&
             fits(mesh.uv1.size()) && fits(mesh.colors.size()),
         "has a vertex attribute whose length differs from its positions");
    for (const uvec3 t : mesh.triangles)
      good(t.x < count && t.y < count && t.z < count, "has a triangle with a vertex index out of range");
    for (const vec3 p : mesh.positions)
      good(!is_finite(p) || max_component(glm::abs(p)) <= kLargestCoordinate,
           "has a vertex more than 1e9 m from its origin");
    drop_degenerate_triangles(mesh);
    repair_normals(mesh);
    repair_attributes(mesh);
  }

  // A triangle stays when its normal can be computed in single precision.
  void drop_degenerate_triangles(Mesh& mesh) {
    const auto degenerate = [&](uvec3 t) {
      const vec3 p = mesh.positions[t.x];
      const vec3 n = glm::cross(mesh.positions[t.y] - p, mesh.positions[t.z] - p);
      const float n2 = glm::dot(n, n);
      return !(n2 >= FLT_MIN && n2 < kInfinity);
    };
    repaired("triangles without an area or with a vertex that is not finite were dropped",
             std::erase_if(mesh.triangles, degenerate));
    // Only dropped triangles can have used such vertices; bounds must not see them.
    const vec3 somewhere = mesh.triangles.empty() ? vec3(0) : mesh.positions[mesh.triangles[0].x];
    for (vec3& p : mesh.positions)
      if (!is_finite(p)) p = somewhere;
  }

  void repair_normals(Mesh& mesh) {
    const auto bad = [](vec3 n) { return !(glm::dot(n, n) > 1e-12f && glm::dot(n, n) < 1e12f); };
    const std::size_t count =
        static_cast<std::size_t>(std::count_if(mesh.normals.begin(), mesh.normals.end(), bad));
    if (count == 0) return;
    std::vector<vec3> sums(mesh.normals.size(), vec3(0));
    for (const uvec3 t : mesh.triangles) {
      const vec3 p = mesh.positions[t.x];
      const vec3 n = glm::cross(mesh.positions[t.y] - p, mesh.positions[t.z] - p);
      for (int k = 0; k < 3; ++k) sums[t[k]] += n;
    }
    for (std::size_t i = 0; i < sums.size(); ++i)
      if (bad(mesh.normals[i]))
        mesh.normals[i] = glm::dot(sums[i], sums[i]) > 0.0f ? glm::normalize(sums[i]) : vec3(0, 0, 1);
    repaired("vertex normals of length zero or not finite were replaced by those of the surface", count);
  }

  void repair_attributes(Mesh& mesh) {
    for (vec3& n : mesh.normals)
      if (std::abs(glm::dot(n, n) - 1) > 1e-3f) n = glm::normalize(n);
    const auto bad_tangent = [](vec4 t) {
      return !is_finite(t) || !(glm::dot(vec3(t), vec3(t)) > 1e-12f) || (t.w != 1.0f && t.w != -1.0f);
    };
    if (std::any_of(mesh.tangents.begin(), mesh.tangents.end(), bad_tangent)) {
      mesh.tangents.clear();
      repaired("meshes had invalid tangents, which are now derived from texture coordinates");
    }
    std::size_t bad = 0;
    for (std::vector<vec2>* uvs : {&mesh.uv0, &mesh.uv1})
      for (vec2& uv : *uvs)
        if (!is_finite(uv)) uv = vec2(0), ++bad;
    repaired("texture coordinates that were not finite were set to zero", bad);
    bad = 0;
    for (vec4& color : mesh.colors) {
      const vec4 inside = is_finite(color) ? glm::clamp(color, vec4(0), vec4(1)) : vec4(1);
      if (inside != color) color = inside, ++bad;
    }
    repaired("vertex colours were clamped to [0,1]", bad);
  }

  void check_lights() {
    for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
      PunctualLight& light = scene_.lights[i];
      if (light.range == kInfinity) light.range = 0;
      require(is_finite(light.color) && is_finite(light.range) && is_finite(light.inner_cone) &&
                  is_finite(light.outer_cone),
              "light", i, light.name, "has a value that is not finite");
      clamp(light.color, 0, kInfinity, "lights with negative intensity now emit nothing in that channel");
      clamp(light.range, 0, kInfinity, "negative light ranges were taken as unlimited");
      if (light.type != LightType::kSpot) continue;
      clamp(light.outer_cone, 1e-4f, 0.5f * kPi, "spot cone angles were clamped to 90 degrees");
      clamp(light.inner_cone, 0, light.outer_cone, "inner spot cones were clamped to their outer cone");
    }
  }

  void check_cameras() {
    for (std::size_t i = 0; i < scene_.cameras.size(); ++i) {
      const Camera& camera = scene_.cameras[i];
      require(camera.vertical_fov > 0 && camera.vertical_fov < kPi, "camera", i, camera.name,
              "has a vertical field of view outside 0 to 180 degrees");
      require(is_finite(camera.znear) && camera.znear >= 0, "camera", i, camera.name,
              "has a negative or non-finite near distance");
    }
  }

  void check_nodes() {
    for (std::size_t i = 0; i < scene_.nodes.size(); ++i) {
      Node& node = scene_.nodes[i];
      const auto good = [&](bool condition, const char* fault) {
        require(condition, "node", i, node.name, fault);
      };
      good(in_range_or_none(node.parent, scene_.nodes.size()), "has a parent that does not exist");
      for (const int mesh : node.meshes)
        good(in_range(mesh, scene_.meshes.size()), "shows a mesh that does not exist");
      good(in_range_or_none(node.light, scene_.lights.size()), "carries a light that does not exist");
      good(in_range_or_none(node.camera, scene_.cameras.size()), "carries a camera that does not exist");
      bool finite = is_finite(node.translation) && is_finite(node.rotation) && is_finite(node.scale);
      for (int c = 0; c < 4; ++c) finite = finite && is_finite(node.matrix[c]);
      good(finite, "has a transform that is not finite");
      good(normalize_rotation(node.rotation), "has a rotation of length zero");
    }
    parents_first(scene_);  // throws on cycles
  }

  static bool normalize_rotation(vec4& q) {
    const float length = glm::length(q);
    if (!(length > 0.0f && length < kInfinity)) return false;
    if (std::abs(length - 1) > 1e-6f) q /= length;
    return true;
  }

  void check_animations() {
    for (std::size_t i = 0; i < scene_.animations.size(); ++i)
      for (AnimationChannel& channel : scene_.animations[i].channels) check_channel(channel, i);
  }

  void check_channel(AnimationChannel& channel, std::size_t index) {
    const std::string& name = scene_.animations[index].name;
    const auto good = [&](bool condition, const char* fault) {
      require(condition, "animation", index, name, fault);
    };
    good(in_range(channel.node, scene_.nodes.size()), "moves a node that does not exist");
    good(!scene_.nodes[static_cast<std::size_t>(channel.node)].has_matrix,
         "moves a node that is placed by a matrix instead of translation, rotation and scale");
    const bool spline = channel.interpolation == Interpolation::kCubicSpline;
    good(!channel.times.empty(), "has a channel without keys");
    good(channel.values.size() == channel.times.size() * (spline ? 3 : 1),
         "has a channel whose number of values does not fit its number of keys");
    const auto finite_time = [](float t) { return is_finite(t); };
    good(std::all_of(channel.times.begin(), channel.times.end(), finite_time) &&
             std::is_sorted(channel.times.begin(), channel.times.end()),
         "has key times that are not increasing");
    for (std::size_t k = 0; k < channel.values.size(); ++k) {
      good(is_finite(channel.values[k]), "has a value that is not finite");
      const bool is_value = !spline || k % 3 == 1;  // tangents keep their length
      if (channel.property == AnimatedProperty::kRotation && is_value)
        good(normalize_rotation(channel.values[k]), "has a rotation of length zero");
    }
  }

  void check_environment() {
    Environment& environment = scene_.environment;
    if (!is_finite(environment.radiance)) fail("the environment's radiance is not finite");
    if (!in_range_or_none(environment.image, scene_.images.size()))
      fail("the environment uses an image that does not exist");
    clamp(environment.radiance, 0, kInfinity, "negative environment radiance was set to zero");
  }

  Scene& scene_;
  std::map<std::string, std::size_t> repairs_;  // kind of repair -> how often
};

}  // namespace

void validate(Scene& scene) { Validator(scene).run(); }

}  // namespace lumigrove
