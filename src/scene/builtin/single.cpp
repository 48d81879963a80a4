// `single`: one emitter above one object on a plane, the smallest scene that casts a shadow.
#include "scene/builtin/builtin.h"
#include "scene/builtin/scene_parts.h"

namespace lumigrove::builtin {
namespace {

constexpr vec3 kLightPosition(-0.9f, 2.2f, 0.8f);

void add_triangle_light(Scene& scene) {
  const vec3 towards = glm::normalize(vec3(0, 0.3f, 0) - kLightPosition);
  const vec3 side = glm::normalize(glm::cross(towards, vec3(0, 1, 0))), up = glm::cross(side, towards);
  MeshBuilder light;
  light.flat_triangle(kLightPosition + 0.3f * up, kLightPosition + 0.26f * side - 0.15f * up,
                      kLightPosition - 0.26f * side - 0.15f * up);
  const int mesh = add_mesh(scene, light, "light", add_emitter(scene, "light", vec3(120, 108, 88)));
  add_node(scene, "light", {mesh});
}

void add_punctual_light(Scene& scene, LightType type) {
  PunctualLight light;
  light.name = "light";
  light.type = type;
  light.color = vec3(20, 18, 14.5f);
  light.inner_cone = 0.25f;
  light.outer_cone = 0.4f;
  add_light_node(scene, light, kLightPosition, looking_along(vec3(0, 0.3f, 0) - kLightPosition));
}

Scene make(const Parameters& parameters) {
  Scene scene;
  MeshBuilder builder;
  builder.quad(vec3(-20, 0, 20), vec3(40, 0, 0), vec3(0, 0, -40));
  add_static(scene, builder, "plane", add_surface(scene, "plane", vec3(0.6f)));
  builder.icosphere(vec3(0, 0.5f, 0), 0.5f, 4);
  add_static(scene, builder, "sphere", add_surface(scene, "sphere", vec3(0.7f, 0.25f, 0.12f), 0.5f));
  const std::string& light = parameters.text("light");
  if (light == "triangle")
    add_triangle_light(scene);
  else
    add_punctual_light(scene, light == "spot" ? LightType::kSpot : LightType::kPoint);
  add_camera(scene, "camera", vec3(0.6f, 1.3f, 3.6f), vec3(0.1f, 0.35f, 0), 40);
  return scene;
}

}  // namespace

Definition single() {
  return {"single",
          "one light above one sphere on a plane",
          false,
          {{"light",
            "triangle",
            "kind of the light: triangle, point or spot",
            0,
            0,
            false,
            {"triangle", "point", "spot"}}},
          make};
}

}  // namespace lumigrove::builtin
