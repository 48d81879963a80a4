#include <gtest/gtest.h>

#include <cmath>

#include "base/srgb.h"
#include "scene/image_encode.h"
#include "scene/import.h"
#include "temp_folder.h"

namespace lumigrove {
namespace {

constexpr const char* kTriangle =
    "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3\n";

// The material of a one-triangle OBJ with these lines in its MTL file.
Scene import_with_material(const TempFolder& folder, const std::string& lines) {
  folder.write("a.mtl", "newmtl m\n" + lines);
  return import_assimp(folder.write("a.obj", kTriangle));
}

const Material& used_material(const Scene& scene) {
  return scene.materials.at(static_cast<std::size_t>(scene.meshes.at(0).material));
}

std::vector<std::uint8_t> png(int width, int height, const std::vector<std::uint8_t>& texels, bool srgb) {
  const Image8or32 image{
      .name = "test", .width = width, .height = height, .srgb = srgb, .texels8 = texels, .texels32 = {}};
  return encode_png(image, srgb ? TextureContent::kColor : TextureContent::kData).bytes;
}

bool has_warning(const Scene& scene, const std::string& part) {
  return std::any_of(scene.warnings.begin(), scene.warnings.end(),
                     [&](const std::string& w) { return w.find(part) != std::string::npos; });
}

TEST(AssimpImport, MtlColoursAndEmissionSurvive) {
  const TempFolder folder;
  const Scene scene =
      import_with_material(folder, "Kd 0.5 0.25 0.125\nKe 400 3 0.5\nKs 0.1 0.1 0.1\nNs 30\n");
  const Material& m = used_material(scene);
  EXPECT_EQ(m.name, "m");
  EXPECT_EQ(m.base_color, vec3(0.5f, 0.25f, 0.125f));
  EXPECT_EQ(m.emission, vec3(400, 3, 0.5f));
  EXPECT_FLOAT_EQ(m.roughness, std::sqrt(std::sqrt(2.0f / 32)));
  EXPECT_EQ(m.metallic, 0);
  EXPECT_FALSE(m.double_sided);
  EXPECT_TRUE(scene.warnings.empty());
}

TEST(AssimpImport, MaterialWithoutSpecularColourIsRough) {
  const TempFolder folder;
  EXPECT_EQ(used_material(import_with_material(folder, "Kd 1 1 1\nNs 900\nKs 0 0 0\n")).roughness, 1);
}

TEST(AssimpImport, PhysicalMtlKeysAreUsed) {
  const TempFolder folder;
  const Scene scene = import_with_material(folder, "Kd 1 1 1\nPr 0.25\nPm 1\n");
  EXPECT_EQ(used_material(scene).roughness, 0.25f);
  EXPECT_EQ(used_material(scene).metallic, 1);
}

TEST(AssimpImport, GeometryIsIndexedAndVGrowsDownwards) {
  const TempFolder folder;
  const Scene scene = import_assimp(folder.write(
      "quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0.25\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\n"));
  ASSERT_EQ(scene.meshes.size(), 1u);
  const Mesh& mesh = scene.meshes[0];
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.uv0.at(0), vec2(0, 0.75f));
  EXPECT_EQ(mesh.normals.at(0), vec3(0, 0, 1));
  const vec3 a = mesh.positions[mesh.triangles[0].x], b = mesh.positions[mesh.triangles[0].y],
             c = mesh.positions[mesh.triangles[0].z];
  EXPECT_GT(glm::cross(b - a, c - a).z, 0);  // winding is kept: it says to which side a triangle emits
}

TEST(AssimpImport, TexturesAreFoundThroughBackslashesWithTheirWrapMode) {
  const TempFolder folder;
  const std::vector<std::uint8_t> texels = {10, 20, 30, 255, 40, 50, 60, 255};
  folder.write("tex/a.png", png(2, 1, texels, true));
  const Scene scene = import_with_material(folder, "Kd 1 1 1\nmap_Kd -clamp on tex\\a.png\n");
  const TextureUse& use = used_material(scene).base_color_texture;
  ASSERT_EQ(use.image, 0);
  EXPECT_EQ(use.wrap_u, Wrap::kClamp);
  EXPECT_TRUE(scene.images[0].srgb);
  EXPECT_EQ(scene.images[0].texels8, texels);
  EXPECT_EQ(used_material(scene).alpha_mode, AlphaMode::kOpaque);
}

TEST(AssimpImport, EmissiveTextureWithoutColourIsTakenAsOneWithAWarning) {
  const TempFolder folder;
  folder.write("e.png", png(1, 1, {1, 2, 3, 255}, true));
  const Scene scene = import_with_material(folder, "Kd 1 1 1\nmap_Ke e.png\n");
  EXPECT_EQ(used_material(scene).emission, vec3(1));
  EXPECT_EQ(used_material(scene).emissive_texture.image, 0);
  EXPECT_TRUE(has_warning(scene, "emissive"));
}

TEST(AssimpImport, OpacityMapBecomesTheAlphaOfTheBaseColour) {
  const TempFolder folder;
  folder.write("c.png", png(1, 1, {10, 20, 30, 255}, true));
  folder.write("d.png", png(2, 1, {0, 0, 0, 255, 255, 255, 255, 255}, false));
  const Scene scene = import_with_material(folder, "Kd 1 1 1\nmap_Kd c.png\nmap_d d.png\n");
  EXPECT_EQ(used_material(scene).alpha_mode, AlphaMode::kMask);
  const Image8or32& image =
      scene.images.at(static_cast<std::size_t>(used_material(scene).base_color_texture.image));
  EXPECT_EQ(image.width, 2);
  EXPECT_EQ(image.texels8, (std::vector<std::uint8_t>{10, 20, 30, 0, 10, 20, 30, 255}));
}

TEST(AssimpImport, RoughnessAndMetalnessMapsAreJoined) {
  const TempFolder folder;
  folder.write("r.png", png(1, 1, {90, 90, 90, 255}, false));
  folder.write("m.png", png(1, 1, {200, 200, 200, 255}, false));
  const Scene scene = import_with_material(folder, "Kd 1 1 1\nPm 1\nPr 1\nmap_Pr r.png\nmap_Pm m.png\n");
  const Image8or32& image =
      scene.images.at(static_cast<std::size_t>(used_material(scene).metallic_roughness_texture.image));
  EXPECT_FALSE(image.srgb);
  EXPECT_EQ(image.texels8[1], 90);
  EXPECT_EQ(image.texels8[2], 200);
}

TEST(AssimpImport, FilesOutsideTheScenesFolderAreRefused) {
  const TempFolder folder;
  folder.write("secret.png", png(1, 1, {1, 2, 3, 255}, true));
  folder.write("secret.mtl", "newmtl m\nKd 1 0 0\n");
  folder.write("in/a.mtl", "newmtl m\nmap_Kd ../secret.png\n");
  const auto texture = folder.write("in/a.obj", kTriangle);
  const std::string sentence = error_of([&] { import_assimp(texture); });
  EXPECT_NE(sentence.find("'../secret.png' leaves the scene's folder"), std::string::npos) << sentence;

  const auto library =
      folder.write("in/b.obj", "mtllib ../secret.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n");
  EXPECT_NE(error_of([&] { import_assimp(library); }).find("leaves the scene's folder"), std::string::npos);

  folder.write("in/a.mtl", "newmtl m\nmap_Kd " + (folder / "secret.png").string() + "\n");
  EXPECT_NE(error_of([&] { import_assimp(texture); }).find("leaves the scene's folder"), std::string::npos);

  std::filesystem::create_symlink(folder / "secret.png", folder / "in/link.png");
  folder.write("in/a.mtl", "newmtl m\nmap_Kd link.png\n");
  EXPECT_NE(error_of([&] { import_assimp(texture); }).find("leaves the scene's folder"), std::string::npos);
}

TEST(AssimpImport, ObjNumbersMayBeginWithAPointAndLinesWithABlank) {
  const TempFolder folder;
  const Scene scene = import_assimp(folder.write(
      "a.obj", " v .5 0 0\r\nv\t0 .25 0\nv 0 0 -.125\nvt .5 0\nvt 0 .5\nvt 0 0\ng a .5\n\tf 1/1 2/2 3/3\n"));
  ASSERT_EQ(scene.meshes.size(), 1u);
  const std::vector<vec3> expected = {vec3(0.5f, 0, 0), vec3(0, 0.25f, 0), vec3(0, 0, -0.125f)};
  EXPECT_EQ(scene.meshes[0].positions, expected);
  EXPECT_EQ(scene.meshes[0].uv0.at(0), vec2(0.5f, 1));
}

TEST(AssimpImport, MissingTextureIsNamed) {
  const TempFolder folder;
  const std::string sentence = error_of([&] { import_with_material(folder, "map_Kd gone.png\n"); });
  EXPECT_NE(sentence.find("a.obj"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("gone.png"), std::string::npos) << sentence;
}

TEST(AssimpImport, MissingMaterialLibraryIsAWarning) {
  const TempFolder folder;
  const Scene scene =
      import_assimp(folder.write("b.obj", "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  EXPECT_TRUE(has_warning(scene, "gone.mtl"));
}

TEST(AssimpImport, PathOfAnotherDiskIsLookedUpByNameWithAWarning) {
  const TempFolder folder;
  folder.write("wall.png", png(1, 1, {9, 9, 9, 255}, true));
  const Scene scene = import_with_material(folder, "map_Kd C:\\art\\wall.png\n");
  EXPECT_EQ(scene.images.size(), 1u);
  EXPECT_TRUE(has_warning(scene, "wall.png"));
}

TEST(AssimpImport, PlyVertexColoursAreDecodedFromSrgb) {
  const TempFolder folder;
  const Scene scene = import_assimp(folder.write(
      "c.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n0 0 0 255 128 0\n1 0 0 255 128 0\n0 1 0 255 128 "
      "0\n"
      "3 0 1 2\n"));
  ASSERT_EQ(scene.meshes.at(0).colors.size(), 3u);
  EXPECT_NEAR(scene.meshes[0].colors[0].y, srgb_to_linear(128 / 255.0f), 1e-5);
  EXPECT_NEAR(scene.meshes[0].colors[0].x, 1, 1e-5);
}

TEST(AssimpImport, FbxCamerasLightsAndAnimationArePlaced) {
  const std::string file = "/usr/share/assimp/models/FBX/animation_with_skeleton.fbx";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "package assimp-testmodels is not installed";
  const Scene scene = import_assimp(file);
  EXPECT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.lights.size(), 1u);
  EXPECT_GT(duration(scene), 0);
  const SceneState state = evaluate(scene, 0);
  ASSERT_EQ(state.cameras.size(), 1u);
  EXPECT_NEAR(glm::length(state.cameras[0].forward), 1, 1e-5);
}

TEST(AssimpImport, OtherInputIsRefusedInOneSentence) {
  const TempFolder folder;
  EXPECT_NE(error_of([&] { import_assimp(folder / "none.obj"); }).find("no such file"), std::string::npos);
  EXPECT_NE(error_of([&] { import_assimp(folder.path()); }).find("not a regular file"), std::string::npos);
  EXPECT_NE(error_of([&] { import_assimp(folder.write("e.obj", "")); }).find("empty"), std::string::npos);
  EXPECT_NE(error_of([&] { import_assimp(folder.write("a.xyz", "1")); }).find("'.xyz'"), std::string::npos);
  error_of([&] { import_assimp(folder.write("p.obj", "v 0 0 0\n")); });
}

}  // namespace
}  // namespace lumigrove
