#include "scene/builtin/mesh_builder.h"

#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace lumigrove::builtin {

float sine(float radians) { return static_cast<float>(std::sin(static_cast<double>(radians))); }
float cosine(float radians) { return static_cast<float>(std::cos(static_cast<double>(radians))); }

namespace {

float fraction(int i, int n) { return static_cast<float>(i) / static_cast<float>(n); }

// Point `i` of `n` on the unit circle; i == n gives the very bits of i == 0, which keeps tubes watertight.
vec2 on_circle(int i, int n) {
  const double angle = 2 * 3.14159265358979323846 * (i % n) / n;
  return vec2(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)));
}

// Tangent of `part` of an eighth turn; exactly 1 at the end, where two faces of a rounded box meet.
float tangent(float part) { return part == 1 ? 1.0f : sine(part * kPi / 4) / cosine(part * kPi / 4); }

struct CrossSection {
  vec3 x, y;
};
CrossSection perpendicular(vec3 axis) {
  const vec3 helper = std::abs(axis.y) < 0.9f ? vec3(0, 1, 0) : vec3(1, 0, 0);
  const vec3 x = glm::normalize(glm::cross(helper, axis));
  return {x, glm::cross(axis, x)};
}

}  // namespace

std::uint32_t MeshBuilder::vertex(vec3 position, vec3 normal, vec2 uv) {
  mesh_.positions.push_back(vec3(to_mesh_ * vec4(position, 1)));
  mesh_.normals.push_back(glm::normalize(mat3(to_mesh_) * normal));
  mesh_.uv0.push_back(uv);
  return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
}

void MeshBuilder::quad(vec3 corner, vec3 u, vec3 v, int nu, int nv) {
  const vec3 normal = glm::normalize(glm::cross(u, v));
  const vec2 size(glm::length(u), glm::length(v));
  const std::uint32_t first = static_cast<std::uint32_t>(mesh_.positions.size());
  for (int j = 0; j <= nv; ++j)
    for (int i = 0; i <= nu; ++i) {
      const vec2 at(fraction(i, nu), fraction(j, nv));
      vertex(corner + at.x * u + at.y * v, normal, at * size);
    }
  const std::uint32_t row = static_cast<std::uint32_t>(nu) + 1;
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(nv); ++j)
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t a = first + j * row + i;
      triangle(a, a + 1, a + row + 1);
      triangle(a, a + row + 1, a + row);
    }
}

void MeshBuilder::flat_triangle(vec3 a, vec3 b, vec3 c) { polygon(std::array{a, b, c}); }

void MeshBuilder::polygon(std::span<const vec3> corners) {
  const vec3 normal = glm::normalize(glm::cross(corners[1] - corners[0], corners[2] - corners[0]));
  const CrossSection plane = perpendicular(normal);
  const std::uint32_t first = static_cast<std::uint32_t>(mesh_.positions.size());
  for (const vec3 p : corners) vertex(p, normal, vec2(glm::dot(p, plane.x), glm::dot(p, plane.y)));
  for (std::uint32_t i = 1; i + 1 < corners.size(); ++i) triangle(first, first + i, first + i + 1);
}

void MeshBuilder::box(vec3 lo, vec3 hi, unsigned faces) {
  const auto corner = [&](int x, int y, int z) {
    return vec3(x ? hi.x : lo.x, y ? hi.y : lo.y, z ? hi.z : lo.z);
  };
  const auto face = [&](vec3 normal, vec3 a, vec3 b, vec3 c, vec3 d) {
    const float u = glm::length(b - a), v = glm::length(d - a);
    const std::uint32_t first = vertex(a, normal, vec2(0));
    vertex(b, normal, vec2(u, 0));
    vertex(c, normal, vec2(u, v));
    vertex(d, normal, vec2(0, v));
    triangle(first, first + 1, first + 2);
    triangle(first, first + 2, first + 3);
  };
  if (faces & kLeft) face(vec3(-1, 0, 0), corner(0, 0, 0), corner(0, 0, 1), corner(0, 1, 1), corner(0, 1, 0));
  if (faces & kRight) face(vec3(1, 0, 0), corner(1, 0, 1), corner(1, 0, 0), corner(1, 1, 0), corner(1, 1, 1));
  if (faces & kBottom)
    face(vec3(0, -1, 0), corner(0, 0, 0), corner(1, 0, 0), corner(1, 0, 1), corner(0, 0, 1));
  if (faces & kTop) face(vec3(0, 1, 0), corner(0, 1, 1), corner(1, 1, 1), corner(1, 1, 0), corner(0, 1, 0));
  if (faces & kBack) face(vec3(0, 0, -1), corner(1, 0, 0), corner(0, 0, 0), corner(0, 1, 0), corner(1, 1, 0));
  if (faces & kFront) face(vec3(0, 0, 1), corner(0, 0, 1), corner(1, 0, 1), corner(1, 1, 1), corner(0, 1, 1));
}

void MeshBuilder::rounded_box(vec3 lo, vec3 hi, float radius, int steps) {
  // On each face a grid: `steps` rows of the low edge's rounding, the flat middle, `steps` of the high
  // edge's. A grid line is a corner of the inner box (0 low, 1 high) and a slope in [-1,1] that bends the
  // direction off it.
  struct Line {
    int side;
    float slope;
  };
  std::vector<Line> lines;
  for (int k = 0; k <= steps; ++k)
    lines.push_back({0, k == steps ? 0.0f : -tangent(fraction(steps - k, steps))});
  for (int k = 0; k <= steps; ++k) lines.push_back({1, k == 0 ? 0.0f : tangent(fraction(k, steps))});
  const vec3 inner[2] = {lo + radius, hi - radius};
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int u = (axis + (side ? 1 : 2)) % 3, v = (axis + (side ? 2 : 1)) % 3;  // u x v points outwards
      const std::uint32_t first = static_cast<std::uint32_t>(mesh_.positions.size());
      for (const Line& at_v : lines)
        for (const Line& at_u : lines) {
          vec3 corner, direction;
          corner[axis] = inner[side][axis];
          corner[u] = inner[at_u.side][u];
          corner[v] = inner[at_v.side][v];
          direction[axis] = side ? 1.0f : -1.0f;
          direction[u] = at_u.slope;
          direction[v] = at_v.slope;
          direction = glm::normalize(direction);
          const vec3 position = corner + radius * direction;
          vertex(position, direction, vec2(position[u] - lo[u], position[v] - lo[v]));
        }
      const std::uint32_t row = static_cast<std::uint32_t>(lines.size());
      for (std::uint32_t j = 0; j + 1 < row; ++j)
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
          const std::uint32_t a = first + j * row + i;
          triangle(a, a + 1, a + row + 1);
          triangle(a, a + row + 1, a + row);
        }
    }
}

void MeshBuilder::icosphere(vec3 centre, float radius, int subdivisions) {
  constexpr float g = 1.6180339887f;
  std::vector<vec3> points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                              {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<uvec3> faces = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                              {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                              {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                              {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (vec3& p : points) p = glm::normalize(p);
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, inserted] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (inserted) points.push_back(glm::normalize(points[at->first.first] + points[at->first.second]));
      return at->second;
    };
    std::vector<uvec3> finer;
    for (const uvec3 f : faces) {
      const std::uint32_t ab = middle(f.x, f.y), bc = middle(f.y, f.z), ca = middle(f.z, f.x);
      finer.insert(finer.end(), {{f.x, ab, ca}, {f.y, bc, ab}, {f.z, ca, bc}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  const std::uint32_t first = static_cast<std::uint32_t>(mesh_.positions.size());
  for (const vec3 p : points) vertex(centre + radius * p, p);
  for (const uvec3 f : faces) triangle(first + f.x, first + f.y, first + f.z);
}

void MeshBuilder::sphere(vec3 centre, float radius, int segments, int rings) {
  std::vector<vec2> profile;
  for (int i = 0; i <= rings; ++i) {
    const float angle = kPi * fraction(i, rings);
    profile.emplace_back(i == 0 || i == rings ? 0.0f : radius * sine(angle), -radius * cosine(angle));
  }
  lathe(centre, profile, segments, true);
}

void MeshBuilder::closed_tube(const std::function<vec3(float)>& curve, float radius, int segments,
                              int sides) {
  const std::uint32_t first = static_cast<std::uint32_t>(mesh_.positions.size());
  vec3 x = perpendicular(glm::normalize(curve(0.001f) - curve(-0.001f))).x;
  // Carry the section along the curve without twist, then spread what is missing at the end over the whole
  // length.
  std::vector<vec3> centres, xs, ys;
  for (int i = 0; i <= segments; ++i) {
    const float turn = fraction(i, segments);
    const vec3 axis = glm::normalize(curve(turn + 0.001f) - curve(turn - 0.001f));
    x = glm::normalize(x - axis * glm::dot(x, axis));
    centres.push_back(curve(turn));
    xs.push_back(x);
    ys.push_back(glm::cross(axis, x));
  }
  const float twist = std::atan2(glm::dot(xs.back(), ys.front()), glm::dot(xs.back(), xs.front()));
  for (int i = 0; i < segments; ++i) {
    const float angle = -twist * fraction(i, segments), c = cosine(angle), s = sine(angle);
    const vec3 px = c * xs[i] + s * ys[i], py = c * ys[i] - s * xs[i];
    for (int j = 0; j < sides; ++j) {
      const vec2 at = on_circle(j, sides);
      const vec3 normal = px * at.x + py * at.y;
      vertex(centres[i] + radius * normal, normal, vec2(fraction(i, segments), fraction(j, sides)));
    }
  }
  const auto at = [&](int i, int j) {
    return first + static_cast<std::uint32_t>((i % segments) * sides + j % sides);
  };
  for (int i = 0; i < segments; ++i)
    for (int j = 0; j < sides; ++j) {
      triangle(at(i, j), at(i + 1, j + 1), at(i + 1, j));
      triangle(at(i, j), at(i, j + 1), at(i + 1, j + 1));
    }
}

void MeshBuilder::cylinder(vec3 a, vec3 b, float ra, float rb, int sides, bool caps) {
  const vec3 axis = glm::normalize(b - a);
  const CrossSection section = perpendicular(axis);
  const float length = glm::length(b - a), slope = (ra - rb) / length;
  std::vector<vec3> low, high;
  const std::uint32_t first = static_cast<std::uint32_t>(mesh_.positions.size());
  for (int i = 0; i <= sides; ++i) {
    const vec2 at = on_circle(i, sides);
    const vec3 out = section.x * at.x + section.y * at.y, normal = out + slope * axis;
    low.push_back(a + ra * out);
    high.push_back(b + rb * out);
    const float around = 2 * kPi * ra * fraction(i, sides);
    vertex(low.back(), normal, vec2(around, 0));
    vertex(high.back(), normal, vec2(around, length));
  }
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(sides); ++i) {
    const std::uint32_t p = first + 2 * i;
    if (ra > 0) triangle(p, p + 2, p + 1);
    if (rb > 0) triangle(p + 1, p + 2, p + 3);
  }
  if (!caps) return;
  low.pop_back();
  high.pop_back();
  if (rb > 0) polygon(high);
  if (ra > 0) polygon(std::vector<vec3>(low.rbegin(), low.rend()));
}

void MeshBuilder::lathe(vec3 base, std::span<const vec2> profile, int sides, bool smooth) {
  const auto outward = [&](std::size_t from, std::size_t to) {
    const vec2 d = profile[to] - profile[from];
    return glm::normalize(vec2(d.y, -d.x));  // right of the way up
  };
  const auto ring = [&](std::size_t k, vec2 normal) {
    const std::uint32_t first = static_cast<std::uint32_t>(mesh_.positions.size());
    for (int i = 0; i <= sides; ++i) {
      const vec2 at = on_circle(i, sides);
      vertex(base + vec3(profile[k].x * at.y, profile[k].y, profile[k].x * at.x),
             vec3(normal.x * at.y, normal.y, normal.x * at.x), vec2(fraction(i, sides), profile[k].y));
    }
    return first;
  };
  const auto smooth_normal = [&](std::size_t k) {
    const std::size_t last = profile.size() - 1;
    if (profile[k].x == 0) return vec2(0, k == 0 ? -1 : 1);
    if (k == 0) return outward(0, 1);
    if (k == last) return outward(last - 1, last);
    return glm::normalize(outward(k - 1, k) + outward(k, k + 1));
  };
  std::uint32_t low = smooth ? ring(0, smooth_normal(0)) : 0;
  for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
    if (!smooth) low = ring(k, outward(k, k + 1));
    const std::uint32_t high = ring(k + 1, smooth ? smooth_normal(k + 1) : outward(k, k + 1));
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(sides); ++i) {
      if (profile[k].x > 0) triangle(low + i, low + i + 1, high + i + 1);
      if (profile[k + 1].x > 0) triangle(low + i, high + i + 1, high + i);
    }
    low = high;
  }
}

void MeshBuilder::sheet(const std::function<vec3(float, float)>& surface, int ns, int nt, vec2 uv_scale) {
  const std::uint32_t first = static_cast<std::uint32_t>(mesh_.positions.size());
  const float ds = 0.5f / static_cast<float>(ns), dt = 0.5f / static_cast<float>(nt);
  for (int j = 0; j <= nt; ++j)
    for (int i = 0; i <= ns; ++i) {
      const float s = fraction(i, ns), t = fraction(j, nt);
      const vec3 along_s = surface(s + ds, t) - surface(s - ds, t),
                 along_t = surface(s, t + dt) - surface(s, t - dt);
      vertex(surface(s, t), glm::cross(along_s, along_t), vec2(s, t) * uv_scale);
    }
  const std::uint32_t row = static_cast<std::uint32_t>(ns) + 1;
  for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(nt); ++j)
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t a = first + j * row + i;
      triangle(a, a + 1, a + row + 1);
      triangle(a, a + row + 1, a + row);
    }
}

Mesh MeshBuilder::take(std::string name, int material) {
  mesh_.name = std::move(name);
  mesh_.material = material;
  return std::exchange(mesh_, Mesh{});
}

}  // namespace lumigrove::builtin
