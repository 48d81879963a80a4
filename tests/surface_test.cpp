// Hits turned into surfaces: positions, normals, sides, materials, the self-intersection offset; and camera
// rays.
#include "scene/surface_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "device/device.h"
#include "scene/camera_kernel.h"
#include "trace/flatten.h"
#include "trace/trace.h"

namespace lumigrove {
namespace {

void expect_near(vec3 a, vec3 b, float tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

// One triangle (0,0,0) (1,0,0) (0,1,0) facing +z, with texture coordinates that grow right and down as glTF's
// do.
struct OneTriangle {
  Scene scene;
  SceneState state;

  OneTriangle() {
    Mesh mesh;
    mesh.positions = {vec3(0), vec3(1, 0, 0), vec3(0, 1, 0)};
    mesh.uv0 = {vec2(0, 1), vec2(1, 1), vec2(0, 0)};
    mesh.triangles = {uvec3(0, 1, 2)};
    scene.meshes = {mesh};
    scene.materials.resize(1);
    state.instances.resize(1);
  }
  Mesh& mesh() { return scene.meshes[0]; }
  Material& material() { return scene.materials[0]; }

  // Seen from `from` at barycentric (0.25, 0.5).
  Surface seen_from(vec3 from, bool force_diffuse = false) const {
    SceneArrays arrays(scene);
    arrays.set_state(state);
    const mat4x3& m = state.instances[0].to_world;
    Ray ray{from, 0, transform_point(m, vec3(0.25f, 0.5f, 0)) - from, kInfinity};
    return make_surface(arrays.view(), ray, Hit{0, 0, 0.25f, 0.5f, 1}, force_diffuse);
  }

  // One texel, linear unless srgb.
  int add_texel(std::array<std::uint8_t, 4> texel, bool srgb = false) {
    Image8or32 image;
    image.width = image.height = 1;
    image.srgb = srgb;
    image.texels8.assign(texel.begin(), texel.end());
    scene.images.push_back(image);
    return static_cast<int>(scene.images.size()) - 1;
  }
};

TEST(Surface, OfAMissHasNoInstance) {
  const SceneView view{};
  const Surface s = make_surface(view, Ray{vec3(0), 0, vec3(0, 0, -2), kInfinity}, Hit{}, false);
  EXPECT_EQ(s.instance, kNoId);
  EXPECT_EQ(s.emitter, kNoId);
  EXPECT_EQ(s.t, 0);
  EXPECT_EQ(s.wo, vec3(0, 0, 1));
  EXPECT_EQ(s.emission, vec3(0));
}

TEST(Surface, InterpolatesThePositionAndMeasuresTheDistance) {
  OneTriangle one;
  one.state.instances[0].to_world = mat4x3(vec3(2, 0, 0), vec3(0, 3, 0), vec3(0, 0, 1), vec3(5, 6, 7));
  const Surface s = one.seen_from(vec3(5.5f, 7.5f, 11));
  expect_near(s.position, vec3(5.5f, 7.5f, 7), 1e-6f);
  EXPECT_FLOAT_EQ(s.t, 4);
  expect_near(s.wo, vec3(0, 0, 1), 1e-6f);
  expect_near(s.geometric_normal, vec3(0, 0, 1), 1e-6f);
  EXPECT_EQ(s.instance, 0u);
  EXPECT_EQ(s.triangle, 0u);
  EXPECT_GT(s.epsilon, 0);
}

TEST(Surface, NormalsFaceTheViewerOnBothSides) {
  const OneTriangle one;
  EXPECT_EQ(one.seen_from(vec3(0, 0, 1)).normal.z, 1);
  EXPECT_EQ(one.seen_from(vec3(0, 0, -1)).normal.z, -1);
  EXPECT_EQ(one.seen_from(vec3(0, 0, -1)).geometric_normal.z, -1);
}

TEST(Surface, EmitsFromTheFrontOnlyUnlessDoubleSided) {
  OneTriangle one;
  one.material().emission = vec3(1, 2, 3);
  EXPECT_EQ(one.seen_from(vec3(0, 0, 1)).emission, vec3(1, 2, 3));
  EXPECT_EQ(one.seen_from(vec3(0, 0, -1)).emission, vec3(0));
  one.material().double_sided = true;
  EXPECT_EQ(one.seen_from(vec3(0, 0, -1)).emission, vec3(1, 2, 3));
}

TEST(Surface, MirroredInstancesKeepTheirFront) {
  OneTriangle one;
  one.material().emission = vec3(1);
  one.mesh().normals = {vec3(0.6f, 0, 0.8f), vec3(0.6f, 0, 0.8f), vec3(0.6f, 0, 0.8f)};
  one.state.instances[0].to_world[0] = vec3(-1, 0, 0);  // mirrors x; the front stays at +z
  const Surface front = one.seen_from(vec3(0, 0, 2));
  EXPECT_EQ(front.emission, vec3(1));
  EXPECT_EQ(front.geometric_normal.z, 1);
  expect_near(front.normal, vec3(-0.6f, 0, 0.8f), 1e-6f);
  EXPECT_EQ(one.seen_from(vec3(0, 0, -2)).emission, vec3(0));

  one.state.instances[0].to_world = mat4x3(1);
  one.state.instances[0].to_world[2] = vec3(0, 0, -1);  // mirrors z; the front goes to -z
  EXPECT_EQ(one.seen_from(vec3(0, 0, 2)).emission, vec3(0));
  EXPECT_EQ(one.seen_from(vec3(0, 0, -2)).emission, vec3(1));
  expect_near(one.seen_from(vec3(0, 0, -2)).normal, vec3(0.6f, 0, -0.8f), 1e-6f);
}

TEST(Surface, ShadingNormalsAreInterpolatedAndTransformedAsNormals) {
  OneTriangle one;
  one.mesh().normals = {vec3(0, 0, 1), vec3(0.6f, 0, 0.8f), vec3(0, 0, 1)};
  one.state.instances[0].to_world[0] = vec3(2, 0, 0);
  const vec3 object = glm::normalize(vec3(0, 0, 1) * 0.75f + vec3(0.6f, 0, 0.8f) * 0.25f);
  expect_near(one.seen_from(vec3(0.5f, 0.5f, 3)).normal,
              glm::normalize(vec3(object.x / 2, object.y, object.z)), 1e-6f);
}

TEST(Surface, BrokenShadingNormalsFallBackToTheGeometricOne) {
  OneTriangle one;
  one.mesh().normals = {vec3(0), vec3(0), vec3(0)};
  EXPECT_EQ(one.seen_from(vec3(0, 0, 1)).normal, vec3(0, 0, 1));
  one.mesh().normals[2] = vec3(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(one.seen_from(vec3(0, 0, 1)).normal, vec3(0, 0, 1));
}

TEST(Surface, ShadingNormalNeverFacesAwayAndBendsContinuously) {
  OneTriangle one;
  const vec3 tilted = glm::normalize(vec3(1, 0, 0.3f));
  one.mesh().normals = {tilted, tilted, tilted};
  vec3 previous(0);
  for (int i = 1; i < 600; ++i) {
    const float angle = kPi * static_cast<float>(i) / 600;
    const vec3 from = vec3(0.25f, 0.5f, 0) + 4.0f * vec3(std::cos(angle), 0, std::sin(angle));
    const Surface s = one.seen_from(from);
    EXPECT_GT(glm::dot(s.normal, s.wo), 0);
    EXPECT_GT(glm::dot(s.normal, s.geometric_normal), 0);
    EXPECT_NEAR(glm::length(s.normal), 1, 1e-5f);
    if (i > 1) {
      EXPECT_LT(glm::length(s.normal - previous), 0.02f) << i;
    }
    previous = s.normal;
  }
}

TEST(Surface, SplitsBaseColourByMetallic) {
  OneTriangle one;
  one.material().base_color = vec3(0.8f, 0.4f, 0.2f);
  one.material().metallic = 0.25f;
  one.material().roughness = 0.01f;
  const Surface s = one.seen_from(vec3(0, 0, 1));
  expect_near(s.diffuse, vec3(0.6f, 0.3f, 0.15f), 1e-6f);
  expect_near(s.specular, vec3(0.23f, 0.13f, 0.08f), 1e-6f);
  EXPECT_EQ(s.roughness, 0.08f);
  const Surface diffuse = one.seen_from(vec3(0, 0, 1), true);
  expect_near(diffuse.diffuse, vec3(0.8f, 0.4f, 0.2f), 1e-6f);
  EXPECT_EQ(diffuse.specular, vec3(0));
}

TEST(Surface, MultipliesFactorsTexturesAndVertexColours) {
  OneTriangle one;
  Material& material = one.material();
  material.base_color = vec3(0.5f);
  material.metallic = 1;
  material.roughness = 0.5f;
  material.emission = vec3(10, 20, 30);
  material.base_color_texture.image = one.add_texel({255, 188, 0, 255}, true);
  material.metallic_roughness_texture.image = one.add_texel({7, 204, 51, 255});
  material.emissive_texture.image = one.add_texel({255, 0, 51, 255});
  one.mesh().colors = {vec4(0.5f), vec4(0.5f), vec4(0.5f)};
  const Surface s = one.seen_from(vec3(0, 0, 1));
  const vec3 base = vec3(1, 0.50289f, 0) * 0.25f;
  expect_near(s.diffuse, base * 0.8f, 1e-4f);
  expect_near(s.specular, vec3(0.04f * 0.8f) + base * 0.2f, 1e-4f);
  EXPECT_NEAR(s.roughness, 0.4f, 1e-5f);
  expect_near(s.emission, vec3(10, 0, 6), 1e-4f);
}

// A normal map that leans to the right (+x of the texture) or up (+y: against growing v).
TEST(Surface, NormalMapFollowsTextureCoordinatesWithAndWithoutTangents) {
  for (const bool tangents : {false, true}) {
    OneTriangle one;
    if (tangents) one.mesh().tangents = {vec4(1, 0, 0, 1), vec4(1, 0, 0, 1), vec4(1, 0, 0, 1)};
    // (0.6, 0, 0.8) and (0, 0.6, 0.8), rounded to 8 bits
    const int right = one.add_texel({204, 128, 230, 255}), up = one.add_texel({128, 204, 230, 255});
    one.material().normal_texture.image = right;
    expect_near(one.seen_from(vec3(0, 0, 3)).normal, vec3(0.6f, 0, 0.8f), 0.01f);
    expect_near(one.seen_from(vec3(0, 0, -3)).normal, vec3(-0.6f, 0, -0.8f), 0.01f);
    one.material().normal_texture.image = up;
    expect_near(one.seen_from(vec3(0, 0, 3)).normal, vec3(0, 0.6f, 0.8f), 0.01f);
    one.material().normal_scale = 0;
    expect_near(one.seen_from(vec3(0, 0, 3)).normal, vec3(0, 0, 1), 1e-6f);
    one.material().normal_scale = 1;
    // Mirroring the object mirrors its bumps.
    one.state.instances[0].to_world[0] = vec3(-1, 0, 0);
    expect_near(one.seen_from(vec3(0, 0, 3)).normal, vec3(0, 0.6f, 0.8f), 0.01f);
    one.material().normal_texture.image = right;
    expect_near(one.seen_from(vec3(0, 0, 3)).normal, vec3(-0.6f, 0, 0.8f), 0.01f);
  }
}

TEST(Surface, NormalMapUnderstandsMirroredTextureCoordinates) {
  OneTriangle one;
  one.mesh().uv0 = {vec2(1, 1), vec2(0, 1), vec2(1, 0)};  // u grows to the left
  one.material().normal_texture.image = one.add_texel({204, 128, 230, 255});
  expect_near(one.seen_from(vec3(0, 0, 3)).normal, vec3(-0.6f, 0, 0.8f), 0.01f);
  one.material().normal_texture.image = one.add_texel({128, 204, 230, 255});
  expect_near(one.seen_from(vec3(0, 0, 3)).normal, vec3(0, 0.6f, 0.8f), 0.01f);
}

TEST(Surface, ScalesExactlyWithTheScene) {
  OneTriangle one;
  one.mesh().positions = {vec3(0.3f, -2.1f, 5), vec3(1.7f, 0.2f, 4.4f), vec3(-0.9f, 1.3f, 5.9f)};
  const Surface s = one.seen_from(vec3(1, 2, 20));
  for (int c = 0; c < 4; ++c) one.state.instances[0].to_world[c] *= 1024.0f;
  const Surface big = one.seen_from(vec3(1024, 2048, 20480));
  EXPECT_EQ(big.position, s.position * 1024.0f);
  EXPECT_EQ(big.epsilon, s.epsilon * 1024.0f);
  EXPECT_EQ(big.t, s.t * 1024.0f);
  EXPECT_EQ(big.geometric_normal, s.geometric_normal);
}

// Rays that leave a closed convex body outwards must never meet it again, however large the body, wherever it
// stands and however flat the ray; rays that leave it inwards must meet its other side.
TEST(Surface, EpsilonClearsSelfIntersectionWithoutLeaking) {
  std::mt19937 engine(5);
  const auto uniform = [&](float lo, float hi) {
    return lo + (hi - lo) * static_cast<float>(engine() >> 8) * 0x1p-24f;
  };
  Mesh sphere;
  constexpr std::uint32_t kRings = 24, kSegments = 48;
  for (std::uint32_t r = 0; r <= kRings; ++r) {
    for (std::uint32_t s = 0; s <= kSegments; ++s) {
      const float theta = kPi * static_cast<float>(r) / kRings;
      const float phi = 2 * kPi * static_cast<float>(s % kSegments) / kSegments;
      sphere.positions.push_back(
          vec3(std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi)));
      if (r == kRings || s == kSegments) continue;
      const std::uint32_t a = r * (kSegments + 1) + s, b = a + kSegments + 1;
      if (r > 0) sphere.triangles.push_back(uvec3(a, b, a + 1));
      if (r + 1 < kRings) sphere.triangles.push_back(uvec3(a + 1, b, b + 1));
    }
  }
  for (int trial = 0; trial < 12; ++trial) {
    Scene scene;
    scene.materials.resize(1);
    scene.meshes = {sphere};
    SceneState state;
    state.instances.resize(trial % 6 == 5 ? 2 : 1);
    const float size = std::exp2(uniform(-10, 14));
    mat4x3& m = state.instances[0].to_world;
    for (int c = 0; c < 3; ++c) m[c] *= size * uniform(0.3f, 1);
    m[3] = vec3(uniform(-4, 4), uniform(-4, 4), uniform(-4, 4)) * size;
    if (trial % 6 == 5) {  // traced as an instance, when there is much else
      state.instances[0].moves = true;
      Mesh bulk;
      bulk.positions.assign(3, vec3(std::numeric_limits<float>::quiet_NaN()));
      bulk.triangles.assign(kMaxRebuiltSoup, uvec3(0, 1, 2));
      scene.meshes.push_back(bulk);
      state.instances[1].mesh = 1;
    }
    const Tracer tracer(scene, state);
    SceneArrays arrays(scene);
    arrays.set_state(state);

    constexpr std::size_t kRays = 10000;
    std::vector<Ray> rays(kRays), leaving(kRays), entering(kRays);
    for (Ray& ray : rays) {
      const vec3 away(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
      const vec3 from = m[3] + glm::normalize(away) * (uniform(1.5f, 30) * size);
      const vec3 to = transform_point(m, vec3(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)));
      ray = {from, 0, glm::normalize(to - from), kInfinity};
    }
    std::vector<Hit> hits(kRays);
    tracer.closest(rays, hits, Coherence::kCoherent);
    std::vector<Surface> surfaces(kRays);
    launch(kRays, SurfaceKernel{arrays.view(), rays, hits, surfaces});
    std::vector<bool> seen_from_outside(kRays, false);  // a few rays slip in between two triangles
    for (std::size_t i = 0; i < kRays; ++i) {
      const Surface& s = surfaces[i];
      seen_from_outside[i] = s.instance == 0 && glm::dot(s.geometric_normal, s.position - m[3]) > 0;
      if (!seen_from_outside[i]) continue;
      const Frame frame = make_frame(s.geometric_normal);
      const float phi = uniform(0, 2 * kPi), z = std::pow(uniform(0, 1), 4.0f), r = std::sqrt(1 - z * z);
      const vec3 up = frame.to_world(vec3(r * std::cos(phi), r * std::sin(phi), z));
      const vec3 down = frame.to_world(vec3(0.3f * std::cos(phi), 0.3f * std::sin(phi), -1));
      leaving[i] = {s.position + s.geometric_normal * s.epsilon, 0, up, kInfinity};
      entering[i] = {s.position - s.geometric_normal * s.epsilon, 0, down, kInfinity};
    }
    std::vector<std::uint8_t> occluded(kRays);
    tracer.occluded(leaving, occluded, Coherence::kIncoherent);
    EXPECT_EQ(std::count(occluded.begin(), occluded.end(), 1), 0) << "trial " << trial;
    tracer.occluded(entering, occluded, Coherence::kIncoherent);
    int leaks = 0, hit_count = 0;
    for (std::size_t i = 0; i < kRays; ++i) {
      if (!seen_from_outside[i]) continue;
      ++hit_count;
      leaks += occluded[i] == 0;
    }
    EXPECT_GT(hit_count, 500);
    EXPECT_EQ(leaks, 0) << "trial " << trial;
  }
}

TEST(PixelOrder, VisitsEveryPixelOnceAndKeepsPacketsSquare) {
  for (const PixelWindow window :
       {PixelWindow{0, 0, 16, 8}, PixelWindow{0, 0, 13, 7}, PixelWindow{5, 3, 6, 20}, PixelWindow{2, 2, 3, 3},
        PixelWindow{0, 1, 33, 2}}) {
    std::vector<int> seen(static_cast<std::size_t>(window.count()), 0);
    for (int i = 0; i < window.count(); ++i) {
      const Pixel p = pixel_of_index(window, i);
      ASSERT_TRUE(p.x >= window.x0 && p.x < window.x1 && p.y >= window.y0 && p.y < window.y1);
      ++seen[static_cast<std::size_t>((p.y - window.y0) * window.width() + p.x - window.x0)];
    }
    for (const int count : seen) EXPECT_EQ(count, 1);
  }
  const PixelWindow window{0, 0, 16, 8};
  for (int i = 0; i < 16; ++i) {
    EXPECT_LT(pixel_of_index(window, i).x, 4);
    EXPECT_LT(pixel_of_index(window, i).y, 4);
  }
}

TEST(Camera, RaysFollowTheVerticalFieldOfViewFromTheTopLeft) {
  CameraInstance camera;
  camera.camera.vertical_fov = kPi / 2;
  camera.position = vec3(1, 2, 3);
  const CameraView view = make_camera_view(camera, 200, 100);
  const Ray centre = camera_ray(view, vec2(100, 50));
  expect_near(centre.direction, vec3(0, 0, -1), 1e-6f);
  EXPECT_EQ(centre.origin, vec3(1, 2, 3));
  EXPECT_FLOAT_EQ(centre.tmin, camera.camera.znear);
  const Ray corner = camera_ray(view, vec2(0, 0));
  expect_near(corner.direction, glm::normalize(vec3(-2, 1, -1)), 1e-6f);
  EXPECT_NEAR(corner.tmin, camera.camera.znear * std::sqrt(6.0f), 1e-6f);
}

TEST(Camera, CropWindowShowsTheSamePixels) {
  const CameraView view = make_camera_view(CameraInstance{}, 64, 48);
  const PixelWindow whole{0, 0, 64, 48}, crop{10, 20, 31, 29};
  std::vector<Ray> rays(static_cast<std::size_t>(whole.count())),
      cropped(static_cast<std::size_t>(crop.count()));
  std::vector<std::uint32_t> pixels(rays.size()), cropped_pixels(cropped.size());
  launch(whole.count(), CameraKernel{view, whole, rays, pixels, 7, 2, true});
  launch(crop.count(), CameraKernel{view, crop, cropped, cropped_pixels, 7, 2, true});
  std::vector<Ray> by_pixel(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(pixels[i], rng_pixel(view, pixel_of_index(whole, static_cast<int>(i))));
    by_pixel[pixels[i]] = rays[i];
  }
  for (std::size_t i = 0; i < cropped.size(); ++i) {
    EXPECT_EQ(cropped[i].direction, by_pixel[cropped_pixels[i]].direction);
  }
}

TEST(Camera, JitterStaysInsideThePixel) {
  const CameraView view = make_camera_view(CameraInstance{}, 40, 30);
  const PixelWindow window{0, 0, 40, 30};
  std::vector<Ray> jittered(1200), centred(1200);
  std::vector<std::uint32_t> pixels(1200);
  launch(window.count(), CameraKernel{view, window, jittered, pixels, 1, 0, true});
  launch(window.count(), CameraKernel{view, window, centred, pixels, 1, 0, false});
  int moved = 0;
  for (std::size_t i = 0; i < jittered.size(); ++i) {
    const vec3 a = jittered[i].direction / -jittered[i].direction.z,
               b = centred[i].direction / -centred[i].direction.z;
    EXPECT_LE(std::abs(a.x - b.x), 0.5001f * view.pixel_size.x);
    EXPECT_LE(std::abs(a.y - b.y), 0.5001f * view.pixel_size.y);
    moved += a != b;
  }
  EXPECT_GT(moved, 1100);
}

}  // namespace
}  // namespace lumigrove
