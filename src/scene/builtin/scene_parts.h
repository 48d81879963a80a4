// Adding parts to a scene: materials, meshes, nodes, lights, cameras and looping animation. Indices are
// returned.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "lumigrove/scene.h"
#include "scene/builtin/mesh_builder.h"

namespace lumigrove::builtin {

int add_surface(Scene& scene, std::string name, vec3 base_color, float roughness = 1, float metallic = 0);
// An emitter of `radiance` W/(sr m^2) that also reflects `base_color` diffusely. Small hot sources stay
// black: what they reflect of their neighbours drowns in their own light and would only cost samples.
int add_emitter(Scene& scene, std::string name, vec3 radiance, vec3 base_color = vec3(0));
int add_mesh(Scene& scene, MeshBuilder& builder, std::string name, int material);
int add_node(Scene& scene, std::string name, std::vector<int> meshes, vec3 translation = vec3(0),
             vec4 rotation = vec4(0, 0, 0, 1), int parent = -1);
// A node that holds just this mesh, unmoved; nothing when the builder is empty.
void add_static(Scene& scene, MeshBuilder& builder, const std::string& name, int material);
int add_light_node(Scene& scene, const PunctualLight& light, vec3 translation,
                   vec4 rotation = vec4(0, 0, 0, 1), int parent = -1);
void add_camera(Scene& scene, std::string name, vec3 from, vec3 towards, float vertical_fov_degrees);

// Quaternions (x,y,z,w).
vec4 axis_angle(vec3 unit_axis, float radians);
vec4 looking_along(vec3 direction, vec3 up = vec3(0, 1, 0));  // turns -Z to `direction`
mat4 placed(vec3 translation, float turn_about_y = 0);

// Repeats every `period` seconds; `value` maps the phase in [0,1] to the node's translation or rotation.
// Cubic splines get their tangents from `value` by differences. All channels share the scene's one animation.
void animate_translation(Scene& scene, int node, float period, int keys, Interpolation interpolation,
                         const std::function<vec3(float phase)>& value);
void animate_rotation(Scene& scene, int node, float period, int keys, Interpolation interpolation,
                      const std::function<vec4(float phase)>& value);

}  // namespace lumigrove::builtin
