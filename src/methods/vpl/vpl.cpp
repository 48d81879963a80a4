#include "methods/vpl/vpl.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>

#include "base/stopwatch.h"
#include "device/device.h"
#include "device/scan.h"
#include "methods/vpl/vpl_kernel.h"

namespace lumigrove {
namespace {

// Paths of one task: few enough that their rays stay in a core's cache, and that tasks spread evenly over threads.
constexpr int kChunk = 512;

// Key of the random numbers that belong to no path.
constexpr std::uint32_t kNoPath = 0xffffffffu;

}  // namespace

// What all tasks share.
struct VplSet::Launch {
  const VplTracing& tracing;
  LightSources sources;
  std::span<const double> cumulative;
  double offset;
};

// Paths under way in one task. One for each thread, used again by its next task.
struct VplSet::Buffers {
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  std::vector<VplPath> paths;
  std::vector<Vpl> vpls;

  void resize(int count) {
    const auto n = static_cast<std::size_t>(count);
    rays.resize(n);
    hits.resize(n);
    paths.resize(n);
    vpls.resize(n);
  }

  // Closes up the paths that have a ray to trace; returns their number.
  int pack(int count) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (!(rays[i].tmin <= rays[i].tmax)) continue;
      rays[kept] = rays[i];
      paths[kept] = paths[i];
      ++kept;
    }
    return static_cast<int>(kept);
  }
};

void VplSet::Chunk::start(int bounces) {
  vpls.clear();
  bounds = {};
  emitted_flux = 0;
  bounce_flux.assign(static_cast<std::size_t>(bounces), 0);
  rays = 0;
}

void VplSet::Chunk::keep(std::span<const Vpl> left, int bounce) {
  double flux = 0;
  for (const Vpl& vpl : left) {
    if (!(max_component(vpl.intensity) > 0)) continue;
    vpls.push_back(vpl);
    bounds = unite(bounds, vpl.position);
    flux += static_cast<double>(kPi * luminance(vpl.intensity));
  }
  bounce_flux[static_cast<std::size_t>(bounce) - 1] = flux;
}

void VplSet::trace_chunk(const Launch& job, int first, Buffers& b, Chunk& chunk) {
  const VplTracing& t = job.tracing;
  int count = std::min(kChunk, t.paths - first);
  b.resize(count);
  chunk.start(t.bounces);
  launch(count, VplEmitKernel{job.sources, job.cumulative, t.rng, job.offset, t.paths, first, b.rays, b.paths});
  for (const VplPath& path : b.paths) chunk.emitted_flux += static_cast<double>(luminance(path.flux));
  count = b.pack(count);
  for (int bounce = 1; bounce <= t.bounces && count > 0; ++bounce) {
    const auto n = static_cast<std::size_t>(count);
    const std::span<const Ray> rays(b.rays.data(), n);
    const std::span<Hit> hits(b.hits.data(), n);
    t.tracer->closest(rays, hits, Coherence::kIncoherent);
    chunk.rays += n;
    launch(count, VplBounceKernel{t.scene, t.rng, bounce, t.bounces, t.roulette_start, t.force_diffuse, hits,
                                  b.rays, b.paths, b.vpls});
    chunk.keep({b.vpls.data(), n}, bounce);
    count = b.pack(count);
  }
}

void VplSet::trace(const VplTracing& tracing) {
  const Stopwatch watch;
  const LightSources sources{tracing.scene, tracing.lights, with_margin(tracing.bounds)};
  const int lights = static_cast<int>(light_count(tracing.lights));
  cumulative_.resize(static_cast<std::size_t>(lights));
  const double total = inclusive_scan(
      lights, [&](int i) { return static_cast<double>(source_flux(sources, static_cast<std::uint32_t>(i))); },
      cumulative_.data());

  const bool shines = total > 0 && tracing.bounces > 0 && tracing.paths > 0;
  const int chunks = shines ? (tracing.paths - 1) / kChunk + 1 : 0;
  if (chunks_.size() < static_cast<std::size_t>(chunks)) chunks_.resize(static_cast<std::size_t>(chunks));
  const Rng offset_rng{tracing.rng.seed, tracing.rng.frame, kNoPath};
  const Launch job{tracing, sources, cumulative_, static_cast<double>(offset_rng.uniform4(kDimVpl).x)};
  tbb::enumerable_thread_specific<Buffers> buffers;
  launch(
      chunks, [&](int c) { trace_chunk(job, c * kChunk, buffers.local(), chunks_[static_cast<std::size_t>(c)]); }, 1);

  concatenate(chunks, std::max(0, tracing.bounces));
  diagonal_ = tracing.scene.diagonal;
  trace_ms_ = watch.ms();
}

void VplSet::concatenate(int chunks, int bounces) {
  bounds_ = {};
  emitted_flux_ = 0;
  rays_ = 0;
  bounce_flux_.assign(static_cast<std::size_t>(bounces), 0);
  std::vector<std::size_t> first(static_cast<std::size_t>(chunks) + 1);
  const auto chunk_size = [&](int c) { return chunks_[static_cast<std::size_t>(c)].vpls.size(); };
  vpls_.resize(exclusive_scan(chunks, chunk_size, first.data()));
  for (const Chunk& chunk : std::span(chunks_).first(static_cast<std::size_t>(chunks))) {
    bounds_ = unite(bounds_, chunk.bounds);
    emitted_flux_ += chunk.emitted_flux;
    rays_ += chunk.rays;
    for (std::size_t k = 0; k < bounce_flux_.size(); ++k) bounce_flux_[k] += chunk.bounce_flux[k];
  }
  launch(
      chunks,
      [&](int c) {
        const auto i = static_cast<std::size_t>(c);
        std::copy(chunks_[i].vpls.begin(), chunks_[i].vpls.end(),
                  vpls_.begin() + static_cast<std::ptrdiff_t>(first[i]));
      },
      8);
}

VplView VplSet::view() const { return {vpls_, bounds_, diagonal_}; }

std::size_t VplSet::bytes() const { return vpls_.size() * sizeof(Vpl); }

}  // namespace lumigrove
