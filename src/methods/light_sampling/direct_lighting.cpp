#include "methods/light_sampling/direct_lighting.h"

#include <algorithm>

#include "base/stopwatch.h"
#include "device/device.h"
#include "lumigrove/error.h"
#include "lights/unoccluded_kernel.h"
#include "methods/light_sampling/direct_lighting_kernel.h"
#include "methods/light_sampling/pool_lighting_kernel.h"

namespace lumigrove {
namespace {

// Every light's sample takes a block of four dimensions; samples beyond the vertex's share continue under another seed
// rather than into the next vertex's numbers.
struct SampleNumbers {
  std::uint32_t seed, dimension;
};
SampleNumbers numbers_of_sample(std::uint32_t seed, std::uint32_t dimension, std::uint32_t sample) {
  constexpr std::uint32_t kBlocks = (kDimBsdf - kDimLight) / 4;
  return {seed + 0x9e3779b9u * (sample / kBlocks), dimension + 4 * (sample % kBlocks)};
}

void trace_shadow_rays(const DirectLighting& lighting, DirectBuffers& buffers) {
  const ScopedTimer timer(buffers.trace_ms);
  if (!lighting.tracer) {
    std::fill(buffers.occluded.begin(), buffers.occluded.end(), std::uint8_t{0});
    return;
  }
  lighting.tracer->occluded(buffers.shadow, buffers.occluded, Coherence::kIncoherent);
  for (const Ray& ray : buffers.shadow) buffers.rays += ray.tmax >= ray.tmin ? 1 : 0;
}

// Rays first_ray, ..., first_ray + count - 1 are those of surfaces first_surface, ...
void add_unoccluded(const DirectBuffers& buffers, std::size_t first_ray, std::size_t count, std::size_t first_surface,
                    std::span<vec3> sum) {
  const auto light = std::span<const vec3>(buffers.contribution).subspan(first_ray, count);
  const auto occluded = std::span<const std::uint8_t>(buffers.occluded).subspan(first_ray, count);
  const auto of_surfaces = sum.subspan(first_surface, count);
  if (buffers.vpl_sum.empty()) {
    launch(static_cast<int>(count), AddUnoccludedKernel{light, occluded, of_surfaces});
    return;
  }
  launch(static_cast<int>(count),
         AddUnoccludedByKindKernel{light, occluded,
                                   std::span<const std::uint8_t>(buffers.from_vpl).subspan(first_ray, count),
                                   of_surfaces, buffers.vpl_sum.subspan(first_surface, count)});
}

// `scale`: 1 / samples.
void add_one_sample(const DirectLighting& lighting, const LightSampler& sampler, float scale, const CutSamples& cuts,
                    const SplitSamples& split, Stratum stratum,
                    std::span<const Surface> surfaces, std::span<const std::uint32_t> pixels,
                    std::uint32_t dimension, DirectBuffers& buffers, std::span<vec3> sum) {
  const int count = static_cast<int>(surfaces.size());
  buffers.from_vpl.resize(buffers.vpl_sum.size());
  {
    const ScopedTimer timer(buffers.select_ms);
    launch(walk_batches(count),
           DirectLightKernel{sampler, lighting.rng, dimension, scale, lighting.mis, surfaces, pixels,
                             buffers.shadow, buffers.contribution, cuts, stratum, split, buffers.from_vpl},
           kLaunchGrain / kWalkBatch);
  }
  trace_shadow_rays(lighting, buffers);
  add_unoccluded(buffers, 0, surfaces.size(), 0, sum);
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
           CutKernel{lighting.sampler, lighting.cut, lookup, lighting.rng, surfaces, buffers.cuts});
  }
  const int passes = lookup.passes(lighting.cut.size);
  CutSamples samples = samples_below(buffers.cuts, lookup);
  for (; samples.pass < passes; ++samples.pass)
    add_one_sample(lighting, lighting.sampler, 1 / static_cast<float>(passes), samples, {}, {}, surfaces, pixels,
                   dimension + 4 * static_cast<std::uint32_t>(samples.pass), buffers, sum);
}

// `spp` samples below each part of the light BVH, and as many of the lights at infinity. A surface with few parts is done
// after as many passes.
void add_split_samples(const DirectLighting& lighting, std::span<const Surface> surfaces,
                       std::span<const std::uint32_t> pixels, std::uint32_t dimension, DirectBuffers& buffers,
                       std::span<vec3> sum) {
  {
    const ScopedTimer timer(buffers.split_ms);
    buffers.split_entries.resize(surfaces.size() * static_cast<std::size_t>(lighting.split.cap));
    buffers.split_counts.resize(surfaces.size());
    launch(static_cast<int>(surfaces.size()),
           SplitKernel{lighting.sampler.bvh, lighting.split, surfaces, buffers.split_entries, buffers.split_counts});
  }
  const LightView& lights = lighting.sampler.lights;
  int passes = 0;
  for (const std::uint8_t count : buffers.split_counts) passes = std::max<int>(passes, count);
  if (!lights.directional.empty() || lights.environment.present()) ++passes;
  DirectLighting current = lighting;
  for (int s = 0; s < lighting.spp; ++s) {
    for (int pass = 0; pass < passes; ++pass) {
      const SampleNumbers numbers =
          numbers_of_sample(lighting.rng.seed, dimension, static_cast<std::uint32_t>(s * passes + pass));
      current.rng.seed = numbers.seed;
      add_one_sample(current, lighting.sampler, 1 / static_cast<float>(lighting.spp), {},
                     {buffers.split_entries, buffers.split_counts, lighting.split.cap, pass}, {}, surfaces,
                     pixels, numbers.dimension, buffers, sum);
    }
  }
}

// All samples of so many surfaces are lit before the next, while they are in the cache.
constexpr std::size_t kSurfacesOfPools = 512;

// `spp` of the lights that were drawn for the surface's area. `lookup`: of these surfaces.
void add_pool_samples_of_strip(const DirectLighting& lighting, const PoolLookup& lookup,
                               std::span<const Surface> surfaces, std::span<const std::uint32_t> pixels,
                               std::uint32_t dimension, std::size_t first_of_tile, DirectBuffers& buffers,
                               std::span<vec3> sum) {
  {
    const ScopedTimer timer(buffers.pool_ms);
    buffers.pools.resize(static_cast<std::size_t>(lookup.pools()));
    launch(lookup.areas.blocks(), PoolKernel{lighting.sampler, lookup, lighting.rng, surfaces, buffers.pools});
  }
  const auto samples = static_cast<std::size_t>(lighting.spp);
  for (std::size_t first = 0; first < surfaces.size(); first += kSurfacesOfPools) {
    const std::size_t count = std::min(kSurfacesOfPools, surfaces.size() - first), rays = count * samples;
    buffers.shadow.resize(rays);
    buffers.contribution.resize(rays);
    buffers.occluded.resize(rays);
    buffers.from_vpl.resize(buffers.vpl_sum.empty() ? 0 : rays);
    {
      const ScopedTimer timer(buffers.select_ms);
      launch(walk_batches(static_cast<int>(count)),
             PoolLightKernel{lighting.sampler, lookup, lighting.rng, dimension, lighting.spp, static_cast<int>(first),
                             surfaces.subspan(first, count), pixels.subspan(first, count), buffers.pools,
                             buffers.shadow, buffers.contribution, buffers.from_vpl});
    }
    trace_shadow_rays(lighting, buffers);
    for (std::size_t s = 0; s < samples; ++s) add_unoccluded(buffers, s * count, count, first_of_tile + first, sum);
  }
}

// A row of areas at a time, whose pools fit the cache, where its surfaces lie together.
void add_pool_samples(const DirectLighting& lighting, std::span<const Surface> surfaces,
                      std::span<const std::uint32_t> pixels, std::uint32_t dimension, DirectBuffers& buffers,
                      std::span<vec3> sum) {
  const PixelWindow window = lighting.pools.areas.window;
  if (static_cast<std::size_t>(window.count()) != surfaces.size())
    throw Error("pools light whole windows of pixels, but the surfaces are others");
  const int edge = lighting.pools.areas.share;
  const bool together = edge % kPixelSuperblock == 0 && window.y0 % kPixelSuperblock == 0;
  std::size_t first = 0;
  for (int y = window.y0; y < window.y1;) {
    PoolLookup lookup = lighting.pools;
    lookup.areas.window.y0 = y;
    if (together) lookup.areas.window.y1 = std::min(window.y1, (y / edge + 1) * edge);
    const auto count = static_cast<std::size_t>(lookup.areas.window.count());
    add_pool_samples_of_strip(lighting, lookup, surfaces.subspan(first, count), pixels.subspan(first, count),
                              dimension, first, buffers, sum);
    first += count;
    y = lookup.areas.window.y1;
  }
}

}  // namespace

void DirectBuffers::add_counters(const DirectBuffers& other) {
  rays += other.rays;
  cut_ms += other.cut_ms;
  pool_ms += other.pool_ms;
  split_ms += other.split_ms;
  select_ms += other.select_ms;
  trace_ms += other.trace_ms;
}

void add_direct_light(const DirectLighting& lighting, std::span<const Surface> surfaces,
                      std::span<const std::uint32_t> pixels, std::uint32_t dimension, DirectBuffers& buffers,
                      std::span<vec3> sum) {
  if (lighting.use_pools) {
    add_pool_samples(lighting, surfaces, pixels, dimension, buffers, sum);
    return;
  }
  buffers.shadow.resize(surfaces.size());
  buffers.contribution.resize(surfaces.size());
  buffers.occluded.resize(surfaces.size());
  if (lighting.use_cuts) {
    add_cut_samples(lighting, surfaces, pixels, dimension, buffers, sum);
    return;
  }
  if (lighting.use_split) {
    add_split_samples(lighting, surfaces, pixels, dimension, buffers, sum);
    return;
  }
  DirectLighting current = lighting;
  const std::uint32_t lights = lighting.all ? light_count(lighting.sampler.lights) : 1;
  for (std::uint32_t light = 0; light < lights; ++light) {
    LightSampler sampler = lighting.sampler;
    if (lighting.all) {
      sampler.choice = LightChoice::kOne;
      sampler.one = light;
    }
    for (int s = 0; s < lighting.spp; ++s) {
      const SampleNumbers numbers = numbers_of_sample(
          lighting.rng.seed, dimension, light * static_cast<std::uint32_t>(lighting.spp) + static_cast<std::uint32_t>(s));
      current.rng.seed = numbers.seed;
      add_one_sample(current, sampler, 1 / static_cast<float>(lighting.spp), {}, {},
                     lighting.all ? Stratum{} : Stratum{s, lighting.spp}, surfaces, pixels,
                     numbers.dimension, buffers, sum);
    }
  }
}

}  // namespace lumigrove
