// Triangle meshes from simple solids, for the procedural scenes. Lengths in metres; triangles wind
// counter-clockwise seen from the side they face, which is also the side that emits.
#pragma once

#include <functional>
#include <span>

#include "lumigrove/scene.h"

namespace lumigrove::builtin {

// Sine and cosine rounded from double precision, so that meshes do not depend on the C library's float
// versions.
float sine(float radians);
float cosine(float radians);

// Faces of a box, to leave hidden ones out.
enum BoxFace : unsigned {
  kLeft = 1,
  kRight = 2,
  kBottom = 4,
  kTop = 8,
  kBack = 16,
  kFront = 32,  // -x +x -y +y -z +z
  kSides = kLeft | kRight | kBack | kFront,
  kAllFaces = 63
};

// Grows one mesh, solid by solid. Flat solids get their face normals and uv in metres; round ones smooth
// normals.
class MeshBuilder {
 public:
  // Every vertex added from now on is mapped by this rigid map (rotation, translation, uniform scale).
  void set_transform(const mat4& to_mesh) { to_mesh_ = to_mesh; }

  std::uint32_t vertex(vec3 position, vec3 normal, vec2 uv = vec2(0));
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) { mesh_.triangles.emplace_back(a, b, c); }

  // Parallelogram `corner`, `corner+u`, `corner+v`; faces cross(u,v); cut into nu x nv cells.
  void quad(vec3 corner, vec3 u, vec3 v, int nu = 1, int nv = 1);
  void flat_triangle(vec3 a, vec3 b, vec3 c);
  // Convex polygon with its corners counter-clockwise.
  void polygon(std::span<const vec3> corners);
  void box(vec3 lo, vec3 hi, unsigned faces = kAllFaces);

  // Box with rounded edges and corners, `steps` cuts a quarter turn; closed.
  void rounded_box(vec3 lo, vec3 hi, float radius, int steps);

  // Regular icosahedron, each face cut into 4^subdivisions; closed.
  void icosphere(vec3 centre, float radius, int subdivisions);
  // 2 * segments * (rings - 1) triangles; closed.
  void sphere(vec3 centre, float radius, int segments, int rings);
  // Tube of circular section around the closed curve; 2 * segments * sides triangles; closed.
  void closed_tube(const std::function<vec3(float turn)>& curve, float radius, int segments, int sides);
  // Tube from `a` to `b`, radius `ra` to `rb`; with caps it is closed.
  void cylinder(vec3 a, vec3 b, float ra, float rb, int sides, bool caps = true);
  // Surface of revolution about +Y through the points (radius, height), from the lowest up, facing outwards.
  // `smooth` blends normals along the profile; points of radius 0 close it.
  void lathe(vec3 base, std::span<const vec2> profile, int sides, bool smooth);
  // Height field or any sheet: `surface(s,t)` over the unit square, facing cross(d/ds, d/dt); smooth normals
  // by differences, uv = (s,t) * uv_scale.
  void sheet(const std::function<vec3(float s, float t)>& surface, int ns, int nt, vec2 uv_scale = vec2(1));

  std::size_t triangle_count() const { return mesh_.triangles.size(); }
  bool empty() const { return mesh_.triangles.empty(); }

  // The mesh so far; the builder is empty afterwards.
  Mesh take(std::string name, int material);

 private:
  Mesh mesh_;
  mat4 to_mesh_ = mat4(1);
};

}  // namespace lumigrove::builtin
