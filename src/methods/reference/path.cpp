#include "methods/reference/path.h"

#include <algorithm>

#include "base/stopwatch.h"
#include "device/compact.h"
#include "device/device.h"

namespace lumigrove {
namespace {

// One batch of paths with everything that its steps share.
struct Batch {
  const PathTracing& tracing;
  std::span<const std::uint32_t> pixels;
  PathBuffers& buffers;
  std::span<vec3> direct, indirect;

  bool finds_emitters() const { return tracing.lighting.mis || tracing.bsdf_only; }
  // The last ray leads to the last vertex, or one further to see whether that light was an emitter's.
  int last_ray() const { return tracing.max_bounces + (finds_emitters() ? 1 : 0); }
  std::span<vec3> film(int ray_number) const { return ray_number == 1 ? direct : indirect; }
  // Of light sampling at the surface that a ray left.
  LightDensity density(int ray_number) const {
    const DirectLighting& lighting = tracing.lighting;
    if (ray_number > 1)
      return {lighting.sampler, lighting.all, tracing.bsdf_only, static_cast<float>(lighting.spp)};
    return {lighting.sampler, lighting.all, tracing.bsdf_only, static_cast<float>(tracing.first_spp),
            tracing.first_cuts, tracing.first_split};
  }
};

int start(const Batch& batch, std::span<const Surface> first) {
  PathBuffers& b = batch.buffers;
  compact(
      static_cast<int>(first.size()),
      [&](int i) { return first[static_cast<std::size_t>(i)].instance != kNoId; }, b.kept);
  b.surfaces.resize(b.kept.size());
  b.paths.resize(b.kept.size());
  const int count = static_cast<int>(b.kept.size());
  launch(count, PathStartKernel{first, b.kept, b.surfaces, b.paths});
  return count;
}

void scatter(const Batch& batch, int count, int ray_number) {
  PathBuffers& b = batch.buffers;
  const ScopedTimer timer(b.scatter_ms);
  b.rays.resize(b.paths.size());
  launch(count, PathScatterKernel{b.surfaces, batch.pixels, batch.tracing.lighting.rng, ray_number,
                                  batch.tracing.roulette_start, b.paths, b.rays});
  b.path_rays += static_cast<std::uint64_t>(
      std::count_if(b.paths.begin(), b.paths.end(), [](const PathState& p) { return p.pdf > 0; }));
}

void trace(const Batch& batch) {
  PathBuffers& b = batch.buffers;
  const ScopedTimer timer(b.trace_ms);
  b.hits.resize(b.rays.size());
  batch.tracing.lighting.tracer->closest(b.rays, b.hits, Coherence::kIncoherent);
}

// Escapes and emission, then the packed vertices that the rays arrived at. Returns their number.
int arrive(const Batch& batch, int count, int ray_number) {
  PathBuffers& b = batch.buffers;
  const ScopedTimer timer(b.arrive_ms);
  const LightSampler& sampler = batch.tracing.lighting.sampler;
  const std::span<vec3> film = batch.film(ray_number);
  if (batch.finds_emitters() && sampler.lights.environment.present())
    launch(count, PathEscapeKernel{batch.density(ray_number), b.surfaces, b.paths, b.rays, b.hits, film});
  compact(
      count, [&](int i) { return b.hits[static_cast<std::size_t>(i)].instance != kNoId; }, b.kept);
  b.next_surfaces.resize(b.kept.size());
  b.next_paths.resize(b.kept.size());
  const int arrived = static_cast<int>(b.kept.size());
  launch(arrived, PathArriveKernel{sampler.scene, sampler.lights, batch.tracing.light_scale,
                                   batch.tracing.force_diffuse, b.kept, b.paths, b.rays, b.hits,
                                   b.next_surfaces, b.next_paths});
  if (batch.finds_emitters())
    launch(arrived,
           PathEmissionKernel{batch.density(ray_number), b.kept, b.surfaces, b.next_surfaces, b.next_paths, film});
  std::swap(b.surfaces, b.next_surfaces);
  std::swap(b.paths, b.next_paths);
  return arrived;
}

void sample_lights(const Batch& batch, int count, int vertex) {
  PathBuffers& b = batch.buffers;
  b.pixels.resize(b.paths.size());
  b.light.assign(b.paths.size(), vec3(0));
  launch(count, PathPixelsKernel{b.paths, batch.pixels, b.pixels});
  const std::uint32_t dimension = kDimLight + static_cast<std::uint32_t>(vertex) * kDimensionsPerVertex;
  add_direct_light(batch.tracing.lighting, b.surfaces, b.pixels, dimension, b.direct, b.light);
  launch(count, PathLightKernel{b.paths, b.light, batch.indirect});
}

}  // namespace

void PathBuffers::add_counters(const PathBuffers& other) {
  path_rays += other.path_rays;
  scatter_ms += other.scatter_ms;
  trace_ms += other.trace_ms;
  arrive_ms += other.arrive_ms;
  direct.add_counters(other.direct);
}

void add_path_light(const PathTracing& tracing, std::span<const Surface> surfaces,
                    std::span<const std::uint32_t> pixels, PathBuffers& buffers, std::span<vec3> direct,
                    std::span<vec3> indirect) {
  const Batch batch{tracing, pixels, buffers, direct, indirect};
  if (batch.last_ray() == 0) return;
  int count = start(batch, surfaces);
  for (int ray_number = 1; ray_number <= batch.last_ray() && count > 0; ++ray_number) {
    scatter(batch, count, ray_number);
    trace(batch);
    count = arrive(batch, count, ray_number);
    if (ray_number <= tracing.max_bounces && !tracing.bsdf_only) sample_lights(batch, count, ray_number);
  }
}

}  // namespace lumigrove
