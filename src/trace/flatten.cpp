#include "trace/flatten.h"

#include <algorithm>
#include <numeric>

namespace lumigrove {
namespace {

const Mesh& mesh_of(const Scene& scene, const MeshInstance& instance) {
  return scene.meshes[static_cast<std::size_t>(instance.mesh)];
}

// For every mesh: may the instances of it that do not move be baked?
std::vector<bool> choose_baked_meshes(const Scene& scene, const SceneState& state) {
  std::vector<std::size_t> uses(scene.meshes.size(), 0);
  for (const MeshInstance& instance : state.instances) {
    if (!instance.moves) ++uses[static_cast<std::size_t>(instance.mesh)];
  }
  std::vector<bool> baked(scene.meshes.size(), false);
  std::vector<std::size_t> shared;
  for (std::size_t m = 0; m < uses.size(); ++m) {
    if (uses[m] == 1) baked[m] = true;
    if (uses[m] > 1) shared.push_back(m);
  }
  std::stable_sort(shared.begin(), shared.end(), [&](std::size_t a, std::size_t b) {
    return scene.meshes[a].triangles.size() < scene.meshes[b].triangles.size();
  });
  std::size_t copies = 0;
  for (const std::size_t m : shared) {
    copies += uses[m] * scene.meshes[m].triangles.size();
    if (copies > kMaxBakedCopies) break;
    baked[m] = true;
  }
  return baked;
}

}  // namespace

TracePlan plan_trace(const Scene& scene, const SceneState& state) {
  const std::vector<bool> bake = choose_baked_meshes(scene, state);
  TracePlan plan;
  for (std::uint32_t i = 0; i < state.instances.size(); ++i) {
    const MeshInstance& instance = state.instances[i];
    const Mesh& mesh = mesh_of(scene, instance);
    if (mesh.triangles.empty()) continue;
    const bool masked =
        scene.materials[static_cast<std::size_t>(mesh.material)].alpha_mode == AlphaMode::kMask;
    if (instance.moves || !bake[static_cast<std::size_t>(instance.mesh)]) {
      plan.instanced.push_back(i);
    } else {
      (masked ? plan.masked : plan.baked).push_back(i);
    }
  }
  return plan;
}

}  // namespace lumigrove
