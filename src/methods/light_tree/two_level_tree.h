// The two-level light tree: build and storage. two_level_tree_kernel.h holds the method and its header block.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/large_array.h"
#include "lights/light_set.h"
#include "methods/light_tree/light_tree.h"
#include "methods/light_tree/two_level_tree_build_kernel.h"

namespace lumigrove {

// Trees of meshes are built when a mesh first shines, and kept as long as this object and the options last: use one for
// one scene. The tree over the instances is built anew by every call.
class TwoLevelTree {
 public:
  void build(const SceneView& scene, const LightView& lights, const LightTree::Options& options);

  const LightTree& top() const { return top_; }
  MeshTreesView view() const;
  std::size_t bytes() const;                          // of both levels
  std::size_t mesh_bytes() const;                     // of the lower one
  double build_ms() const { return build_ms_; }       // of the latest call, without the meshes
  double mesh_ms() const { return mesh_ms_; }         // of the meshes that the latest call built
  int meshes_built() const { return meshes_built_; }  // by all calls
  std::uint64_t mesh_triangles() const;               // leaves of all meshes

 private:
  void build_mesh(const MeshView& mesh, const EmissiveInstance& emissive, std::size_t number);
  void build_missing_meshes(const SceneView& scene, const LightView& lights);
  void build_top(const SceneView& scene, const LightView& lights);

  LightTree::Options options_;
  LightTree top_;
  std::vector<std::unique_ptr<LightTree>> trees_;  // by mesh; null: does not shine
  std::vector<LightTreeView> tree_views_;
  std::vector<MeshSummary> summaries_;
  std::vector<std::uint32_t> sources_, instance_numbers_;
  LargeArray<TreeInstance> instances_;
  LargeArray<MeshPlacement> placements_;
  LargeArray<NodeChild> boxes_;
  double build_ms_ = 0, mesh_ms_ = 0;
  int meshes_built_ = 0;
};

}  // namespace lumigrove
