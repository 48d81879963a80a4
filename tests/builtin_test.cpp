// The procedural scenes: sound geometry, the promised numbers of lights, seeds and parameters that matter.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <tuple>

#include "base/vec.h"
#include "lumigrove/scene.h"
#include "scene/builtin/mesh_builder.h"

namespace lumigrove {
namespace {

bool emissive(const Scene& scene, int mesh) {
  return max_component(scene.materials[scene.meshes[mesh].material].emission) > 0;
}

std::size_t emissive_triangles(const Scene& scene) {
  std::size_t count = 0;
  for (const MeshInstance& instance : evaluate(scene, 0).instances)
    if (emissive(scene, instance.mesh)) count += scene.meshes[instance.mesh].triangles.size();
  return count;
}

const Mesh& find_mesh(const Scene& scene, const std::string& name) {
  for (const Mesh& mesh : scene.meshes)
    if (mesh.name == name) return mesh;
  throw Error("no mesh " + name);
}

using Point = std::tuple<float, float, float>;
Point point(vec3 p) { return {p.x, p.y, p.z}; }

// Every edge is used once in each direction, positions welded.
bool watertight(const Mesh& mesh) {
  std::map<std::pair<Point, Point>, int> edges;
  for (const uvec3 t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++edges[{point(mesh.positions[t[k]]), point(mesh.positions[t[(k + 1) % 3]])}];
  for (const auto& [edge, uses] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (back == edges.end() || back->second != uses) return false;
  }
  return !edges.empty();
}

// Positive when the triangles face outwards.
double signed_volume(const Mesh& mesh) {
  double volume = 0;
  const vec3 origin = mesh.positions.front();
  for (const uvec3 t : mesh.triangles) {
    const vec3 a = mesh.positions[t.x] - origin, b = mesh.positions[t.y] - origin,
               c = mesh.positions[t.z] - origin;
    volume += static_cast<double>(glm::dot(a, glm::cross(b, c))) / 6;
  }
  return volume;
}

// The scene with its default parameters, made once.
const Scene& default_scene(const std::string& name) {
  static std::map<std::string, Scene> scenes;
  const auto [at, inserted] = scenes.try_emplace(name);
  if (inserted) at->second = make_builtin_scene(name);
  return at->second;
}

const BuiltinScene& info_of(const std::string& name) {
  for (const BuiltinScene& info : builtin_scenes())
    if (info.name == name) return info;
  throw Error("no scene " + name);
}

std::string error_of_name(const std::string& name) {
  try {
    make_builtin_scene(name);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(MeshBuilder, SolidsAreClosedFaceOutwardsAndHaveTheirVolume) {
  using builtin::MeshBuilder;
  struct Solid {
    const char* name;
    std::function<void(MeshBuilder&)> add;
    double volume, tolerance;
  };
  const vec2 spindle[] = {{0, 0}, {1, 1}, {0, 2}};
  const auto circle = [](float turn) {
    return vec3(2 * std::cos(2 * kPi * turn), 2 * std::sin(2 * kPi * turn), 0);
  };
  const double pi = kPi;
  const Solid solids[] = {
      {"box", [](MeshBuilder& b) { b.box(vec3(0.1f, 0.2f, 0.3f), vec3(1.1f, 2.2f, 3.3f)); }, 6, 1e-4},
      {"rounded box", [](MeshBuilder& b) { b.rounded_box(vec3(0), vec3(1, 2, 3), 0.1f, 8); }, 5.9526, 0.01},
      {"icosphere", [](MeshBuilder& b) { b.icosphere(vec3(5), 1, 4); }, 4 * pi / 3, 0.02},
      {"sphere", [](MeshBuilder& b) { b.sphere(vec3(5), 1, 64, 64); }, 4 * pi / 3, 0.02},
      {"cylinder", [](MeshBuilder& b) { b.cylinder(vec3(0), vec3(1, 1, 1), 0.5f, 0.5f, 64); },
       0.25 * pi * std::sqrt(3.0), 0.01},
      {"cone", [](MeshBuilder& b) { b.cylinder(vec3(0), vec3(0, 0, 2), 0.5f, 0, 64); }, pi / 6, 0.01},
      {"torus", [=](MeshBuilder& b) { b.closed_tube(circle, 0.5f, 128, 64); }, pi * pi, 0.05},
      {"spindle", [=](MeshBuilder& b) { b.lathe(vec3(1), spindle, 64, false); }, 2 * pi / 3, 0.01}};
  for (const Solid& solid : solids) {
    MeshBuilder builder;
    solid.add(builder);
    const Mesh mesh = builder.take(solid.name, 0);
    EXPECT_TRUE(watertight(mesh)) << solid.name;
    EXPECT_NEAR(signed_volume(mesh), solid.volume, solid.tolerance) << solid.name;
  }
}

class EveryBuiltin : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Scenes, EveryBuiltin, ::testing::ValuesIn([] {
                           std::vector<std::string> names;
                           for (const BuiltinScene& scene : builtin_scenes()) names.push_back(scene.name);
                           return names;
                         }()),
                         [](const auto& instance) {
                           std::string name = instance.param;
                           std::erase(name, '-');
                           return name;
                         });

TEST_P(EveryBuiltin, ValidatesWithoutWarningsAndHasACamera) {
  const Scene& scene = default_scene(GetParam());
  EXPECT_TRUE(scene.warnings.empty()) << scene.warnings.front();
  EXPECT_GE(evaluate(scene, 0).cameras.size(), 1u);
  EXPECT_EQ(scene.name, GetParam());
}

TEST_P(EveryBuiltin, HasNoTriangleWithoutArea) {
  const Scene& scene = default_scene(GetParam());
  for (const Mesh& mesh : scene.meshes)
    for (const uvec3 t : mesh.triangles) {
      const vec3 normal =
          glm::cross(mesh.positions[t.y] - mesh.positions[t.x], mesh.positions[t.z] - mesh.positions[t.x]);
      ASSERT_GT(glm::length(normal), 1e-9f) << mesh.name;
    }
}

TEST_P(EveryBuiltin, ShadingNormalsAreOnTheFacesSide) {
  const Scene& scene = default_scene(GetParam());
  for (const Mesh& mesh : scene.meshes) {
    if (mesh.normals.empty()) continue;
    for (const uvec3 t : mesh.triangles) {
      const vec3 face = glm::normalize(
          glm::cross(mesh.positions[t.y] - mesh.positions[t.x], mesh.positions[t.z] - mesh.positions[t.x]));
      for (int k = 0; k < 3; ++k) ASSERT_GT(glm::dot(face, mesh.normals[t[k]]), 0.1f) << mesh.name;
    }
  }
}

TEST_P(EveryBuiltin, IsTheSameEveryTime) {
  EXPECT_EQ(content_hash(make_builtin_scene(GetParam())), content_hash(default_scene(GetParam())));
}

TEST_P(EveryBuiltin, EveryParameterAcceptsItsDefault) {
  std::string name = GetParam();
  for (const SceneParameter& p : info_of(GetParam()).parameters)
    name += (name == GetParam() ? "?" : "&") + p.name + "=" + p.default_value;
  EXPECT_EQ(content_hash(make_builtin_scene(name)), content_hash(default_scene(GetParam())));
}

TEST_P(EveryBuiltin, SeedChangesIt) {
  const auto& parameters = info_of(GetParam()).parameters;
  if (std::none_of(parameters.begin(), parameters.end(),
                   [](const SceneParameter& p) { return p.name == "seed"; }))
    GTEST_SKIP() << "has no seed";
  EXPECT_NE(content_hash(make_builtin_scene(GetParam() + "?seed=2")),
            content_hash(default_scene(GetParam())));
}

TEST_P(EveryBuiltin, MovesExactlyWhenItSaysSo) {
  const Scene& scene = default_scene(GetParam());
  const SceneState a = evaluate(scene, 0), b = evaluate(scene, 1);
  bool moved = false;
  for (std::size_t i = 0; i < a.instances.size(); ++i)
    moved |= a.instances[i].to_world != b.instances[i].to_world;
  for (std::size_t i = 0; i < a.lights.size(); ++i)
    moved |= a.lights[i].position != b.lights[i].position || a.lights[i].direction != b.lights[i].direction;
  for (std::size_t i = 0; i < a.cameras.size(); ++i) moved |= a.cameras[i].position != b.cameras[i].position;
  EXPECT_EQ(moved, info_of(GetParam()).animated);
}

TEST(Builtin, NightCityHasItsEmissiveTrianglesAllLocal) {
  const Scene& scene = default_scene("night-city");
  EXPECT_NEAR(static_cast<double>(emissive_triangles(scene)), 100000, 1000);
  EXPECT_EQ(scene.environment.radiance, vec3(0));
  for (const PunctualLight& light : scene.lights) EXPECT_NE(light.type, LightType::kDirectional);
  EXPECT_LT(evaluate(scene, 0).instances.size(), 4000u);
}

TEST(Builtin, NightCityFollowsItsLightsParameter) {
  for (const int lights : {8000, 600000})
    EXPECT_NEAR(static_cast<double>(
                    emissive_triangles(make_builtin_scene("night-city?lights=" + std::to_string(lights)))),
                lights, 0.02 * lights);
}

TEST(Builtin, NightCityBulbsAndNeonAreClosedAndFaceOutwards) {
  const Scene& scene = default_scene("night-city");
  for (const char* name : {"bulbs 1", "bulbs 6", "neon 1", "neon 3"}) {
    EXPECT_TRUE(watertight(find_mesh(scene, name))) << name;
    EXPECT_GT(signed_volume(find_mesh(scene, name)), 0) << name;
  }
}

TEST(Builtin, CornellLightsHasThePaperCounts) {
  const Scene& scene = default_scene("cornell-lights");
  EXPECT_EQ(emissive_triangles(scene), 12146u);
  std::size_t others = 0, solids = 0;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    const Mesh& mesh = scene.meshes[m];
    if (!emissive(scene, static_cast<int>(m))) others += mesh.triangles.size();
    if (mesh.name.rfind("solid ", 0) != 0) continue;
    ++solids;
    EXPECT_TRUE(watertight(mesh)) << mesh.name;
    EXPECT_GT(signed_volume(mesh), 0) << mesh.name;
    const vec3 radiance = scene.materials[mesh.material].emission;
    EXPECT_NEAR((radiance.x + radiance.y + radiance.z) / 3, 1.5f, 1e-4f);  // the mean of the paper's 1 to 2
    EXPECT_GT(glm::min(radiance.x, glm::min(radiance.y, radiance.z)), 0.2f);
  }
  EXPECT_EQ(others, 10u);
  EXPECT_EQ(solids, 12u);
}

TEST(Builtin, CornellSolidsStayInTheBox) {
  const Scene scene = make_builtin_scene("cornell-lights?seed=5");
  for (int frame = 0; frame <= 24; ++frame)
    for (const MeshInstance& instance : evaluate(scene, frame * 0.25).instances) {
      if (scene.meshes[instance.mesh].name.rfind("solid ", 0) != 0) continue;
      for (const vec3 p : scene.meshes[instance.mesh].positions) {
        const vec3 q = transform_point(instance.to_world, p);
        ASSERT_TRUE(glm::all(glm::greaterThan(q, vec3(-1.02f, 0, -1.04f))) &&
                    glm::all(glm::lessThan(q, vec3(1, 1.99f, 1.05f))));
      }
    }
}

TEST(Builtin, TowersHaveTheirEmissiveTriangles) {
  EXPECT_EQ(emissive_triangles(make_builtin_scene("towers")), 4600u);
  EXPECT_EQ(emissive_triangles(make_builtin_scene("towers?lights=100")), 100u);
}

TEST(Builtin, ColonnadeIsLitByTheSunAlone) {
  const Scene scene = make_builtin_scene("colonnade?bays=5&sun=60");
  EXPECT_EQ(emissive_triangles(scene), 0u);
  const SceneState state = evaluate(scene, 0);
  ASSERT_EQ(state.lights.size(), 1u);
  EXPECT_EQ(state.lights[0].light.type, LightType::kDirectional);
  EXPECT_NEAR(state.lights[0].direction.y, -std::sin(kPi / 3), 1e-3);
  EXPECT_GT(evaluate(make_builtin_scene("colonnade?bays=9"), 0).bounds.extent().x,
            state.bounds.extent().x + 11);
}

TEST(Builtin, LivingRoomBulbsAreClosedAndFaceOutwards) {
  const Scene& scene = default_scene("living-room");
  int bulbs = 0;
  for (const Mesh& mesh : scene.meshes) {
    if (mesh.name.find("bulb") == std::string::npos) continue;
    ++bulbs;
    EXPECT_TRUE(watertight(mesh)) << mesh.name;
    EXPECT_GT(signed_volume(mesh), 0) << mesh.name;
  }
  EXPECT_EQ(bulbs, 4);
}

TEST(Builtin, SingleHasExactlyOneLightOfTheKindAskedFor) {
  EXPECT_EQ(emissive_triangles(make_builtin_scene("single")), 1u);
  EXPECT_TRUE(make_builtin_scene("single").lights.empty());
  const Scene spot = make_builtin_scene("single?light=spot");
  EXPECT_EQ(emissive_triangles(spot), 0u);
  ASSERT_EQ(evaluate(spot, 0).lights.size(), 1u);
  EXPECT_EQ(spot.lights[0].type, LightType::kSpot);
}

TEST(Builtin, FirefliesCountIsExactAndItsFluxDoesNotDependOnIt) {
  const auto flux = [](const Scene& scene) {
    double sum = 0;
    for (const Mesh& mesh : scene.meshes)
      for (const uvec3 t : mesh.triangles)
        sum += 0.5 * luminance(scene.materials[mesh.material].emission) *
               static_cast<double>(glm::length(glm::cross(mesh.positions[t.y] - mesh.positions[t.x],
                                                          mesh.positions[t.z] - mesh.positions[t.x])));
    return sum;
  };
  const Scene few = make_builtin_scene("fireflies?n=800"), many = make_builtin_scene("fireflies?n=20003");
  EXPECT_EQ(emissive_triangles(few), 800u);
  EXPECT_EQ(emissive_triangles(many), 20003u);
  EXPECT_NEAR(flux(few) / flux(many), 1, 1e-3);
  EXPECT_EQ(emissive_triangles(make_builtin_scene("fireflies?n=1")), 1u);
  EXPECT_EQ(evaluate(make_builtin_scene("fireflies?n=1000&kind=point"), 0).lights.size(), 1000u);
}

TEST(Builtin, NamesAreRecognisedWithAndWithoutParameters) {
  EXPECT_TRUE(is_builtin_scene("single"));
  EXPECT_TRUE(is_builtin_scene("single?light=point"));
  EXPECT_FALSE(is_builtin_scene("single.glb"));
  EXPECT_FALSE(is_builtin_scene(""));
}

TEST(Builtin, BadNamesAndParametersAreRefusedInASentence) {
  EXPECT_NE(error_of_name("nightcity").find("night-city"), std::string::npos);
  EXPECT_NE(error_of_name("night-city?lamps=3").find("lights, blocks, seed"), std::string::npos);
  EXPECT_NE(error_of_name("night-city?lights=many").find("whole number"), std::string::npos);
  EXPECT_NE(error_of_name("night-city?lights=30000.5").find("whole number"), std::string::npos);
  EXPECT_NE(error_of_name("night-city?lights=-1").find("5000"), std::string::npos);
  EXPECT_NE(error_of_name("night-city?seed=1&seed=2").find("twice"), std::string::npos);
  EXPECT_NE(error_of_name("single?light=candle").find("triangle, point, spot"), std::string::npos);
  for (const char* name : {"night-city?seed", "night-city?seed=", "night-city?=3", "night-city?&",
                           "fireflies?n=0", "fireflies?n=nan", "fireflies?n=1e99", "single?"})
    EXPECT_EQ(error_of_name(name).empty(), std::string(name) == "single?") << name;
}

}  // namespace
}  // namespace lumigrove
