#include "methods/vpl_sampling/gather.h"

#include <algorithm>

#include "base/stopwatch.h"
#include "device/compact.h"
#include "device/device.h"

namespace lumigrove {
namespace {

// Dimensions of one kind of ray: its direction, then the light at its arrival.
constexpr std::uint32_t kDimensionsPerGather = 1u << 20;
constexpr std::uint32_t kDimArrivalDirect = 4, kDimArrivalIndirect = kDimensionsPerGather / 2;

void light_arrivals(const Gather& gather, std::uint32_t dimension, GatherBuffers& b, std::span<vec3> sum) {
  b.light.assign(b.next_surfaces.size(), vec3(0));
  // No second ray: mirrors are lit like all else.
  DirectLighting direct = gather.direct;
  IndirectLighting indirect = gather.indirect;
  direct.sampler.vpl_mirror_roughness = 0;
  indirect.sampler.mirror_roughness = indirect.light_tree.sampler.vpl_mirror_roughness = 0;
  add_direct_light(direct, b.next_surfaces, b.next_pixels, dimension + kDimArrivalDirect, b.direct, b.light);
  add_indirect_light(indirect, b.next_surfaces, b.next_pixels, dimension + kDimArrivalIndirect, b.indirect, b.light);
  launch(static_cast<int>(b.next_surfaces.size()), GatherCarryKernel{b.next_states, b.light, sum});
}

void add_kind(const Gather& gather, GatherKind kind, std::span<const Surface> surfaces,
              std::span<const std::uint32_t> pixels, GatherBuffers& b, std::span<vec3> sum) {
  const int count = static_cast<int>(surfaces.size());
  const VplSampler& sampler = gather.indirect.sampler;
  const std::uint32_t dimension = kDimGather + static_cast<std::uint32_t>(kind) * kDimensionsPerGather;
  b.rays.resize(surfaces.size());
  b.hits.resize(surfaces.size());
  b.states.resize(surfaces.size());
  {
    const ScopedTimer timer(b.surface_ms);
    launch(count, GatherScatterKernel{kind, sampler.mirror_roughness, sampler.clamp, sampler.gloss,
                                      gather.indirect.rng, dimension, surfaces, pixels, b.rays, b.states});
    // A mirror's rays are few: only they are traced.
    compact(
        count, [&](int i) { return max_component(b.states[static_cast<std::size_t>(i)].throughput) > 0; }, b.kept);
    b.rays_traced += b.kept.size();
  }
  if (b.kept.empty()) return;
  {
    const ScopedTimer timer(b.trace_ms);
    gather.indirect.tracer->closest(b.rays, b.hits, Coherence::kIncoherent);
  }
  {
    const ScopedTimer timer(b.surface_ms);
    compact(
        count, [&](int i) { return b.hits[static_cast<std::size_t>(i)].instance != kNoId; }, b.kept);
    b.next_surfaces.resize(b.kept.size());
    b.next_pixels.resize(b.kept.size());
    b.next_states.resize(b.kept.size());
    launch(static_cast<int>(b.kept.size()),
           GatherArriveKernel{kind, sampler.clamp, gather.direct.sampler.scene, gather.force_diffuse, b.kept, pixels,
                              b.rays, b.hits, b.states, b.next_surfaces, b.next_pixels, b.next_states});
  }
  light_arrivals(gather, dimension, b, sum);
}

}  // namespace

void GatherBuffers::add_counters(const GatherBuffers& other) {
  rays_traced += other.rays_traced;
  trace_ms += other.trace_ms;
  surface_ms += other.surface_ms;
  direct.add_counters(other.direct);
  indirect.add_counters(other.indirect);
}

void add_gathered_light(const Gather& gather, std::span<const Surface> surfaces,
                        std::span<const std::uint32_t> pixels, GatherBuffers& buffers, std::span<vec3> sum) {
  const VplSampler& sampler = gather.indirect.sampler;
  if (sampler.gloss && sampler.mirror_roughness > 0)
    add_kind(gather, GatherKind::kMirror, surfaces, pixels, buffers, sum);
  if (gather.compensate && sampler.clamp < kInfinity)
    add_kind(gather, GatherKind::kClamp, surfaces, pixels, buffers, sum);
}

}  // namespace lumigrove
