#include "scene_info.h"

#include <fmt/format.h>

#include "json_text.h"
#include "lights/emitter.h"
#include "lights/light_set.h"

namespace lumigrove {
namespace {

template <class T>
std::uint64_t size_in_bytes(const std::vector<T>& array) {
  return array.size() * sizeof(T);
}

std::uint64_t mesh_bytes(const Mesh& mesh) {
  return size_in_bytes(mesh.positions) + size_in_bytes(mesh.normals) + size_in_bytes(mesh.tangents) +
         size_in_bytes(mesh.uv0) + size_in_bytes(mesh.uv1) + size_in_bytes(mesh.colors) +
         size_in_bytes(mesh.triangles);
}

void count_arrays(const Scene& scene, SceneInfo& info) {
  info.nodes = scene.nodes.size();
  info.meshes = scene.meshes.size();
  info.materials = scene.materials.size();
  info.images = scene.images.size();
  info.bytes = size_in_bytes(scene.nodes) + size_in_bytes(scene.materials) + size_in_bytes(scene.lights);
  for (const Mesh& mesh : scene.meshes) {
    info.triangles += mesh.triangles.size();
    info.bytes += mesh_bytes(mesh);
  }
  for (const Image8or32& image : scene.images) {
    info.texels += static_cast<std::uint64_t>(image.width) * image.height;
    info.bytes += size_in_bytes(image.texels8) + size_in_bytes(image.texels32);
  }
  for (const Animation& animation : scene.animations) {
    info.animation_channels += animation.channels.size();
    for (const AnimationChannel& c : animation.channels)
      info.bytes += size_in_bytes(c.times) + size_in_bytes(c.values);
  }
}

void count_instances(const Scene& scene, const SceneState& state, SceneInfo& info) {
  info.instances = state.instances.size();
  for (const MeshInstance& instance : state.instances) {
    info.instanced_triangles += scene.meshes[instance.mesh].triangles.size();
    info.moving_instances += instance.moves;
  }
  info.bounds = state.bounds;
  info.diagonal = state.diagonal;
  info.cameras = state.cameras;
}

// As a render sees them: dark triangles are already dropped.
std::vector<EmitterGroup> group_emitters(const Scene& scene, const SceneState& state) {
  SceneArrays arrays(scene);
  arrays.set_state(state);
  LightSet lights(scene, arrays);
  lights.gather(arrays, state, Settings{});
  const LightView view = lights.view();

  EmitterGroup triangles{"triangle"}, points{"point"}, spots{"spot"};
  for (std::uint32_t i = 0; i < view.emitters.size(); ++i) {
    const Emitter& emitter = view.emitters[i];
    const bool spot = emitter.punctual() && view.punctual[emitter.index()].spot;
    EmitterGroup& group = !emitter.punctual() ? triangles : spot ? spots : points;
    ++group.count;
    group.flux += emitter_flux(view, i);
  }
  EmitterGroup directional{"directional", view.directional.size(), 0};
  for (const DirectionalView& light : view.directional)
    directional.flux += luminance(light.irradiance) * view.scene_disc;
  const EmitterGroup environment{"environment", view.environment.present() ? 1u : 0u, view.environment_flux};
  return {triangles, points, spots, directional, environment};
}

std::string text_of(vec3 v) { return fmt::format("({:.6g}, {:.6g}, {:.6g})", v.x, v.y, v.z); }

}  // namespace

SceneInfo describe_scene(const Scene& scene, double seconds) {
  const SceneState state = evaluate(scene, seconds);
  SceneInfo info;
  info.name = scene.name;
  info.hash = content_hash(scene);
  info.time = seconds;
  info.duration = duration(scene);
  info.warnings = scene.warnings;
  count_arrays(scene, info);
  count_instances(scene, state, info);
  info.emitters = group_emitters(scene, state);
  return info;
}

std::string info_text(const SceneInfo& info) {
  std::string text = fmt::format("{}\n", info.name);
  const auto row = [&](const std::string& name, const std::string& value) {
    text += fmt::format("  {:<14}{}\n", name, value);
  };
  row("hash", info.hash);
  row("nodes", fmt::format("{}", info.nodes));
  row("meshes", fmt::format("{}, in {} instances of which {} move", info.meshes, info.instances,
                            info.moving_instances));
  row("triangles", fmt::format("{} stored, {} instanced", info.triangles, info.instanced_triangles));
  row("materials", fmt::format("{}", info.materials));
  row("images", fmt::format("{}, {} texels", info.images, info.texels));
  row("memory", fmt::format("{:.2f} MB", static_cast<double>(info.bytes) * 1e-6));
  if (info.bounds.empty())
    row("bounds", "none (no geometry)");
  else
    row("bounds", fmt::format("{} to {} m, diagonal {:.6g} m", text_of(info.bounds.lo),
                              text_of(info.bounds.hi), info.diagonal));
  row("animation", info.duration > 0
                       ? fmt::format("{:.3f} s, {} channels", info.duration, info.animation_channels)
                       : std::string("none"));
  for (const CameraInstance& c : info.cameras)
    row("camera", fmt::format("'{}' at {} looking along {}, {:.4g} degrees high", c.camera.name,
                              text_of(c.position), text_of(c.forward), glm::degrees(c.camera.vertical_fov)));
  if (info.cameras.empty()) row("camera", "none (a view of the whole scene is used)");
  text += fmt::format("  emitters at {:g} s, flux in W (luminance of the radiant flux)\n", info.time);
  for (const EmitterGroup& group : info.emitters)
    text += fmt::format("    {:<12}{:>12}{:>16.6g}\n", group.kind, group.count, group.flux);
  return text;
}

std::string info_json(const SceneInfo& info) {
  Json cameras = Json::array(), emitters = Json::array();
  for (const CameraInstance& c : info.cameras)
    cameras.push_back({{"name", c.camera.name},
                       {"position", json_list(c.position)},
                       {"forward", json_list(c.forward)},
                       {"up", json_list(c.up)},
                       {"vertical_fov_degrees", glm::degrees(c.camera.vertical_fov)}});
  for (const EmitterGroup& group : info.emitters)
    emitters.push_back({{"kind", group.kind}, {"count", group.count}, {"flux_w", group.flux}});
  Json json = {{"name", info.name},
               {"hash", info.hash},
               {"nodes", info.nodes},
               {"meshes", info.meshes},
               {"instances", info.instances},
               {"moving_instances", info.moving_instances},
               {"triangles", info.triangles},
               {"instanced_triangles", info.instanced_triangles},
               {"materials", info.materials},
               {"images", info.images},
               {"texels", info.texels},
               {"bytes", info.bytes},
               {"diagonal_m", info.diagonal},
               {"duration_s", info.duration},
               {"animation_channels", info.animation_channels},
               {"time_s", info.time},
               {"cameras", cameras},
               {"emitters", emitters},
               {"warnings", info.warnings}};
  json["bounds_m"] =
      info.bounds.empty() ? Json() : Json{{"lo", json_list(info.bounds.lo)}, {"hi", json_list(info.bounds.hi)}};
  return json.dump(2) + '\n';
}

}  // namespace lumigrove
