#include "trace/flatten.h"

#include <algorithm>

namespace lumigrove {
namespace {

const Mesh& mesh_of(const Scene& scene, const MeshInstance& instance) {
  return scene.meshes[static_cast<std::size_t>(instance.mesh)];
}

// For every mesh: may instances of it be baked?
std::vector<bool> choose_baked_meshes(const Scene& scene, const std::vector<std::size_t>& uses) {
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

// Instances of each mesh; those that move do not count unless `moving`.
std::vector<std::size_t> count_uses(const Scene& scene, const SceneState& state, bool moving) {
  std::vector<std::size_t> uses(scene.meshes.size(), 0);
  for (const MeshInstance& instance : state.instances) {
    if (moving || !instance.moves) ++uses[static_cast<std::size_t>(instance.mesh)];
  }
  return uses;
}

std::size_t count_triangles(const Scene& scene, const std::vector<std::size_t>& uses) {
  std::size_t count = 0;
  for (std::size_t m = 0; m < uses.size(); ++m) count += uses[m] * scene.meshes[m].triangles.size();
  return count;
}

}  // namespace

TracePlan plan_trace(const Scene& scene, const SceneState& state) {
  const std::vector<std::size_t> all_uses = count_uses(scene, state, true);
  const bool bake_moving = count_triangles(scene, all_uses) <= kMaxRebuiltSoup;
  const std::vector<bool> bake =
      choose_baked_meshes(scene, bake_moving ? all_uses : count_uses(scene, state, false));
  TracePlan plan;
  for (std::uint32_t i = 0; i < state.instances.size(); ++i) {
    const MeshInstance& instance = state.instances[i];
    const Mesh& mesh = mesh_of(scene, instance);
    if (mesh.triangles.empty()) continue;
    if (!bake[static_cast<std::size_t>(instance.mesh)] || (instance.moves && !bake_moving)) {
      plan.instanced.push_back(i);
      continue;
    }
    const bool masked =
        scene.materials[static_cast<std::size_t>(mesh.material)].alpha_mode == AlphaMode::kMask;
    (masked ? plan.masked : plan.baked).push_back(i);
    plan.baked_moves = plan.baked_moves || instance.moves;
  }
  return plan;
}

}  // namespace lumigrove
