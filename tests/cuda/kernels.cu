// Proof that the methods are single-source: this unit compiles every kernel header for the device through the
// CUDA launcher. It is compiled by `make test` when nvcc is found and never run. check_kernels.cmake fails
// when a
// *_kernel.h file or a kernel struct is missing here.
#include <cuda.h>

#include <cstdint>

#include "base/rng.h"
#include "base/sampling.h"
#include "base/srgb.h"
#include "base/vec.h"
#include "device/cuda/launch.h"
#include "frame/emission_kernel.h"
#include "frame/film.h"
#include "lights/light_set.h"
#include "lights/unoccluded_kernel.h"
#include "lights/vpl.h"
#include "lights/vpl_emitter_kernel.h"
#include "methods/light_bvh/light_bvh_kernel.h"
#include "methods/light_sampling/direct_lighting_kernel.h"
#include "methods/light_sampling/light_pool_kernel.h"
#include "methods/light_sampling/light_sampler_kernel.h"
#include "methods/light_sampling/pool_lighting_kernel.h"
#include "methods/lightcuts/cut_kernel.h"
#include "methods/light_tree/light_tree_build_kernel.h"
#include "methods/light_tree/light_tree_kernel.h"
#include "methods/light_tree/region_walk_kernel.h"
#include "methods/light_tree/two_level_tree_build_kernel.h"
#include "methods/light_tree/two_level_tree_kernel.h"
#include "methods/reference/path_kernel.h"
#include "methods/substitute_tree/substitute_build_kernel.h"
#include "methods/substitute_tree/substitute_draw_kernel.h"
#include "methods/substitute_tree/substitute_walk_kernel.h"
#include "methods/vpl/vpl_kernel.h"
#include "methods/vpl_sampling/gather_kernel.h"
#include "methods/vpl_sampling/indirect_lighting_kernel.h"
#include "methods/vpl_sampling/vpl_sampler_kernel.h"
#include "scene/bsdf.h"
#include "scene/camera_kernel.h"
#include "scene/scene_view.h"
#include "scene/surface.h"
#include "scene/surface_kernel.h"
#include "scene/texture.h"

#ifdef TBB_VERSION_MAJOR
#error "A header compiled for the device includes oneTBB; only .cpp files may include device/device.h."
#endif

namespace lumigrove {
namespace {

// Call the device functions that belong to no kernel of their own.
struct BaseKernel {
  SceneView scene;
  LightView lights;
  mat4x3 transform;
  Rng rng;
  vec4* out;

  LUMI_HD void operator()(int i) const {
    const vec4 u = rng.uniform4(static_cast<std::uint32_t>(i));
    const Frame frame = make_frame(glm::normalize(vec3(u)));
    const vec3 p = transform_point(transform, frame.to_world(transform_vector(transform, vec3(u))));
    const Box3 box = unite(Box3{p, p}, normal_matrix(transform) * frame.to_local(p));
    const MaterialView& material = scene.materials[static_cast<std::size_t>(i)];
    const vec4 texel = sample_texture(scene, material.base_color_texture, vec2(u), vec2(box.lo));
    const Emitter& emitter = lights.emitters[static_cast<std::size_t>(i)];
    const vec3 position = emitter.punctual() ? emitter.p0 : box.centre();
    out[i] = vec4(position, is_finite(p) ? luminance(vec3(texel)) : box.diagonal());
  }
};

struct WarpsKernel {
  Rng rng;
  float* out;

  LUMI_HD void operator()(int i) const {
    const vec4 u = rng.uniform4(static_cast<std::uint32_t>(i));
    const vec2 v(u);
    const vec3 w = sample_cosine_hemisphere(v) * pdf_cosine_hemisphere(u.z) +
                   sample_uniform_sphere(v) * pdf_uniform_sphere() +
                   sample_uniform_cone(v, u.w) * pdf_uniform_cone(u.w);
    const vec2 b = sample_uniform_triangle(v) * pdf_uniform_triangle(u.w) + sample_disc(v) * pdf_disc();
    out[i] = srgb_to_linear(b.x) + linear_to_srgb(b.y) + max_component(w);
  }
};

struct BsdfKernel {
  const Surface* surfaces;
  Rng rng;
  vec4* out;

  LUMI_HD void operator()(int i) const {
    const BsdfSample sample = bsdf_sample(surfaces[i], vec3(rng.uniform4(static_cast<std::uint32_t>(i))));
    out[i] = vec4(sample.weight + bsdf_eval(surfaces[i], sample.wi), bsdf_pdf(surfaces[i], sample.wi));
  }
};

}  // namespace

template void cuda::launch<BaseKernel>(int, const BaseKernel&, cudaStream_t);
template void cuda::launch<WarpsKernel>(int, const WarpsKernel&, cudaStream_t);
template void cuda::launch<BsdfKernel>(int, const BsdfKernel&, cudaStream_t);
template void cuda::launch<CameraKernel>(int, const CameraKernel&, cudaStream_t);
template void cuda::launch<SurfaceKernel>(int, const SurfaceKernel&, cudaStream_t);
template void cuda::launch<EmissionKernel>(int, const EmissionKernel&, cudaStream_t);
template void cuda::launch<MortonKernel<EmitterLeaves>>(int, const MortonKernel<EmitterLeaves>&, cudaStream_t);
template void cuda::launch<MortonKernel<BoxLeaves>>(int, const MortonKernel<BoxLeaves>&, cudaStream_t);
template void cuda::launch<LeafNodeKernel<16, EmitterLeaves>>(int, const LeafNodeKernel<16, EmitterLeaves>&,
                                                              cudaStream_t);
template void cuda::launch<LeafNodeKernel<16, BoxLeaves>>(int, const LeafNodeKernel<16, BoxLeaves>&, cudaStream_t);
template void cuda::launch<TriangleBoxKernel>(int, const TriangleBoxKernel&, cudaStream_t);
template void cuda::launch<TreeInstanceKernel>(int, const TreeInstanceKernel&, cudaStream_t);
template void cuda::launch<InnerNodeKernel<16>>(int, const InnerNodeKernel<16>&, cudaStream_t);
template void cuda::launch<CutKernel>(int, const CutKernel&, cudaStream_t);
template void cuda::launch<PoolKernel>(int, const PoolKernel&, cudaStream_t);
template void cuda::launch<PoolLightKernel>(int, const PoolLightKernel&, cudaStream_t);
template void cuda::launch<SplitKernel>(int, const SplitKernel&, cudaStream_t);
template void cuda::launch<DirectLightKernel>(int, const DirectLightKernel&, cudaStream_t);
template void cuda::launch<AddUnoccludedKernel>(int, const AddUnoccludedKernel&, cudaStream_t);
template void cuda::launch<AddUnoccludedByKindKernel>(int, const AddUnoccludedByKindKernel&, cudaStream_t);
template void cuda::launch<VplEmitterKernel>(int, const VplEmitterKernel&, cudaStream_t);
template void cuda::launch<PathStartKernel>(int, const PathStartKernel&, cudaStream_t);
template void cuda::launch<PathScatterKernel>(int, const PathScatterKernel&, cudaStream_t);
template void cuda::launch<PathEscapeKernel>(int, const PathEscapeKernel&, cudaStream_t);
template void cuda::launch<PathArriveKernel>(int, const PathArriveKernel&, cudaStream_t);
template void cuda::launch<PathEmissionKernel>(int, const PathEmissionKernel&, cudaStream_t);
template void cuda::launch<PathPixelsKernel>(int, const PathPixelsKernel&, cudaStream_t);
template void cuda::launch<PathLightKernel>(int, const PathLightKernel&, cudaStream_t);
template void cuda::launch<VplEmitKernel>(int, const VplEmitKernel&, cudaStream_t);
template void cuda::launch<VplBounceKernel>(int, const VplBounceKernel&, cudaStream_t);
template void cuda::launch<SubstituteKeyKernel>(int, const SubstituteKeyKernel&, cudaStream_t);
template void cuda::launch<SubstituteMortonKernel>(int, const SubstituteMortonKernel&, cudaStream_t);
template void cuda::launch<SubstitutePrefixKernel>(int, const SubstitutePrefixKernel&, cudaStream_t);
template void cuda::launch<SubstituteMergeKernel>(int, const SubstituteMergeKernel&, cudaStream_t);
template void cuda::launch<IndirectLightKernel>(int, const IndirectLightKernel&, cudaStream_t);
template void cuda::launch<GatherScatterKernel>(int, const GatherScatterKernel&, cudaStream_t);
template void cuda::launch<GatherArriveKernel>(int, const GatherArriveKernel&, cudaStream_t);
template void cuda::launch<GatherCarryKernel>(int, const GatherCarryKernel&, cudaStream_t);
template void cuda::launch<FilmKernel>(int, const FilmKernel&, cudaStream_t);
template void cuda::launch<WalkFilmKernel>(int, const WalkFilmKernel&, cudaStream_t);

}  // namespace lumigrove
