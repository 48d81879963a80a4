#include "lights/light_set.h"

#include <gtest/gtest.h>

#include "light_fixtures.h"
#include "lights/environment.h"
#include "statistics.h"

namespace lumigrove {
namespace {

using namespace lumigrove::testing;

Scene unit_square(vec3 emission, bool double_sided) {  // faces +Y
  Scene scene;
  const vec3 a(0, 1, 0), b(0, 1, 1), c(1, 1, 1), d(1, 1, 0);
  add_node(scene, {add_mesh(scene, add_material(scene, emission, double_sided), {a, b, c, a, c, d})});
  return scene;
}

TEST(LightSet, FluxOfALambertianEmitterIsPiTimesRadianceTimesArea) {
  EXPECT_NEAR(LightWorld(unit_square(vec3(2), false)).lights().local_flux, 2 * kPi, 1e-5);
  EXPECT_NEAR(LightWorld(unit_square(vec3(2), true)).lights().local_flux, 4 * kPi, 1e-5);
}

TEST(LightSet, LightScaleMultipliesEveryKind) {
  Scene scene = unit_square(vec3(1), false);
  add_light(scene, {}, vec3(0, 3, 0));
  scene.environment.radiance = vec3(1);
  Settings settings;
  settings.light_scale = 3;
  const LightWorld plain(scene), scaled(scene, kTree, settings);
  EXPECT_NEAR(scaled.lights().local_flux, 3 * plain.lights().local_flux, 1e-4);
  EXPECT_EQ(scaled.lights().environment.radiance, vec3(3));
}

TEST(LightSet, SpotFluxIsTheIntegralOfItsIntensity) {
  Scene scene = unit_square(vec3(0), false);
  PunctualLight spot;
  spot.type = LightType::kSpot;
  spot.color = vec3(5);
  spot.inner_cone = 0.4f;
  spot.outer_cone = 0.9f;
  add_light(scene, spot, vec3(0));
  const LightWorld world(scene);
  double integral = 0;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    const double cosine = 1 - 2 * (i + 0.5) / kSteps;
    const vec3 direction(static_cast<float>(std::sqrt(1 - cosine * cosine)), 0, static_cast<float>(-cosine));
    const EmitterPoint p = punctual_point(world.lights(), world.lights().emitters[0], direction);
    integral += luminance(p.incident) * 2 * kPi * 2 / kSteps;
  }
  EXPECT_NEAR(emitter_flux(world.lights(), 0), integral, 1e-3 * integral);
}

TEST(LightSet, RangeCutsOffUnlessIgnored) {
  Scene scene = unit_square(vec3(0), false);
  PunctualLight light;
  light.range = 2;
  add_light(scene, light, vec3(0));
  Settings ignore;
  ignore.ignore_range = true;
  const LightWorld limited(scene), unlimited(scene, kTree, ignore);
  EXPECT_EQ(punctual_point(limited.lights(), limited.lights().emitters[0], vec3(2.1f, 0, 0)).incident,
            vec3(0));
  EXPECT_NEAR(punctual_point(unlimited.lights(), unlimited.lights().emitters[0], vec3(2, 0, 0)).incident.x,
              0.25, 1e-6);
}

TEST(LightSet, OneSidedTrianglesShineOnlyForwardsAlsoWhenMirrored) {
  for (const float mirror : {1.0f, -1.0f}) {
    Scene scene = unit_square(vec3(1), false);
    scene.nodes[0].scale = vec3(mirror, 1, 1);
    const LightWorld world(scene);
    const LightSampler sampler = world.sampler(LightChoice::kUniform);
    for (std::uint32_t e = 0; e < 2; ++e) {
      EXPECT_GT(
          max_component(
              sample_emitter_point(sampler.scene, sampler.lights, e, vec3(0, 5, 0), vec2(0.3f)).incident),
          0);
      EXPECT_EQ(sample_emitter_point(sampler.scene, sampler.lights, e, vec3(0, -5, 0), vec2(0.3f)).incident,
                vec3(0));
    }
  }
}

// A black texture with one lit texel: triangles that cannot show it are dropped, the others carry its mean.
TEST(LightSet, EmissiveTexturesAreIntegratedAndBlackTrianglesDropped) {
  Scene scene;
  Image8or32 image;
  image.width = image.height = 8;
  image.texels32.assign(8 * 8 * 4, 0.0f);
  for (int c = 0; c < 4; ++c)
    image.texels32[(1 * 8 + 1) * 4 + static_cast<std::size_t>(c)] = 64;  // texel (1,1)
  scene.images.push_back(image);
  Material material;
  material.emission = vec3(1);
  material.emissive_texture.image = 0;
  scene.materials.push_back(material);
  Mesh mesh;
  mesh.positions = {vec3(0), vec3(1, 0, 0), vec3(1, 1, 0), vec3(0, 1, 0)};
  mesh.uv0 = {vec2(0), vec2(0.5f, 0), vec2(0.5f, 0.5f), vec2(0, 0.5f)};  // the quarter that holds the texel
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes.push_back(mesh);
  for (vec2& uv : mesh.uv0) uv += vec2(0.5f);  // a quarter that is black
  scene.meshes.push_back(mesh);
  add_node(scene, {0});
  add_node(scene, {1});
  const LightWorld world(scene);
  const LightView lights = world.lights();
  ASSERT_EQ(lights.emitters.size(), 2u);
  // One texel of 64 over 4 x 4 texels of the unit square: mean 4, flux 4 pi.
  EXPECT_NEAR(lights.local_flux, 4 * kPi, 0.15 * 4 * kPi);
  EXPECT_EQ(emitter_of_triangle(lights, 0, 1), 1u);
  EXPECT_EQ(emitter_of_triangle(lights, 1, 0), EmissiveInstance::kNoEmitters);

  // The mean of sampled points is the same flux: texture lookups and importance agree.
  RunningMean mean;
  Stream random(2);
  const LightSampler sampler = world.sampler(LightChoice::kUniform);
  for (int i = 0; i < 100000; ++i) {
    const vec4 u = random.next();
    const std::uint32_t e = u.z < 0.5f ? 0 : 1;
    mean.add(luminance(
        sample_emitter_point(sampler.scene, lights, e, vec3(0.5f, 0.5f, 1), vec2(u.x, u.y)).incident));
  }
  EXPECT_NEAR(mean.mean(), 4, 4 * mean.standard_error());
}

TEST(LightSet, StableIdsDoNotMoveWhenALightGoesOut) {
  Scene scene = unit_square(vec3(1), false);
  for (int i = 0; i < 3; ++i) add_light(scene, {}, vec3(static_cast<float>(i)));
  const LightWorld all(scene);
  scene.lights[1].color = vec3(0);
  const LightWorld fewer(scene);
  EXPECT_EQ(stable_id(all.lights(), 4), stable_id(fewer.lights(), 3));
  EXPECT_NE(stable_id(all.lights(), 3), stable_id(fewer.lights(), 3));
}

TEST(LightSet, LightsOfZeroOrAbsurdPowerAreNeverChosen) {
  Scene scene = unit_square(vec3(0), false);
  PunctualLight light;
  for (const float power :
       {0.0f, 1.0f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    light.color = vec3(power);
    add_light(scene, light, vec3(0, 1, 0));
  }
  const LightWorld world(scene);
  EXPECT_EQ(world.tree().view().count, 1u);
  EXPECT_NEAR(world.lights().local_flux, 4 * kPi, 1e-4);
}

Scene sky_with_a_sun_texel() {
  Scene scene = unit_square(vec3(0), false);
  Image8or32 image;
  image.width = 16;
  image.height = 8;
  image.texels32.assign(16 * 8 * 4, 0.1f);
  for (std::size_t c = 0; c < 4; ++c) image.texels32[(2 * 16 + 11) * 4 + c] = 500;
  scene.images.push_back(image);
  scene.environment.radiance = vec3(1);
  scene.environment.image = 0;
  return scene;
}

TEST(Environment, PdfIntegratesToOneAndSamplesCarryIt) {
  const LightWorld world(sky_with_a_sun_texel());
  const EnvironmentView environment = world.lights().environment;
  Stream random(3);
  RunningMean integral;
  for (int i = 0; i < 200000; ++i)
    integral.add(pdf_environment(environment, vec3(0, 1, 0), random.direction()) * 4 * kPi);
  EXPECT_NEAR(integral.mean(), 1, 4 * integral.standard_error());
  for (int i = 0; i < 1000; ++i) {
    const vec4 u = random.next();
    const EnvironmentSample sample = sample_environment(environment, vec3(0, 1, 0), vec2(u.x, u.y));
    EXPECT_NEAR(glm::length(sample.wi), 1, 1e-5);
    EXPECT_NEAR(pdf_environment(environment, vec3(0, 1, 0), sample.wi) / sample.pdf, 1, 1e-3);
  }
}

TEST(Environment, SampledMeanIsTheUniformMean) {
  const LightWorld world(sky_with_a_sun_texel());
  const LightSampler sampler = world.sampler(LightChoice::kUniform);
  const EnvironmentView environment = sampler.lights.environment;
  Stream random(4);
  RunningMean importance, uniform;
  for (int i = 0; i < 400000; ++i) {
    const vec4 u = random.next();
    const EnvironmentSample sample = sample_environment(environment, vec3(0, 1, 0), vec2(u.x, u.y));
    importance.add(luminance(environment_radiance(sampler.scene, environment, sample.wi)) / sample.pdf);
    uniform.add(luminance(environment_radiance(sampler.scene, environment, random.direction())) * 4 * kPi);
  }
  EXPECT_NEAR(importance.mean(), uniform.mean(),
              4 * std::hypot(importance.standard_error(), uniform.standard_error()));
  EXPECT_LT(importance.variance(), 0.1 * uniform.variance());
}

}  // namespace
}  // namespace lumigrove
