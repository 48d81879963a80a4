// Kernels of direct light: one light sample for each surface. Its addition once the shadow rays are answered is
// AddUnoccludedKernel. The estimator and its header block are in light_sampler_kernel.h.
#pragma once

#include <span>

#include "base/rng.h"
#include "methods/light_sampling/light_sampler_kernel.h"
#include "methods/light_sampling/triangle_lanes.h"
#include "methods/light_sampling/vpl_lanes.h"
#include "methods/lightcuts/cut_kernel.h"
#include "scene/bsdf.h"

namespace lumigrove {

// The cuts of a tile, and which of a pixel's nodes is sampled.
struct CutSamples {
  std::span<const LightCut> cuts;  // by block
  CutLookup lookup;
  int pass = 0;
  float scale = 1;  // m^2: interleaved pixels sample only their share of the nodes

  LUMI_HD const LightCut& cut_of(Pixel pixel) const { return cuts[static_cast<std::size_t>(lookup.block_of(pixel))]; }
};

// The split sets of a light BVH (SplitKernel), and which entry of each is sampled.
struct SplitSamples {
  std::span<const std::uint32_t> entries;
  std::span<const std::uint8_t> counts;
  int cap = 0, pass = 0;
};

LUMI_HD inline CutSamples samples_below(std::span<const LightCut> cuts, const CutLookup& lookup) {
  return {cuts, lookup, 0, static_cast<float>(lookup.interleave * lookup.interleave)};
}

// How often, over all passes, surface i samples `emitter` below its cut: the mean over m^2 frames where pixels share
// out the nodes. Both light and BSDF samples are weighed by it.
LUMI_HD inline float pdf_below_cut(const LightSampler& sampler, const CutSamples& samples, const Surface& surface,
                                   std::size_t i, std::uint32_t emitter) {
  const LightCut& cut = samples.cut_of(pixel_of_index(samples.lookup.window, static_cast<int>(i)));
  float pdf = 0;
  for (int k = 0; k < cut.count; ++k)
    pdf += pdf_emitter_below(sampler, cut.nodes[k], surface.position, surface.normal, emitter);
  return group_probabilities(sampler, surface).local * pdf / samples.scale;
}

// The same below its split set.
LUMI_HD inline float pdf_below_split(const LightSampler& sampler, const SplitSamples& samples, const Surface& surface,
                                     std::size_t i, std::uint32_t emitter) {
  const std::uint32_t* entries = samples.entries.data() + i * static_cast<std::size_t>(samples.cap);
  float pdf = 0;
  for (int k = 0; k < samples.counts[i]; ++k)
    pdf += pdf_light_bvh(sampler.bvh, entries[k], surface.position, surface.normal, emitter);
  return pdf;
}

// Of the samples that a surface takes one after another, each chooses its light in its own part of [0,1): neighbours in a
// tree's order are neighbours in space.
struct Stratum {
  int index = 0, count = 1;
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
  CutSamples cuts = {};     // none: walks start at the root
  Stratum stratum = {};
  SplitSamples split = {};  // kBvh; none: walks start at the root
  std::span<std::uint8_t> from_vpl = {};  // is the light of surfaces[i] a virtual point light's? Empty: not wanted

  LUMI_HD void operator()(int batch) const {
    const std::size_t first = static_cast<std::size_t>(batch) * kWalkBatch;
    const int count = static_cast<int>(glm::min<std::size_t>(kWalkBatch, surfaces.size() - first));
    if (sampler.choice == LightChoice::kTree) {
      light_by_walks(first, count);
      return;
    }
    if (sampler.choice == LightChoice::kBvh) {
      light_by_bvh_walks(first, count);
      return;
    }
    for (int k = 0; k < count; ++k) {
      const std::size_t i = first + static_cast<std::size_t>(k);
      if (lights_up(i)) write(i, sample_light(sampler, surfaces[i], random_numbers(i)), scale);
    }
  }

 private:
  LUMI_HD vec4 random_numbers(std::size_t i) const {
    vec4 u = Rng{rng.seed, rng.frame, pixels[i]}.uniform4(dimension);
    u.x = (static_cast<float>(stratum.index) + u.x) / static_cast<float>(stratum.count);
    u.x = glm::min(u.x, 0x1.fffffep-1f);
    return u;
  }

  // Marks the outputs as carrying nothing; is there a surface to light?
  LUMI_HD bool lights_up(std::size_t i) const {
    shadow[i].tmax = -1;
    contribution[i] = vec3(0);
    if (!from_vpl.empty()) from_vpl[i] = 0;
    return surfaces[i].instance != kNoId;
  }

  struct BvhStart {
    ChosenGroup group;
    std::uint32_t entry = kBvhRoot;
  };

  // Without cuts and splitting, any light. With cuts, one below this pass's node or at infinity. With splitting, one
  // below this pass's entry, or in the pass behind the last entry one of the lights at infinity.
  LUMI_HD BvhStart start_of_bvh_walk(std::size_t i, float r) const {
    if (!cuts.cuts.empty()) {
      const ChosenGroup group = choose_group(sampler, surfaces[i], r);
      if (group.group != LightGroup::kLocal) return {group};
      const TreeStart start = node_of_cut(i);
      return start.subtree.children == 0 ? BvhStart{} : BvhStart{group, entry_of_subtree(start.subtree)};
    }
    if (split.counts.empty()) return {choose_group(sampler, surfaces[i], r)};
    const int count = split.counts[i];
    if (split.pass == count) return {choose_group_at_infinity(sampler, surfaces[i], r)};
    if (split.pass > count) return {};
    const std::size_t at = i * static_cast<std::size_t>(split.cap) + static_cast<std::size_t>(split.pass);
    return {{LightGroup::kLocal, 1, r}, split.entries[at]};
  }

  LUMI_HD void light_by_bvh_walks(std::size_t first, int count) const {
    ChosenGroup groups[kWalkBatch];
    vec2 numbers[kWalkBatch];
    std::uint32_t index[kWalkBatch];
    BvhWalk walks[kWalkBatch];
    int size = 0;
    for (int k = 0; k < count; ++k) {
      const std::size_t i = first + static_cast<std::size_t>(k);
      if (!lights_up(i)) continue;
      const vec4 u = random_numbers(i);
      const BvhStart start = start_of_bvh_walk(i, u.x);
      if (start.group.group != LightGroup::kLocal) {
        write(i, light_in_group(sampler, surfaces[i], start.group, {}, vec2(u.y, u.z)), scale);
        continue;
      }
      groups[size] = start.group;
      numbers[size] = vec2(u.y, u.z);
      walks[size] = start_walk(sampler.bvh, start.entry, vec2(start.group.r, u.w));
      index[size++] = static_cast<std::uint32_t>(i);
    }
    walk_together(index, walks, size);
    TreeSample chosen[kWalkBatch];
    for (int k = 0; k < size; ++k) chosen[k] = end_of_walk(walks[k]);
    finish(index, groups, numbers, chosen, size, cuts.cuts.empty() ? scale : cuts.scale);
  }

  // A step of each in turn, so that one's arithmetic goes on while another waits.
  LUMI_HD void walk_together(const std::uint32_t* index, BvhWalk* walks, int count) const {
    int alive[kWalkBatch];
    for (int k = 0; k < count; ++k) alive[k] = k;
    for (int living = count; living > 0;) {
      int kept = 0;
      for (int a = 0; a < living; ++a) {
        const int k = alive[a];
        if (walks[k].ended()) continue;
        step_walk(sampler.bvh, surfaces[index[k]].position, surfaces[index[k]].normal, walks[k]);
        alive[kept++] = k;
        prefetch(&sampler.bvh.nodes[walks[k].ended() ? 0u : walks[k].link]);
      }
      living = kept;
    }
  }

  // Where the walk of a surface starts; without children where this pass has no node for its pixel.
  LUMI_HD TreeStart node_of_cut(std::size_t i) const {
    const Pixel pixel = pixel_of_index(cuts.lookup.window, static_cast<int>(i));
    const LightCut& cut = cuts.cut_of(pixel);
    const CutEntries entries = entries_of_pixel(cuts.lookup, pixel, cut.count);
    const int entry = entries.first + cuts.pass;
    return entry < entries.end ? cut.nodes[entry] : TreeStart{};
  }

  LUMI_HD void light_by_walks(std::size_t first, int count) const {
    ChosenGroup groups[kWalkBatch];
    vec2 walk_numbers[kWalkBatch], numbers[kWalkBatch];
    TreeStart starts[kWalkBatch];
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
      starts[walks] = cuts.cuts.empty() ? TreeStart{whole_tree(sampler.tree)} : node_of_cut(i);
      if (starts[walks].subtree.children == 0) continue;
      groups[walks] = group;
      walk_numbers[walks] = vec2(group.r, u.w);
      numbers[walks] = vec2(u.y, u.z);
      index[walks++] = static_cast<std::uint32_t>(i);
    }
    TreeSample chosen[kWalkBatch];
    walk_from_starts(starts, index, walk_numbers, walks, chosen);
    finish(index, groups, numbers, chosen, walks, cuts.cuts.empty() ? scale : cuts.scale);
  }

  // Lights the surfaces `index` by what their walks chose; `points`: numbers for the place on the light.
  LUMI_HD void finish(const std::uint32_t* index, const ChosenGroup* groups, const vec2* points, const TreeSample* chosen,
                      int count, float weight) const {
    const LightView& lights = sampler.lights;
    const std::size_t first_vpl = lights.emitters.size() - lights.vpls.size();
    for (int k = 0; k < count; ++k) {
      if (!(chosen[k].pdf > 0)) continue;
      const Emitter* emitter = &lights.emitters[chosen[k].emitter];
      prefetch(emitter);
      prefetch(&emitter->source);
      if (chosen[k].emitter >= first_vpl) prefetch(&lights.vpls[chosen[k].emitter - first_vpl].epsilon);
    }
    bool lit[kWalkBatch] = {};
    if (!lights.instances.empty() && !mis) light_by_plain_triangles(index, groups, points, chosen, count, weight, lit);
    if (!lights.vpls.empty()) light_by_chosen_vpls(index, groups, chosen, count, weight, lit);
    for (int k = 0; k < count; ++k)
      if (!lit[k]) write(index[k], light_in_group(sampler, surfaces[index[k]], groups[k], chosen[k], points[k]), weight);
  }

  static constexpr int kLitLanes = kWalkBatch < 16 ? kWalkBatch : 16;

  // Plain triangles are lit together.
  LUMI_HD void light_by_plain_triangles(const std::uint32_t* index, const ChosenGroup* groups, const vec2* points,
                                        const TreeSample* chosen, int count, float weight, bool* lit) const {
    TriangleLighting triangles;
    for (int k = 0; k < count; ++k) {
      if (!(chosen[k].pdf > 0)) continue;
      const Emitter& e = sampler.lights.emitters[chosen[k].emitter];
      if (!e.triangle()) continue;
      const EmissiveInstance& instance = sampler.lights.instances[e.source];
      if (instance.textured || instance.masked) continue;
      triangles.add(index[k], surfaces[index[k]], e, instance, points[k],
                    weight / (chosen[k].pdf * groups[k].probability));
      lit[k] = true;
    }
    for (int at = 0; at < triangles.count; at += kLitLanes)
      write_lit<kLitLanes>(light_by_triangles<kLitLanes>(triangles, at), glm::min(kLitLanes, triangles.count - at),
                           triangles.index + at, shadow, contribution);
  }

  // And so are virtual point lights.
  LUMI_HD void light_by_chosen_vpls(const std::uint32_t* index, const ChosenGroup* groups, const TreeSample* chosen,
                                    int count, float weight, bool* lit) const {
    VplLighting vpls;
    for (int k = 0; k < count; ++k) {
      if (!(chosen[k].pdf > 0)) continue;
      const Emitter& e = sampler.lights.emitters[chosen[k].emitter];
      if (!e.vpl()) continue;
      const Surface& surface = surfaces[index[k]];
      vpls.add(index[k], surface, e, sampler.lights.vpls[e.index()],
               vpls_light_gloss(sampler.vpl_gloss, sampler.vpl_mirror_roughness, surface),
               weight / (chosen[k].pdf * groups[k].probability));
      if (!from_vpl.empty()) from_vpl[index[k]] = 1;
      lit[k] = true;
    }
    for (int at = 0; at < vpls.count; at += kLitLanes)
      write_lit<kLitLanes>(light_by_vpls<kLitLanes>(vpls, sampler.lights.vpl_clamp, at),
                           glm::min(kLitLanes, vpls.count - at), vpls.index + at, shadow, contribution);
  }

  // Walks that start at one place go together: all of them without cuts, and those of a block that shares one.
  LUMI_HD void walk_from_starts(const TreeStart* starts, const std::uint32_t* index, const vec2* numbers,
                                int count, TreeSample* chosen) const {
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
        points.set(size, surface.position, surface.normal, numbers[k]);
        members[size++] = k;
      }
      TreeSample samples[kWalkBatch];
      sample_emitters(sampler, starts[leader], points, size, samples);
      for (int k = 0; k < size; ++k) chosen[members[k]] = samples[k];
    }
  }

  LUMI_HD LUMI_ALWAYS_INLINE void write(std::size_t i, const LightSample& sample, float weight) const {
    const Surface& surface = surfaces[i];
    vec3 light = unoccluded_light(surface, sample) * weight;
    // Balance heuristic of n = 1 / weight light samples and one BSDF sample.
    if (mis && sample.pdf > 0) light *= sample.pdf / (sample.pdf + weight * bsdf_pdf(surface, sample.wi));
    if (!(max_component(light) > 0) || !is_finite(light)) return;
    if (!from_vpl.empty()) from_vpl[i] = sample.from_vpl ? 1 : 0;
    contribution[i] = light;
    shadow[i] = shadow_ray(surface, sample, sampler.lights.diagonal);
  }
};

// Calls of a DirectLightKernel for so many surfaces.
LUMI_HD inline int walk_batches(int surfaces) { return (surfaces + kWalkBatch - 1) / kWalkBatch; }

}  // namespace lumigrove
