// FNV-1a (Fowler, Noll, Vo), 64 bit, over everything that can change a picture. Long arrays are hashed in
// chunks of a fixed size side by side and the chunk hashes are hashed again, so that the result does not
// depend on threads.
#include <fmt/format.h>

#include <span>
#include <type_traits>

#include "device/device.h"
#include "lumigrove/scene.h"

namespace lumigrove {
namespace {

constexpr std::uint64_t kFnvOffset = 0xcbf29ce484222325ull;
constexpr std::uint64_t kFnvPrime = 0x100000001b3ull;
constexpr std::size_t kChunk = std::size_t{1} << 20;

std::uint64_t fnv1a(std::span<const std::byte> bytes, std::uint64_t hash) {
  for (const std::byte b : bytes) hash = (hash ^ static_cast<std::uint64_t>(b)) * kFnvPrime;
  return hash;
}

class Hasher {
 public:
  // For types without padding: numbers, enumerations, vectors and matrices of them.
  template <class T>
  void add(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    add_bytes(std::as_bytes(std::span(&value, 1)));
  }
  void add(const std::string& text) {
    add(text.size());
    add_bytes(std::as_bytes(std::span(text)));
  }
  template <class T>
  void add(const std::vector<T>& array) {
    static_assert(std::is_trivially_copyable_v<T>);
    add(array.size());
    add_bytes(std::as_bytes(std::span(array)));
  }
  void add(const TextureUse& use) {
    add_all(use.image, use.uv_set, use.wrap_u, use.wrap_v, use.nearest, use.offset, use.scale, use.rotation);
  }
  template <class... T>
  void add_all(const T&... values) {
    (add(values), ...);
  }
  std::uint64_t value() const { return hash_; }

 private:
  void add_bytes(std::span<const std::byte> bytes) {
    if (bytes.size() <= kChunk) {
      hash_ = fnv1a(bytes, hash_);
      return;
    }
    std::vector<std::uint64_t> chunks((bytes.size() + kChunk - 1) / kChunk);
    launch(
        static_cast<int>(chunks.size()),
        [&](int i) {
          const std::size_t begin = static_cast<std::size_t>(i) * kChunk;
          chunks[static_cast<std::size_t>(i)] =
              fnv1a(bytes.subspan(begin, std::min(kChunk, bytes.size() - begin)), kFnvOffset);
        },
        1);
    hash_ = fnv1a(std::as_bytes(std::span(chunks)), hash_);
  }

  std::uint64_t hash_ = kFnvOffset;
};

void add_geometry(Hasher& hash, const Scene& scene) {
  hash.add(scene.meshes.size());
  for (const Mesh& m : scene.meshes)
    hash.add_all(m.positions, m.normals, m.tangents, m.uv0, m.uv1, m.colors, m.triangles, m.material);
}

void add_appearance(Hasher& hash, const Scene& scene) {
  hash.add(scene.materials.size());
  for (const Material& m : scene.materials)
    hash.add_all(m.base_color, m.alpha, m.metallic, m.roughness, m.emission, m.normal_scale, m.alpha_cutoff,
                 m.alpha_mode, m.double_sided, m.base_color_texture, m.metallic_roughness_texture,
                 m.normal_texture, m.emissive_texture);
  hash.add(scene.images.size());
  for (const Image8or32& i : scene.images) hash.add_all(i.width, i.height, i.srgb, i.texels8, i.texels32);
  hash.add_all(scene.environment.radiance, scene.environment.image);
}

void add_hierarchy(Hasher& hash, const Scene& scene) {
  hash.add(scene.nodes.size());
  for (const Node& n : scene.nodes)
    hash.add_all(n.parent, n.translation, n.rotation, n.scale, n.has_matrix, n.matrix, n.meshes, n.light,
                 n.camera);
  hash.add(scene.lights.size());
  for (const PunctualLight& l : scene.lights)
    hash.add_all(l.type, l.color, l.range, l.inner_cone, l.outer_cone);
  hash.add(scene.cameras.size());
  for (const Camera& c : scene.cameras) hash.add_all(c.name, c.vertical_fov, c.znear);  // chosen by name
}

void add_motion(Hasher& hash, const Scene& scene) {
  hash.add(scene.animations.size());
  for (const Animation& animation : scene.animations) {
    hash.add(animation.channels.size());
    for (const AnimationChannel& c : animation.channels)
      hash.add_all(c.node, c.property, c.interpolation, c.times, c.values);
  }
}

}  // namespace

std::string content_hash(const Scene& scene) {
  Hasher hash;
  add_geometry(hash, scene);
  add_appearance(hash, scene);
  add_hierarchy(hash, scene);
  add_motion(hash, scene);
  return fmt::format("{:016x}", hash.value());
}

}  // namespace lumigrove
