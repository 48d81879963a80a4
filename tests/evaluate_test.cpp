#include <gtest/gtest.h>

#include <cmath>

#include "base/vec.h"
#include "lumigrove/scene.h"

namespace lumigrove {
namespace {

constexpr float kHalfRoot = 0.70710678f;

void expect_near(vec3 a, vec3 b, float tolerance = 1e-5f) {
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], tolerance) << "component " << k;
}

Mesh unit_triangle() {
  Mesh mesh;
  mesh.positions = {vec3(0), vec3(1, 0, 0), vec3(0, 1, 0)};
  mesh.triangles = {uvec3(0, 1, 2)};
  return mesh;
}

// One triangle on one node.
Scene triangle_scene() {
  Scene scene;
  scene.name = "test";
  scene.materials.resize(1);
  scene.meshes = {unit_triangle()};
  scene.nodes.resize(1);
  scene.nodes[0].meshes = {0};
  return scene;
}

Scene animated(AnimatedProperty property, Interpolation interpolation, std::vector<float> times,
               std::vector<vec4> values) {
  Scene scene = triangle_scene();
  scene.animations.resize(1);
  scene.animations[0].channels = {{0, property, interpolation, std::move(times), std::move(values)}};
  validate(scene);
  return scene;
}

vec3 position_at(const Scene& scene, double seconds) {
  return evaluate(scene, seconds).instances[0].to_world[3];
}
vec3 x_axis_at(const Scene& scene, double seconds) {
  return evaluate(scene, seconds).instances[0].to_world[0];
}

TEST(Evaluate, LinearInterpolatesAndClampsToItsKeys) {
  const Scene scene = animated(AnimatedProperty::kTranslation, Interpolation::kLinear, {1, 3},
                               {vec4(0, 0, 0, 0), vec4(4, 0, -8, 0)});
  expect_near(position_at(scene, 0), vec3(0));
  expect_near(position_at(scene, 1.5), vec3(1, 0, -2));
  expect_near(position_at(scene, 99), vec3(4, 0, -8));
  EXPECT_EQ(duration(scene), 3.0);
  EXPECT_TRUE(evaluate(scene, 0).instances[0].moves);
}

TEST(Evaluate, StepHoldsTheLastKeyUntilTheNext) {
  const Scene scene = animated(AnimatedProperty::kTranslation, Interpolation::kStep, {0, 1, 2},
                               {vec4(0), vec4(1, 0, 0, 0), vec4(2, 0, 0, 0)});
  expect_near(position_at(scene, 0.999), vec3(0));
  expect_near(position_at(scene, 1), vec3(1, 0, 0));
  expect_near(position_at(scene, 1.999), vec3(1, 0, 0));
  expect_near(position_at(scene, 2.5), vec3(2, 0, 0));
}

TEST(Evaluate, CubicSplineFollowsTheHermitePolynomial) {
  // Over 2 s from 1 to 5 with out-tangent 3/s and in-tangent -2/s; the middle is (p0+p1)/2 + td (b0 - a1)
  // / 8.
  const Scene scene = animated(AnimatedProperty::kTranslation, Interpolation::kCubicSpline, {0, 2},
                               {vec4(77, 0, 0, 0), vec4(1, 0, 0, 0), vec4(3, 0, 0, 0), vec4(-2, 0, 0, 0),
                                vec4(5, 0, 0, 0), vec4(77, 0, 0, 0)});
  expect_near(position_at(scene, 0), vec3(1, 0, 0));
  expect_near(position_at(scene, 1), vec3(3 + 2 * (3 + 2) / 8.0f, 0, 0));
  expect_near(position_at(scene, 2), vec3(5, 0, 0));
  const float h = 1e-3f;  // the derivative at the first key is the out-tangent
  EXPECT_NEAR((position_at(scene, h).x - position_at(scene, 0).x) / h, 3, 1e-2);
}

TEST(Evaluate, RotationTakesTheShorterArc) {
  // 0 and 90 degrees about z, the second key with the quaternion's sign reversed.
  const Scene scene = animated(AnimatedProperty::kRotation, Interpolation::kLinear, {0, 1},
                               {vec4(0, 0, 0, 1), vec4(0, 0, -kHalfRoot, -kHalfRoot)});
  const float third = kPi / 6;
  expect_near(x_axis_at(scene, 1.0 / 3), vec3(std::cos(third), std::sin(third), 0));
}

TEST(Evaluate, CubicSplineRotationIsNormalized) {
  const Scene scene =
      animated(AnimatedProperty::kRotation, Interpolation::kCubicSpline, {0, 1},
               {vec4(0), vec4(0, 0, 0, 1), vec4(0), vec4(0), vec4(0, 0, kHalfRoot, kHalfRoot), vec4(0)});
  const vec3 x = x_axis_at(scene, 0.5);
  EXPECT_NEAR(glm::length(x), 1, 1e-5);
  expect_near(x, vec3(kHalfRoot, kHalfRoot, 0));
}

TEST(Evaluate, ChildrenFollowTheirParentsWhateverTheOrder) {
  Scene scene = triangle_scene();
  scene.nodes.resize(3);
  scene.nodes[0].parent = 2;  // parents have larger indices
  scene.nodes[0].translation = vec3(1, 0, 0);
  scene.nodes[2].parent = 1;
  scene.nodes[2].rotation = vec4(0, 0, kHalfRoot, kHalfRoot);
  scene.nodes[1].scale = vec3(2);
  scene.nodes[1].translation = vec3(0, 0, 5);
  scene.animations.resize(1);
  scene.animations[0].channels = {
      {1, AnimatedProperty::kTranslation, Interpolation::kStep, {0}, {vec4(0, 0, 5, 0)}}};
  validate(scene);
  const SceneState state = evaluate(scene, 0);
  expect_near(state.instances[0].to_world[3], vec3(0, 2, 5));
  expect_near(state.instances[0].to_world[0], vec3(0, 2, 0));
  EXPECT_TRUE(state.instances[0].moves);
}

TEST(Evaluate, ACycleOfParentsIsAnError) {
  Scene scene = triangle_scene();
  scene.nodes.resize(3);
  scene.nodes[0].parent = 1;
  scene.nodes[1].parent = 2;
  scene.nodes[2].parent = 0;
  EXPECT_THROW(evaluate(scene, 0), Error);
  EXPECT_THROW(validate(scene), Error);
}

TEST(Evaluate, NodeScaleTurnsLightsButNeverDimsThem) {
  Scene scene = triangle_scene();
  scene.lights.resize(1);
  scene.lights[0].color = vec3(3);
  scene.nodes[0].light = 0;
  scene.nodes[0].scale = vec3(10);
  scene.nodes[0].rotation = vec4(kHalfRoot, 0, 0, kHalfRoot);  // -Z turns to +Y
  const SceneState state = evaluate(scene, 0);
  expect_near(state.lights[0].light.color, vec3(3));
  expect_near(state.lights[0].direction, vec3(0, 1, 0));
  scene.nodes[0].scale = vec3(0);
  expect_near(evaluate(scene, 0).lights[0].direction, vec3(0, 1, 0));
}

TEST(Evaluate, CamerasAreOrthonormalUnderScaleAndShear) {
  Scene scene = triangle_scene();
  scene.cameras.resize(1);
  scene.nodes.resize(2);
  scene.nodes[0].scale = vec3(1, 3, 0.2f);
  scene.nodes[1].parent = 0;
  scene.nodes[1].camera = 0;
  scene.nodes[1].rotation = glm::normalize(vec4(0.3f, 0.2f, -0.4f, 1));
  const CameraInstance camera = evaluate(scene, 0).cameras[0];
  EXPECT_NEAR(glm::dot(camera.right, camera.up), 0, 1e-5);
  EXPECT_NEAR(glm::dot(camera.right, camera.forward), 0, 1e-5);
  expect_near(glm::cross(camera.right, camera.up), -camera.forward);
}

TEST(Evaluate, BoundsHoldEveryInstanceAndScaleOfZeroIsKept) {
  Scene scene = triangle_scene();
  scene.nodes.resize(2);
  scene.nodes[1].meshes = {0};
  scene.nodes[1].translation = vec3(10, 0, 0);
  scene.nodes[1].scale = vec3(0);
  const SceneState state = evaluate(scene, 0);
  ASSERT_EQ(state.instances.size(), 2u);
  expect_near(state.bounds.lo, vec3(0));
  expect_near(state.bounds.hi, vec3(10, 1, 0));
  EXPECT_NEAR(state.diagonal, std::sqrt(101.0f), 1e-4);
}

TEST(Evaluate, RefusesWhatSinglePrecisionCannotHold) {
  Scene scene = triangle_scene();
  EXPECT_THROW(evaluate(scene, std::nan("")), Error);
  scene.nodes[0].scale = vec3(1e30f);
  EXPECT_THROW(evaluate(scene, 0), Error);  // squared distances would overflow
  scene.nodes.resize(2);
  scene.nodes[0].parent = 1;
  scene.nodes[1].scale = vec3(1e30f);
  EXPECT_THROW(evaluate(scene, 0), Error);  // the product overflows
}

TEST(Evaluate, AnEmptySceneHasALengthOfOne) {
  const SceneState state = evaluate(Scene{}, 0);
  EXPECT_TRUE(state.bounds.empty());
  EXPECT_EQ(state.diagonal, 1.0f);
  EXPECT_EQ(duration(Scene{}), 0.0);
}

TEST(DefaultCamera, SeesTheWholeScene) {
  Scene scene = triangle_scene();
  scene.nodes[0].scale = vec3(7, 2, 1);
  scene.nodes[0].translation = vec3(100, -5, 3);
  const SceneState state = evaluate(scene, 0);
  const CameraInstance camera = default_camera(state);
  const float limit = std::tan(camera.camera.vertical_fov / 2);
  float largest = 0;
  for (const vec3 corner :
       {state.bounds.lo, state.bounds.hi, vec3(state.bounds.lo.x, state.bounds.hi.y, 3)}) {
    const vec3 d = corner - camera.position;
    const float depth = glm::dot(d, camera.forward);
    EXPECT_GT(depth, camera.camera.znear);
    EXPECT_LE(std::abs(glm::dot(d, camera.up)), limit * depth);
    EXPECT_LE(std::abs(glm::dot(d, camera.right)), limit * depth);
    largest =
        std::max(largest, std::max(std::abs(glm::dot(d, camera.up)), std::abs(glm::dot(d, camera.right))) /
                              (limit * depth));
  }
  EXPECT_GT(largest, 0.9f);  // no smaller than it must be
}

TEST(Validate, DropsTrianglesWithoutAreaOrWithNaNInOneWarning) {
  Scene scene = triangle_scene();
  scene.meshes[0].positions.push_back(vec3(std::nanf(""), 0, 0));
  scene.meshes[0].positions.push_back(vec3(2, 0, 0));
  scene.meshes[0].triangles.push_back(uvec3(0, 1, 3));
  scene.meshes[0].triangles.push_back(uvec3(0, 1, 4));
  scene.meshes[0].triangles.push_back(uvec3(2, 2, 2));
  validate(scene);
  ASSERT_EQ(scene.meshes[0].triangles.size(), 1u);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("3 triangles"), std::string::npos);
  EXPECT_TRUE(is_finite(evaluate(scene, 0).bounds.hi));
  validate(scene);  // nothing is left to repair
  EXPECT_EQ(scene.warnings.size(), 1u);
}

TEST(Validate, ClampsNegativeLightAndRefusesNaN) {
  Scene scene = triangle_scene();
  scene.materials[0].emission = vec3(-1, 2, 0);
  scene.lights.resize(1);
  scene.lights[0].color = vec3(-1);
  validate(scene);
  expect_near(scene.materials[0].emission, vec3(0, 2, 0));
  expect_near(scene.lights[0].color, vec3(0));
  EXPECT_EQ(scene.warnings.size(), 2u);
  scene.materials[0].emission.y = std::nanf("");
  EXPECT_THROW(validate(scene), Error);
}

TEST(Validate, ReplacesBrokenNormalsByThoseOfTheSurface) {
  Scene scene = triangle_scene();
  scene.meshes[0].normals = {vec3(0), vec3(0, 0, 4), vec3(std::nanf(""))};
  validate(scene);
  for (const vec3 n : scene.meshes[0].normals) expect_near(n, vec3(0, 0, 1));
  EXPECT_EQ(scene.warnings.size(), 1u);
}

// Each fault alone makes validation fail with a sentence that starts with the scene's name.
TEST(Validate, RefusesWhatCannotBeRepaired) {
  const std::vector<void (*)(Scene&)> faults = {
      [](Scene& s) { s.meshes[0].triangles[0].z = 3; },
      [](Scene& s) { s.meshes[0].material = 1; },
      [](Scene& s) { s.meshes[0].uv0 = {vec2(0)}; },
      [](Scene& s) { s.meshes[0].positions[0].x = 1e20f; },
      [](Scene& s) { s.nodes[0].meshes = {-1}; },
      [](Scene& s) { s.nodes[0].parent = 5; },
      [](Scene& s) { s.nodes[0].light = 0; },
      [](Scene& s) { s.nodes[0].camera = 0; },
      [](Scene& s) { s.nodes[0].rotation = vec4(0); },
      [](Scene& s) { s.nodes[0].translation.y = kInfinity; },
      [](Scene& s) { s.materials[0].base_color_texture.image = 0; },
      [](Scene& s) {
        s.images.push_back({.name = "i", .width = 2, .height = 2, .texels8 = {1, 2, 3, 4}, .texels32 = {}});
      },
      [](Scene& s) { s.cameras.push_back({.name = "c", .vertical_fov = 4}); },
      [](Scene& s) { s.environment.image = 3; },
      [](Scene& s) {
        s.animations = {{"a", {{.node = 0, .times = {0, 1}, .values = {vec4(0)}}}}};
      },
      [](Scene& s) {
        s.animations = {{"a", {{.node = 0, .times = {1, 0}, .values = {vec4(0), vec4(0)}}}}};
      },
      [](Scene& s) {
        s.animations = {{"a", {{.node = 7, .times = {0}, .values = {vec4(0)}}}}};
      },
  };
  for (std::size_t i = 0; i < faults.size(); ++i) {
    Scene scene = triangle_scene();
    faults[i](scene);
    try {
      validate(scene);
      ADD_FAILURE() << "fault " << i << " was accepted";
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).rfind("test: ", 0), 0u) << error.what();
    }
  }
}

TEST(ContentHash, ChangesWithContentAndNotWithTheName) {
  Scene scene = triangle_scene();
  const std::string before = content_hash(scene);
  EXPECT_EQ(before.size(), 16u);
  scene.name = "elsewhere";
  scene.warnings.push_back("w");
  EXPECT_EQ(content_hash(scene), before);
  scene.meshes[0].positions[1].x = std::nextafter(1.0f, 2.0f);
  EXPECT_NE(content_hash(scene), before);
}

TEST(ContentHash, SeesEveryByteOfLongArrays) {
  Scene scene = triangle_scene();
  scene.images.push_back({.name = "i", .width = 1024, .height = 600, .texels8 = {}, .texels32 = {}});
  scene.images[0].texels8.assign(4 * 1024 * 600, 9);
  const std::string before = content_hash(scene);
  scene.images[0].texels8.back() = 8;
  EXPECT_NE(content_hash(scene), before);
}

}  // namespace
}  // namespace lumigrove
