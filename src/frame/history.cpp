#include "frame/history.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/vec.h"
#include "device/device.h"

namespace lumigrove {
namespace {

// A hash as fast as memory. Words go into four chains by turns, so that no multiplication waits for the one before.
std::uint64_t hash_bytes(std::span<const std::byte> bytes) {
  constexpr std::uint64_t kFactor = 0x9e3779b97f4a7c15ull;
  std::uint64_t chains[4] = {bytes.size(), 1, 2, 3};
  const auto mix = [](std::uint64_t& chain, std::uint64_t word) { chain = std::rotl(chain ^ word, 29) * kFactor; };
  std::size_t at = 0;
  for (; at + 32 <= bytes.size(); at += 32) {
    std::uint64_t words[4];
    std::memcpy(words, bytes.data() + at, 32);
    for (int i = 0; i < 4; ++i) mix(chains[i], words[i]);
  }
  for (int i = 0; at < bytes.size(); at += 8, ++i) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min<std::size_t>(8, bytes.size() - at));
    mix(chains[i], word);
  }
  std::uint64_t hash = 0;
  for (const std::uint64_t chain : chains) mix(hash, chain ^ (chain >> 32));
  return hash ^ (hash >> 32);
}

class Key {
 public:
  explicit Key(std::uint64_t start) : words_{start} {}

  // Types without padding.
  template <class... T>
  void add(const T&... values) {
    static_assert((std::is_trivially_copyable_v<T> && ...));
    (words_.push_back(hash_bytes(std::as_bytes(std::span(&values, 1)))), ...);
  }
  template <class T>
  void add_array(const std::vector<T>& array) {
    const std::span<const std::byte> bytes = std::as_bytes(std::span(array));
    constexpr std::size_t kChunk = std::size_t{1} << 18;
    const std::size_t chunks = (bytes.size() + kChunk - 1) / kChunk, first = words_.size();
    words_.resize(first + chunks);
    launch(
        static_cast<int>(chunks),
        [&](int i) {
          const std::size_t begin = static_cast<std::size_t>(i) * kChunk;
          words_[first + static_cast<std::size_t>(i)] =
              hash_bytes(bytes.subspan(begin, std::min(kChunk, bytes.size() - begin)));
        },
        1);
    words_.push_back(bytes.size());
  }
  void add_image(const Scene& scene, int number) {
    add(number);
    if (number < 0) return;
    const Image8or32& image = scene.images[static_cast<std::size_t>(number)];
    add(image.width, image.height, image.srgb);
    add_array(image.texels8);
    add_array(image.texels32);
  }
  std::uint64_t value() const { return hash_bytes(std::as_bytes(std::span(words_))); }

 private:
  std::vector<std::uint64_t> words_;
};

const Material& material_of(const Scene& scene, const Mesh& mesh) {
  return scene.materials[static_cast<std::size_t>(mesh.material)];
}

bool emits(const Material& material) { return max_component(material.emission) > 0; }

}  // namespace

std::uint64_t texture_key(const Scene& scene) {
  Key key(scene.meshes.size());
  for (const Mesh& mesh : scene.meshes) {
    const Material& material = material_of(scene, mesh);
    const TextureUse& use = material.emissive_texture;
    const bool textured = emits(material) && use.image >= 0;
    key.add(mesh.triangles.size(), material.emission, textured);
    if (!textured) continue;
    key.add(use.image, use.uv_set, use.wrap_u, use.wrap_v, use.nearest, use.offset, use.scale, use.rotation);
    key.add_array(mesh.triangles);
    key.add_array(use.uv_set == 0 ? mesh.uv0 : mesh.uv1);
  }
  std::vector<bool> seen(scene.images.size(), false);
  for (const Mesh& mesh : scene.meshes) {
    const Material& material = material_of(scene, mesh);
    const int image = material.emissive_texture.image;
    if (!emits(material) || image < 0 || seen[static_cast<std::size_t>(image)]) continue;
    seen[static_cast<std::size_t>(image)] = true;
    key.add_image(scene, image);
  }
  key.add(scene.environment.radiance);
  key.add_image(scene, scene.environment.image);
  return key.value();
}

std::uint64_t shape_key(const Scene& scene, const Settings& settings, std::uint64_t texture_key) {
  Key key(texture_key);
  key.add(settings.light_scale);  // intensities are divided by the light's luminance, which rounds
  for (const Mesh& mesh : scene.meshes) {
    const Material& material = material_of(scene, mesh);
    if (!emits(material)) continue;
    key.add(material.double_sided);
    key.add_array(mesh.positions);
    key.add_array(mesh.triangles);
  }
  return key.value();
}

History::Kept take_kept(History::Kept& kept, const Scene& scene, const Settings& settings) {
  History::Kept taken = std::exchange(kept, {});
  const std::uint64_t textures = texture_key(scene);
  const std::uint64_t shapes =
      settings.direct.hierarchy == Hierarchy::kTwoLevel ? shape_key(scene, settings, textures) : 0;
  if (taken.texture_key != textures) taken.lights.reset();
  if (taken.shape_key != shapes) taken.two_level = {};
  taken.texture_key = textures;
  taken.shape_key = shapes;
  return taken;
}

History::History() = default;
History::~History() = default;
History::History(History&&) noexcept = default;
History& History::operator=(History&&) noexcept = default;

History::Kept& History::kept() {
  if (!kept_) kept_ = std::make_unique<Kept>();
  return *kept_;
}

}  // namespace lumigrove
