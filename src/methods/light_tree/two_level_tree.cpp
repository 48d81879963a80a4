#include "methods/light_tree/two_level_tree.h"

#include <algorithm>

#include "base/stopwatch.h"
#include "device/device.h"
#include "device/reduce.h"

namespace lumigrove {
namespace {

// Share of a mesh's size by which rounding to world coordinates may move its vertices while cones are still used.
constexpr float kConeTolerance = 2.5e-4f;

// The root as one cone over all triangles.
PackedCone root_cone(const LightTreeView& tree) {
  return with_width(tree.width, [&](auto w) { return summarise_node(*tree.level<w>(0)).cone; });
}

Box3 emissive_bounds(const MeshView& mesh, const EmissiveInstance& emissive) {
  return reduce(
      static_cast<int>(emissive.count), Box3{},
      [&](int i) {
        const uvec3 v =
            mesh.triangles[emissive.triangles ? emissive.triangles[i] : static_cast<std::uint32_t>(i)];
        return unite(unite(Box3{mesh.positions[v.x], mesh.positions[v.x]}, mesh.positions[v.y]),
                     mesh.positions[v.z]);
      },
      [](const Box3& a, const Box3& b) { return unite(a, b); });
}

struct NormalMoments {
  double intensity = 0;
  glm::dmat3 normals = glm::dmat3(0);
};

NormalMoments normal_moments(const MeshView& mesh, const EmissiveInstance& emissive,
                             std::span<const NodeChild> boxes) {
  return reduce(
      static_cast<int>(emissive.count), NormalMoments{},
      [&](int i) {
        const uvec3 v =
            mesh.triangles[emissive.triangles ? emissive.triangles[i] : static_cast<std::uint32_t>(i)];
        const glm::dvec3 a(mesh.positions[v.x]), b(mesh.positions[v.y]), c(mesh.positions[v.z]);
        const glm::dvec3 cross = glm::cross(b - a, c - a);
        const double intensity = static_cast<double>(boxes[static_cast<std::size_t>(i)].intensity);
        const double squared = glm::dot(cross, cross);
        NormalMoments moments{intensity, glm::dmat3(0)};
        if (intensity > 0 && squared > 0)
          moments.normals = glm::outerProduct(cross, cross) * (intensity / squared);
        return moments;
      },
      [](const NormalMoments& a, const NormalMoments& b) {
        return NormalMoments{a.intensity + b.intensity, a.normals + b.normals};
      });
}

bool same(const LightTree::Options& a, const LightTree::Options& b) {
  return a.width == b.width && a.cones == b.cones && a.keep_leaves == b.keep_leaves &&
         a.weights == b.weights;
}

}  // namespace

void TwoLevelTree::build(const SceneView& scene, const LightView& lights, const LightTree::Options& options) {
  if (!same(options, options_) || trees_.size() != scene.meshes.size()) {
    trees_.clear();
    options_ = options;
  }
  const Stopwatch mesh_watch;
  build_missing_meshes(scene, lights);
  mesh_ms_ = mesh_watch.ms();
  const Stopwatch watch;
  build_top(scene, lights);
  build_ms_ = watch.ms();
}

void TwoLevelTree::build_missing_meshes(const SceneView& scene, const LightView& lights) {
  trees_.resize(scene.meshes.size());
  tree_views_.resize(scene.meshes.size());
  summaries_.resize(scene.meshes.size());
  for (std::size_t i = 0; i < lights.instances.size(); ++i) {
    const std::size_t mesh = static_cast<std::size_t>(scene.instances[i].mesh);
    if (lights.instances[i].first == EmissiveInstance::kNoEmitters || trees_[mesh]) continue;
    build_mesh(scene.meshes[mesh], lights.instances[i], mesh);
  }
}

void TwoLevelTree::build_mesh(const MeshView& mesh, const EmissiveInstance& emissive, std::size_t number) {
  MeshSummary summary;
  summary.box = emissive_bounds(mesh, emissive);
  const vec3 corner = glm::max(glm::abs(summary.box.lo), glm::abs(summary.box.hi));
  const float size = std::max(summary.box.diagonal(), 1e-3f * max_component(corner));
  summary.tolerance = kConeTolerance * summary.box.diagonal();
  const float brightness = luminance(emissive.radiance);
  const float inverse_brightness = brightness > 0 ? 1 / brightness : 0;

  LargeArray<NodeChild> boxes(emissive.count);
  launch(static_cast<int>(emissive.count),
         TriangleBoxKernel{mesh, emissive, inverse_brightness, summary.tolerance, boxes});
  const NormalMoments moments = normal_moments(mesh, emissive, boxes);
  summary.intensity = static_cast<float>(moments.intensity);
  if (moments.intensity > 0) summary.normals = mat3(moments.normals / moments.intensity);

  auto tree = std::make_unique<LightTree>();
  tree->build(BoxLeaves{boxes, summary.intensity > 0 ? 1 / summary.intensity : 0}, summary.box, size,
              options_);
  tree->free_buffers();
  const LightTreeView view = tree->view();
  summary.triangles = view.count;
  if (view.count > 0) {
    const PackedCone cone = root_cone(view);
    summary.cone_axis = cone.axis();
    summary.cone_radius = cone.width();
  }
  if (view.count == 1) summary.only = view.leaf_emitters[0];
  trees_[number] = std::move(tree);
  tree_views_[number] = view;
  summaries_[number] = summary;
  ++meshes_built_;
}

void TwoLevelTree::build_top(const SceneView& scene, const LightView& lights) {
  sources_.clear();
  instance_numbers_.assign(lights.instances.size(), kNoEmitter);
  for (std::uint32_t i = 0; i < lights.instances.size(); ++i) {
    if (lights.instances[i].first == EmissiveInstance::kNoEmitters) continue;
    instance_numbers_[i] = static_cast<std::uint32_t>(sources_.size());
    sources_.push_back(i);
  }
  const std::size_t count = sources_.size() + lights.punctual.size();
  instances_.resize(count);
  placements_.resize(count);
  boxes_.resize(count);
  const auto first_punctual = static_cast<std::uint32_t>(lights.emitters.size() - lights.punctual.size());
  const float inverse_flux = lights.local_flux > 0 ? 1 / std::min(lights.local_flux, 1e37f) : 0;
  launch(static_cast<int>(count),
         TreeInstanceKernel{scene, lights, summaries_.data(), sources_, first_punctual, inverse_flux, options_.cones,
                            instances_, placements_, boxes_},
         256);
  top_.build(BoxLeaves{boxes_, inverse_flux}, lights.bounds, lights.diagonal, options_);
}

MeshTreesView TwoLevelTree::view() const {
  return {instances_.data(), placements_.data(), tree_views_.data(), instance_numbers_.data(),
          static_cast<std::uint32_t>(sources_.size()), options_.width, options_.weights};
}

std::size_t TwoLevelTree::mesh_bytes() const {
  std::size_t bytes = trees_.size() * (sizeof(LightTreeView) + sizeof(MeshSummary));
  for (const auto& tree : trees_) bytes += tree ? tree->bytes() : 0;
  return bytes;
}

std::size_t TwoLevelTree::bytes() const {
  return mesh_bytes() + top_.bytes() + instances_.size() * (sizeof(TreeInstance) + sizeof(MeshPlacement)) +
         instance_numbers_.size() * sizeof(std::uint32_t);
}

std::uint64_t TwoLevelTree::mesh_triangles() const {
  std::uint64_t triangles = 0;
  for (const MeshSummary& summary : summaries_) triangles += summary.triangles;
  return triangles;
}

}  // namespace lumigrove
