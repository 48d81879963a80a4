#include "methods/light_sampling/direct_lighting.h"

#include "base/stopwatch.h"
#include "device/device.h"
#include "lights/unoccluded_kernel.h"
#include "methods/light_sampling/direct_lighting_kernel.h"

namespace lumigrove {
namespace {

// `scale`: 1 / samples.
void add_one_sample(const DirectLighting& lighting, const LightSampler& sampler, float scale, const CutSamples& cuts,
                    int stratum, int strata,
                    std::span<const Surface> surfaces, std::span<const std::uint32_t> pixels,
                    std::uint32_t dimension, DirectBuffers& buffers, std::span<vec3> sum) {
  const int count = static_cast<int>(surfaces.size());
  {
    const ScopedTimer timer(buffers.select_ms);
    launch(walk_batches(count),
           DirectLightKernel{sampler, lighting.rng, dimension, scale, lighting.mis, surfaces, pixels,
                             buffers.shadow, buffers.contribution, cuts, stratum, strata},
           kLaunchGrain / kWalkBatch);
  }
  {
    const ScopedTimer timer(buffers.trace_ms);
    lighting.tracer->occluded(buffers.shadow, buffers.occluded, Coherence::kIncoherent);
  }
  for (const Ray& ray : buffers.shadow) buffers.rays += ray.tmax >= ray.tmin ? 1 : 0;
  launch(count, AddUnoccludedKernel{buffers.contribution, buffers.occluded, sum});
}

// One sample below each node of the cuts; lights at infinity have a sample in every pass.
void add_cut_samples(const DirectLighting& lighting, std::span<const Surface> surfaces,
                     std::span<const std::uint32_t> pixels, std::uint32_t dimension, DirectBuffers& buffers,
                     std::span<vec3> sum) {
  const CutLookup& lookup = lighting.lookup;
  {
    const ScopedTimer timer(buffers.cut_ms);
    buffers.cuts.resize(static_cast<std::size_t>(lookup.blocks()));
    launch(lookup.blocks(),
           CutKernel{lighting.sampler.tree, lighting.cut, lookup, lighting.rng, surfaces, buffers.cuts});
  }
  const int passes = lookup.passes(lighting.cut.size);
  const float interleave2 = static_cast<float>(lookup.interleave * lookup.interleave);
  for (int pass = 0; pass < passes; ++pass)
    add_one_sample(lighting, lighting.sampler, 1 / static_cast<float>(passes),
                   {buffers.cuts, lookup, pass, interleave2}, 0, 1, surfaces, pixels,
                   dimension + 4 * static_cast<std::uint32_t>(pass), buffers, sum);
}

}  // namespace

void add_direct_light(const DirectLighting& lighting, std::span<const Surface> surfaces,
                      std::span<const std::uint32_t> pixels, std::uint32_t dimension, DirectBuffers& buffers,
                      std::span<vec3> sum) {
  buffers.shadow.resize(surfaces.size());
  buffers.contribution.resize(surfaces.size());
  buffers.occluded.resize(surfaces.size());
  if (lighting.use_cuts) {
    add_cut_samples(lighting, surfaces, pixels, dimension, buffers, sum);
    return;
  }
  // Every light's sample takes a block of four dimensions; samples beyond the vertex's share continue under
  // another seed rather than into the next vertex's numbers.
  constexpr std::uint32_t kBlocks = (kDimBsdf - kDimLight) / 4;
  DirectLighting current = lighting;
  const std::uint32_t lights = lighting.all ? light_count(lighting.sampler.lights) : 1;
  for (std::uint32_t light = 0; light < lights; ++light) {
    LightSampler sampler = lighting.sampler;
    if (lighting.all) {
      sampler.choice = LightChoice::kOne;
      sampler.one = light;
    }
    for (int s = 0; s < lighting.spp; ++s) {
      const std::uint32_t block =
          light * static_cast<std::uint32_t>(lighting.spp) + static_cast<std::uint32_t>(s);
      current.rng.seed = lighting.rng.seed + 0x9e3779b9u * (block / kBlocks);
      add_one_sample(current, sampler, 1 / static_cast<float>(lighting.spp), {}, lighting.all ? 0 : s, lighting.all ? 1 : lighting.spp, surfaces, pixels,
                     dimension + 4 * (block % kBlocks), buffers, sum);
    }
  }
}

}  // namespace lumigrove
