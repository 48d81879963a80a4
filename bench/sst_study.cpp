#include "sst_study.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/task_arena.h>

#include <algorithm>

#include "device/device.h"

namespace lumigrove::bench {
namespace {

constexpr std::size_t kSurfacesATask = 512;

// Calls light_part(first, count, buffers) for parts of all surfaces.
template <class Function>
void for_parts(std::size_t count, const Function& light_part) {
  tbb::enumerable_thread_specific<IndirectBuffers> buffers;
  launch(
      static_cast<int>((count + kSurfacesATask - 1) / kSurfacesATask),
      [&](int part) {
        const std::size_t first = static_cast<std::size_t>(part) * kSurfacesATask;
        tbb::this_task_arena::isolate(
            [&] { light_part(first, std::min(kSurfacesATask, count - first), buffers.local()); });
      },
      1);
}

}  // namespace

Settings sst_settings(bool diffuse) {
  Settings settings = make_preset("sst");
  settings.force_diffuse = diffuse;
  return settings;
}

Settings slc_settings(bool diffuse) {
  Settings settings = make_preset("slc");
  settings.force_diffuse = diffuse;
  return settings;
}

Settings path_settings(bool diffuse, int bounces) {
  Settings settings = make_preset("path");
  settings.force_diffuse = diffuse;
  settings.indirect.max_bounces = bounces;
  return settings;
}

// --- references ------------------------------------------------------------------------------------------------

Reference make_reference(const Scene& scene, bool diffuse, int spp) {
  constexpr int kBounces = 7, kPart = 16, kDirectSpp = 8;
  Settings settings = sized(path_settings(diffuse, kBounces), kErrorWidth, kErrorHeight);
  settings.direct.spp = kDirectSpp;
  const Study study(scene, settings);
  ImageMean image;
  std::vector<Mean> beauty, indirect;
  for (int part = 0; part < spp / kPart; ++part) {
    settings.seed = 1000000u + static_cast<std::uint32_t>(part);
    RenderStats stats;
    Film film(settings.width, settings.height);
    for (int sample = 0; sample < kPart; ++sample) render_sample(*study.world, settings, sample, film, stats);
    const SampleImage mean = layers_of(film, kPart);
    image.add(mean);
    add_to(beauty, mean.beauty);
    add_to(indirect, mean.indirect);
  }
  return {image.mean(), mean_variance(beauty), mean_variance(indirect)};
}

double squared_error(const Reference& reference, const RgbImage& beauty) {
  const double error = rmse(reference.image.beauty, beauty);
  return error * error - reference.beauty_variance;
}

double squared_indirect_error(const Reference& reference, const RgbImage& indirect) {
  const double error = rmse(reference.image.indirect, indirect);
  return error * error - reference.indirect_variance;
}

// --- light at fixed surfaces -----------------------------------------------------------------------------------

std::vector<vec3> light_surfaces(const IndirectLighting& lighting, const SeenSurfaces& seen) {
  std::vector<vec3> light(seen.surfaces.size(), vec3(0));
  for_parts(light.size(), [&](std::size_t first, std::size_t count, IndirectBuffers& buffers) {
    add_indirect_light(lighting, std::span(seen.surfaces).subspan(first, count),
                       std::span(seen.pixels).subspan(first, count), kDimIndirect, buffers,
                       std::span(light).subspan(first, count));
  });
  return light;
}

std::vector<VplTrace> trace_walks(const IndirectLighting& lighting, const SeenSurfaces& seen) {
  std::vector<VplTrace> traces(seen.surfaces.size());
  for_parts(traces.size(), [&](std::size_t first, std::size_t count, IndirectBuffers& buffers) {
    std::vector<vec3> light(count, vec3(0));
    buffers.wants_traces = true;
    add_indirect_light(lighting, std::span(seen.surfaces).subspan(first, count),
                       std::span(seen.pixels).subspan(first, count), kDimIndirect, buffers, light);
    std::copy(buffers.traces.begin(), buffers.traces.end(), traces.begin() + static_cast<std::ptrdiff_t>(first));
  });
  return traces;
}

// Pixels without a surface have not walked.
double mean_steps(const std::vector<VplTrace>& traces) {
  Mean steps;
  for (const VplTrace& trace : traces)
    if (trace.steps > 0) steps.add(static_cast<double>(trace.steps));
  return steps.mean();
}

double mean_longest_steps(const std::vector<VplTrace>& traces) {
  Mean steps;
  for (std::size_t first = 0; first < traces.size(); first += kWalkLanes) {
    float longest = 0;
    for (std::size_t i = first; i < std::min(traces.size(), first + kWalkLanes); ++i)
      longest = std::max(longest, traces[i].steps);
    if (longest > 0) steps.add(static_cast<double>(longest));
  }
  return steps.mean();
}

// --- time ------------------------------------------------------------------------------------------------------

double sampling_ms(const Study& study, const Settings& settings) {
  return pass_ms(study, settings, {"VPL selection", "VPL shadow rays"});
}

double path_ms(const Study& study, const Settings& settings) {
  return pass_ms(study, settings, {"path rays", "path surfaces", "path light selection", "path shadow rays"});
}

}  // namespace lumigrove::bench
