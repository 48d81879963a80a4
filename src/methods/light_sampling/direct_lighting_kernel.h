// Kernels of direct light: one light sample for each surface. Its addition once the shadow rays are answered is
// AddUnoccludedKernel. The estimator and its header block are in light_sampler_kernel.h.
#pragma once

#include <span>

#include "base/rng.h"
#include "methods/light_sampling/light_sampler_kernel.h"
#include "methods/lightcuts/cut_kernel.h"
#include "scene/bsdf.h"

namespace lumigrove {

// The cuts of a tile, and which of a pixel's nodes is sampled.
struct CutSamples {
  std::span<const LightCut> cuts;  // by block
  CutLookup lookup;
  int pass = 0;
  float scale = 1;  // m^2: interleaved pixels sample only their share of the nodes
};

// surfaces[i] -> shadow[i], contribution[i] (radiance towards wo if unoccluded). Rays that carry nothing are
// marked untraced. Surfaces take their random numbers from `dimension`. One call does kWalkBatch surfaces, so that
// their walks down the tree go together.
struct DirectLightKernel {
  LightSampler sampler;
  Rng rng;
  std::uint32_t dimension;
  float scale;  // 1 / samples
  bool mis;
  std::span<const Surface> surfaces;
  std::span<const std::uint32_t> pixels;
  std::span<Ray> shadow;
  std::span<vec3> contribution;
  CutSamples cuts = {};  // none: walks start at the root

  LUMI_HD void operator()(int batch) const {
    const std::size_t first = static_cast<std::size_t>(batch) * kWalkBatch;
    const int count = static_cast<int>(glm::min<std::size_t>(kWalkBatch, surfaces.size() - first));
    if (sampler.choice == LightChoice::kTree) {
      light_by_walks(first, count);
      return;
    }
    for (int k = 0; k < count; ++k) {
      const std::size_t i = first + static_cast<std::size_t>(k);
      if (lights_up(i)) write(i, sample_light(sampler, surfaces[i], random_numbers(i)), scale);
    }
  }

 private:
  LUMI_HD vec4 random_numbers(std::size_t i) const {
    return Rng{rng.seed, rng.frame, pixels[i]}.uniform4(dimension);
  }

  // Marks the outputs as carrying nothing; is there a surface to light?
  LUMI_HD bool lights_up(std::size_t i) const {
    shadow[i].tmax = -1;
    contribution[i] = vec3(0);
    return surfaces[i].instance != kNone;
  }

  // Where the walk of a surface starts; without children where this pass has no node for its pixel.
  LUMI_HD Subtree start_of(std::size_t i) const {
    if (cuts.cuts.empty()) return whole_tree(sampler.tree);
    const Pixel pixel = pixel_of_index(cuts.lookup.window, static_cast<int>(i));
    const LightCut& cut = cuts.cuts[static_cast<std::size_t>(cuts.lookup.block_of(pixel))];
    const CutEntries entries = entries_of_pixel(cuts.lookup, pixel, cut.count);
    const int entry = entries.first + cuts.pass;
    return entry < entries.end ? cut.nodes[entry] : Subtree{};
  }

  LUMI_HD void light_by_walks(std::size_t first, int count) const {
    ChosenGroup groups[kWalkBatch];
    vec4 numbers[kWalkBatch];
    Subtree starts[kWalkBatch];
    std::uint32_t index[kWalkBatch];
    int walks = 0;
    for (int k = 0; k < count; ++k) {
      const std::size_t i = first + static_cast<std::size_t>(k);
      if (!lights_up(i)) continue;
      const Surface& surface = surfaces[i];
      const vec4 u = random_numbers(i);
      const ChosenGroup group = choose_group(sampler, surface, u.x);
      if (group.group != LightGroup::kLocal) {
        write(i, light_in_group(sampler, surface, group, {}, vec2(u.y, u.z)), scale);
        continue;
      }
      starts[walks] = start_of(i);
      if (starts[walks].children == 0) continue;
      groups[walks] = group;
      numbers[walks] = u;
      index[walks++] = static_cast<std::uint32_t>(i);
    }
    TreeSample chosen[kWalkBatch];
    walk_from_starts(starts, index, groups, numbers, walks, chosen);
    for (int k = 0; k < walks; ++k) {
      if (!(chosen[k].pdf > 0)) continue;
      const Emitter* emitter = &sampler.lights.emitters[chosen[k].emitter];
      prefetch(emitter);
      prefetch(&emitter->source);
    }
    for (int k = 0; k < walks; ++k)
      write(index[k],
            light_in_group(sampler, surfaces[index[k]], groups[k], chosen[k], vec2(numbers[k].y, numbers[k].z)),
            cuts.cuts.empty() ? scale : cuts.scale);
  }

  // Walks that start at one place go together: all of them without cuts, and those of a block that shares one.
  LUMI_HD void walk_from_starts(const Subtree* starts, const std::uint32_t* index, const ChosenGroup* groups,
                                const vec4* numbers, int count, TreeSample* chosen) const {
    bool done[kWalkBatch] = {};
    for (int leader = 0; leader < count; ++leader) {
      if (done[leader]) continue;
      WalkPoints points;
      int members[kWalkBatch];
      int size = 0;
      for (int k = leader; k < count; ++k) {
        if (done[k] || !(starts[k] == starts[leader])) continue;
        done[k] = true;
        const Surface& surface = surfaces[index[k]];
        points.set(size, surface.position, surface.normal, vec2(groups[k].r, numbers[k].w));
        members[size++] = k;
      }
      TreeSample samples[kWalkBatch];
      sample_emitters(sampler, starts[leader], points, size, samples);
      for (int k = 0; k < size; ++k) chosen[members[k]] = samples[k];
    }
  }

  LUMI_HD LUMI_ALWAYS_INLINE void write(std::size_t i, const LightSample& sample, float weight) const {
    if (!(max_component(sample.weight) > 0)) return;
    const Surface& surface = surfaces[i];
    const float cosine = glm::dot(surface.normal, sample.wi);
    if (!(cosine > 0)) return;
    vec3 light = bsdf_eval(surface, sample.wi) * sample.weight * (cosine * weight);
    // Balance heuristic of n = 1 / scale light samples and one BSDF sample.
    if (mis && sample.pdf > 0) light *= sample.pdf / (sample.pdf + scale * bsdf_pdf(surface, sample.wi));
    if (!(max_component(light) > 0) || !is_finite(light)) return;
    contribution[i] = light;
    shadow[i] = shadow_ray(surface, sample, sampler.lights.diagonal);
  }
};

// Calls of a DirectLightKernel for so many surfaces.
LUMI_HD inline int walk_batches(int surfaces) { return (surfaces + kWalkBatch - 1) / kWalkBatch; }

}  // namespace lumigrove
