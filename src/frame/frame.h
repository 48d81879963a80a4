// A frame's world and its steps. `render` (lumigrove/renderer.h) is these steps in order; the bench times
// them.
#pragma once

#include <memory>

#include "frame/film.h"
#include "frame/history.h"
#include "lights/alias_table.h"
#include "lights/light_set.h"
#include "lights/vpl_light_set.h"
#include "lumigrove/renderer.h"
#include "methods/light_bvh/light_bvh.h"
#include "methods/light_sampling/direct_lighting.h"
#include "methods/light_tree/light_tree.h"
#include "methods/light_tree/two_level_tree.h"
#include "methods/substitute_tree/substitute_tree.h"
#include "methods/vpl/vpl.h"
#include "methods/vpl_sampling/indirect_lighting.h"
#include "scene/camera_kernel.h"
#include "scene/scene_view.h"
#include "trace/trace.h"

namespace lumigrove {

// What one moment of a scene looks like to rays, however it is lit.
struct Geometry {
  SceneState state;
  SceneArrays arrays;
  Tracer tracer;
};

// Everything that one moment of a scene needs before the first ray: made anew for every frame of an
// animation, but for what a History keeps.
struct World {
  std::shared_ptr<Geometry> geometry;  // worlds of several methods may share it
  LightSet lights;
  // Over the emitters, or with indirect.joint over these and the virtual point lights:
  LightTree tree;          // built when direct.hierarchy is perfect and direct.selection is root or cut
  TwoLevelTree two_level;  // built when direct.hierarchy is two-level and direct.selection is root or cut
  LightBvh bvh;            // built when direct.hierarchy is saoh or agglomerative and direct.selection is root or cut
  AliasTable alias;        // built when direct.selection is power
  CameraInstance camera;
  std::uint64_t texture_key = 0, shape_key = 0;  // of what is kept
  // When indirect.transport is vpl:
  VplSet vpls;
  VplLightSet vpl_lights;      // gathered when a light tree is over them, or with indirect.joint behind `lights`
  // Not with indirect.joint:
  SubstituteTree substitutes;  // built when indirect.hierarchy is substitute and indirect.selection is root
  AliasTable vpl_alias;        // built when indirect.selection is power
  LightTree vpl_tree;          // built when indirect.hierarchy is perfect and indirect.selection is root or cut
  LightBvh vpl_bvh;            // built when indirect.hierarchy is saoh or agglomerative and indirect.selection is root
};

// The scene at settings.time: transforms, acceleration structure, emitters, hierarchy, camera. `scene` must
// outlive it. Adds a line per structure to `stats`. Throws Error for an unknown camera or a scene without a
// place to stand. With `kept`, structures are taken from there where they fit.
std::unique_ptr<World> make_world(const Scene& scene, const Settings& settings, RenderStats& stats,
                                  History::Kept* kept = nullptr);
// Its two parts: geometry at settings.time, for which `scene` must live on, and what the method builds over it.
std::shared_ptr<Geometry> make_geometry(const Scene& scene, const Settings& settings, RenderStats& stats);
std::unique_ptr<World> make_world(const Scene& scene, std::shared_ptr<Geometry> geometry, const Settings& settings,
                                  RenderStats& stats, History::Kept* kept = nullptr);
// Gives back to `kept` what later frames can use.
void keep(World&& world, History::Kept& kept);

// Emitters and their hierarchy alone, as every frame rebuilds them; with indirect.joint the hierarchy waits for the virtual
// point lights.
void build_lights(World& world, const Settings& settings, RenderStats& stats);

// Virtual point lights for camera sample `sample`, and what chooses among them. Does nothing when indirect.transport is
// not vpl, or when the lights of an earlier sample are to be kept.
void trace_vpls(World& world, const Settings& settings, int sample, RenderStats& stats);

// The sampler that settings.indirect asks for, over the world's virtual point lights.
IndirectLighting make_indirect_lighting(const World& world, const Settings& settings, int sample);

// The light sampler that settings.direct asks for, over the world's lights, with indirect.joint its virtual point lights too.
DirectLighting make_direct_lighting(const World& world, const Settings& settings, int sample);

// Adds camera sample number `sample` (from 0) to every pixel of the crop window. Pass times and rays go to
// `stats`.
void render_sample(const World& world, const Settings& settings, int sample, Film& film, RenderStats& stats);

}  // namespace lumigrove
