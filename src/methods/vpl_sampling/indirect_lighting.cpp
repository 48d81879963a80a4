#include "methods/vpl_sampling/indirect_lighting.h"

#include <algorithm>

#include "base/stopwatch.h"
#include "device/device.h"
#include "lights/unoccluded_kernel.h"

namespace lumigrove {
namespace {

struct Batch {
  const IndirectLighting& lighting;
  std::span<const Surface> surfaces;
  std::span<const std::uint32_t> pixels;
  IndirectBuffers& buffers;
  std::span<vec3> sum;

  int count() const { return static_cast<int>(surfaces.size()); }
};

void add_part(const Batch& batch, const VplSampler& sampler, CorrectionPart part, std::uint32_t dimension,
              std::span<VplTrace> traces) {
  IndirectBuffers& b = batch.buffers;
  {
    const ScopedTimer timer(b.select_ms);
    const std::span<std::uint8_t> corrected =
        sampler.correction > 0 ? std::span<std::uint8_t>(b.corrected) : std::span<std::uint8_t>();
    launch(indirect_batches(batch.count()),
           IndirectLightKernel{sampler, batch.lighting.rng, dimension, 1.0f / static_cast<float>(batch.lighting.spp),
                               part, batch.surfaces, batch.pixels, b.shadow, b.contribution, corrected, traces},
           kLaunchGrain / kSurfacesPerCall);
  }
  if (batch.lighting.tracer) {
    const ScopedTimer timer(b.trace_ms);
    batch.lighting.tracer->occluded(b.shadow, b.occluded, Coherence::kIncoherent);
    for (const Ray& ray : b.shadow) b.rays += ray.tmax >= ray.tmin ? 1 : 0;
  } else {
    std::fill(b.occluded.begin(), b.occluded.end(), std::uint8_t{0});
  }
  launch(batch.count(), AddUnoccludedKernel{b.contribution, b.occluded, batch.sum});
}

void add_one_sample(const Batch& batch, const VplSampler& sampler, std::uint32_t dimension,
                    std::span<VplTrace> traces) {
  add_part(batch, sampler, CorrectionPart::kSubstitute, dimension, traces);
  if (sampler.correction > 0) add_part(batch, sampler, CorrectionPart::kLeaf, dimension, {});
}

}  // namespace

void IndirectBuffers::add_counters(const IndirectBuffers& other) {
  rays += other.rays + other.light_tree.rays;
  select_ms += other.select_ms + other.light_tree.select_ms;
  trace_ms += other.trace_ms + other.light_tree.trace_ms;
  light_tree.pool_ms += other.light_tree.pool_ms;
  light_tree.cut_ms += other.light_tree.cut_ms;
  light_tree.split_ms += other.light_tree.split_ms;
}

void add_indirect_light(const IndirectLighting& lighting, std::span<const Surface> surfaces,
                        std::span<const std::uint32_t> pixels, std::uint32_t dimension, IndirectBuffers& buffers,
                        std::span<vec3> sum) {
  const std::size_t n = surfaces.size();
  if (buffers.wants_traces) buffers.traces.assign(n, {});
  if (lighting.use_light_tree) {
    add_direct_light(lighting.light_tree, surfaces, pixels, dimension, buffers.light_tree, sum);
    return;
  }
  const auto lights = static_cast<std::uint32_t>(lighting.sampler.lights.vpls.size());
  if (lights == 0) return;
  buffers.shadow.resize(n);
  buffers.contribution.resize(n);
  buffers.occluded.resize(n);
  buffers.corrected.assign(lighting.sampler.correction > 0 ? n : 0, 0);
  const Batch batch{lighting, surfaces, pixels, buffers, sum};
  if (lighting.all) {
    IndirectLighting once = lighting;
    once.spp = 1;
    VplSampler sampler = lighting.sampler;
    sampler.choice = VplChoice::kOne;
    sampler.correction = 0;
    const Batch sum_of_all{once, surfaces, pixels, buffers, sum};
    for (sampler.one = 0; sampler.one < lights; ++sampler.one) add_one_sample(sum_of_all, sampler, dimension, {});
    return;
  }
  for (int s = 0; s < lighting.spp; ++s) {
    const std::span<VplTrace> traces =
        s == 0 && buffers.wants_traces ? std::span<VplTrace>(buffers.traces) : std::span<VplTrace>();
    add_one_sample(batch, lighting.sampler, dimension + kDimensionsPerVplSample * static_cast<std::uint32_t>(s),
                   traces);
  }
}

}  // namespace lumigrove
