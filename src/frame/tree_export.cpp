#include "frame/tree_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "image/difference.h"
#include "methods/substitute_tree/substitute_tree_statistics.h"

namespace lumigrove {
namespace {

// --- JSON --------------------------------------------------------------------------------------------------

void append(std::string& text, vec3 v) { fmt::format_to(std::back_inserter(text), "{},{},{}", v.x, v.y, v.z); }

void append_node(std::string& text, const SubstituteTreeView& tree, const VisitedNode& node) {
  const Distribution& d = tree.distributions[node.number];
  const PrincipalAxes axes = principal_axes(d);
  fmt::format_to(std::back_inserter(text), "[{},{},{},{},{},", node.number, node.level, node.first, node.last,
                 tree.nodes[node.number].split());
  append(text, node.box.lo);
  text += ',';
  append(text, node.box.hi);
  text += ',';
  append(text, d.mean);
  text += ',';
  append(text, d.normal);
  fmt::format_to(std::back_inserter(text), ",{},{},{},", axes.sigma[0], axes.sigma[1], axes.sigma[2]);
  append(text, axes.axis[0]);
  fmt::format_to(std::back_inserter(text), ",{},", d.nu);
  append(text, d.intensity);
  fmt::format_to(std::back_inserter(text), ",{},{}]", node.usable ? 1 : 0, node.is_substitute() ? 1 : 0);
}

// --- glTF --------------------------------------------------------------------------------------------------

// In units of the scene's diagonal.
constexpr float kBarRadius = 3e-4f, kDiscRadius = 1.5e-3f, kDiscOffset = 2e-4f;

void add_triangle(Mesh& mesh, std::uint32_t base, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  mesh.triangles.push_back(uvec3(base + a, base + b, base + c));
}

// A three-sided bar without ends.
void add_bar(Mesh& mesh, vec3 a, vec3 b, float radius, vec4 colour) {
  const float length = glm::length(b - a);
  if (!(length > 1e-3f * radius)) return;
  const Frame frame = make_frame((b - a) / length);
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  for (const vec3 end : {a, b})
    for (int k = 0; k < 3; ++k) {
      const float phi = 2 * kPi * static_cast<float>(k) / 3;
      mesh.positions.push_back(end + (frame.x * std::cos(phi) + frame.y * std::sin(phi)) * radius);
      mesh.colors.push_back(colour);
    }
  for (std::uint32_t k = 0; k < 3; ++k) {
    const std::uint32_t next = (k + 1) % 3;
    add_triangle(mesh, base, k, next, next + 3);
    add_triangle(mesh, base, k, next + 3, k + 3);
  }
}

void add_box(Mesh& mesh, const Box3& box, float radius, vec4 colour) {
  const auto corner = [&](int k) {
    return vec3((k & 1) != 0 ? box.hi.x : box.lo.x, (k & 2) != 0 ? box.hi.y : box.lo.y,
                (k & 4) != 0 ? box.hi.z : box.lo.z);
  };
  for (int k = 0; k < 8; ++k)
    for (const int bit : {1, 2, 4})
      if ((k & bit) == 0) add_bar(mesh, corner(k), corner(k | bit), radius, colour);
}

void add_disc(Mesh& mesh, const Vpl& vpl, float radius, float offset) {
  constexpr int kCorners = 6;
  const Frame frame = make_frame(vpl.normal);
  const vec4 colour(vpl.intensity / max_component(vpl.intensity), 1);
  const auto base = static_cast<std::uint32_t>(mesh.positions.size());
  for (int k = 0; k < kCorners; ++k) {
    const float phi = 2 * kPi * static_cast<float>(k) / kCorners;
    mesh.positions.push_back(vpl.position + vpl.normal * offset +
                             (frame.x * std::cos(phi) + frame.y * std::sin(phi)) * radius);
    mesh.colors.push_back(colour);
  }
  for (std::uint32_t k = 1; k + 1 < kCorners; ++k) add_triangle(mesh, base, 0, k, k + 1);
}

struct ShownBox {
  float intensity;
  int level;
  Box3 box;
};

std::vector<ShownBox> substitute_boxes(const SubstituteTreeView& tree) {
  std::vector<ShownBox> boxes;
  for_each_inner_node(tree, [&](const VisitedNode& node) {
    if (node.is_substitute())
      boxes.push_back({luminance(tree.distributions[node.number].intensity), node.level, node.box});
  });
  return boxes;
}

void add_mesh(Scene& scene, Mesh mesh) {
  if (mesh.triangles.empty()) return;
  Material material;
  material.name = mesh.name;
  material.base_color = vec3(1);
  material.double_sided = true;
  mesh.material = static_cast<int>(scene.materials.size());
  scene.materials.push_back(material);
  Node node;
  node.name = mesh.name;
  node.meshes = {static_cast<int>(scene.meshes.size())};
  scene.nodes.push_back(node);
  scene.meshes.push_back(std::move(mesh));
}

void add_camera(Scene& scene, const CameraInstance& camera) {
  Node node;
  node.name = "camera";
  node.has_matrix = true;
  node.matrix = mat4(vec4(camera.right, 0), vec4(camera.up, 0), vec4(-camera.forward, 0), vec4(camera.position, 1));
  node.camera = 0;
  scene.cameras.push_back(camera.camera);
  scene.nodes.push_back(node);
}

}  // namespace

std::string tree_json(const World& world) {
  const SubstituteTreeView tree = world.substitutes.view();
  std::string text = fmt::format(
      "{{\"format\":\"lumigrove substitute tree 1\",\n\"units\":\"metres, W/sr\",\n"
      "\"lights\":{},\n\"root_usable\":{},\n",
      tree.count, tree.root_usable);
  text +=
      "\"node_columns\":[\"node\",\"level\",\"first_leaf\",\"last_leaf\",\"split\",\"lo_x\",\"lo_y\",\"lo_z\","
      "\"hi_x\",\"hi_y\",\"hi_z\",\"mean_x\",\"mean_y\",\"mean_z\",\"normal_x\",\"normal_y\",\"normal_z\","
      "\"sigma_major\",\"sigma_minor\",\"sigma_normal\",\"major_x\",\"major_y\",\"major_z\",\"nu\",\"intensity_r\","
      "\"intensity_g\",\"intensity_b\",\"usable\",\"substitute\"],\n\"nodes\":[";
  bool first = true;
  for_each_inner_node(tree, [&](const VisitedNode& node) {
    text += first ? "\n" : ",\n";
    first = false;
    append_node(text, tree, node);
  });
  text +=
      "],\n\"leaf_columns\":[\"x\",\"y\",\"z\",\"normal_x\",\"normal_y\",\"normal_z\",\"intensity_r\","
      "\"intensity_g\",\"intensity_b\"],\n\"leaves\":[";
  for (std::uint32_t i = 0; i < tree.count; ++i) {
    const Vpl& vpl = tree.leaf(i);
    text += i > 0 ? ",\n[" : "\n[";
    append(text, vpl.position);
    text += ',';
    append(text, vpl.normal);
    text += ',';
    append(text, vpl.intensity);
    text += ']';
  }
  return text + "]}\n";
}

Scene tree_scene(const World& world, std::size_t most_boxes, TreeSceneParts& parts) {
  const SubstituteTreeView tree = world.substitutes.view();
  const float d = world.geometry->state.diagonal;
  std::vector<ShownBox> boxes = substitute_boxes(tree);
  parts = {std::min(boxes.size(), most_boxes), boxes.size(), tree.count};
  std::stable_sort(boxes.begin(), boxes.end(),
                   [](const ShownBox& a, const ShownBox& b) { return a.intensity > b.intensity; });
  boxes.resize(parts.boxes);
  int deepest = 1;
  for (const ShownBox& box : boxes) deepest = std::max(deepest, box.level);

  Mesh bars, discs;
  bars.name = "boxes of substitutes";
  discs.name = "virtual point lights";
  for (const ShownBox& box : boxes) {
    const float depth = static_cast<float>(box.level) / static_cast<float>(deepest);
    add_box(bars, box.box, kBarRadius * d, vec4(magma(0.9f - 0.6f * depth), 1));
  }
  for (std::uint32_t i = 0; i < tree.count; ++i) add_disc(discs, tree.leaf(i), kDiscRadius * d, kDiscOffset * d);

  Scene scene;
  scene.name = "substitute tree";
  add_mesh(scene, std::move(bars));
  add_mesh(scene, std::move(discs));
  add_camera(scene, world.camera);
  scene.environment.radiance = vec3(1);  // shows the colours as they are
  validate(scene);
  return scene;
}

}  // namespace lumigrove
