// Proof that the methods are single-source: this unit compiles every kernel header for the device through the CUDA
// launcher. It is compiled by `make test` when nvcc is found and never run. check_kernels.cmake fails when a
// *_kernel.h file or a kernel struct is missing here.
#include <cuda.h>

#include <cstdint>

#include "base/rng.h"
#include "base/vec.h"
#include "device/cuda/launch.h"
#include "lights/light_set.h"
#include "scene/scene_view.h"
#include "scene/surface.h"
#include "scene/texture.h"

#ifdef TBB_VERSION_MAJOR
#error "A header compiled for the device includes oneTBB; only .cpp files may include device/device.h."
#endif

namespace lumigrove {
namespace {

// Calls the device functions that belong to no kernel of their own.
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
    Surface surface;
    surface.position = emitter.punctual() ? emitter.p0 : box.centre();
    out[i] = vec4(surface.position, is_finite(p) ? luminance(vec3(texel)) : box.diagonal());
  }
};

}  // namespace

template void cuda::launch<BaseKernel>(int, const BaseKernel&, cudaStream_t);

}  // namespace lumigrove
