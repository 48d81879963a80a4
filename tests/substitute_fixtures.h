// Sets of virtual point lights made by hand, the substitute tree over them, and points to walk it for.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "light_fixtures.h"
#include "methods/substitute_tree/substitute_tree.h"
#include "methods/substitute_tree/substitute_walk_kernel.h"

namespace lumigrove::testing {

inline Vpl vpl_at(vec3 position, vec3 normal, float intensity) {
  return {position, 1e-4f, normal, vec3(0.7f, 1, 1.3f) * intensity};
}

struct NamedVpls {
  std::string name;
  std::vector<Vpl> vpls;
};

inline NamedVpls flat_plane(int n) {  // y = 2, shines down
  NamedVpls set{"plane of " + std::to_string(n), {}};
  Stream random(31);
  for (int i = 0; i < n; ++i) {
    const vec3 p = random.in_box(vec3(-4, 2, -4), vec3(4, 2, 4));
    set.vpls.push_back(vpl_at(p, vec3(0, -1, 0), 0.5f + random.next().x));
  }
  return set;
}

inline NamedVpls cloud(int n, std::uint32_t seed = 32) {
  NamedVpls set{"cloud of " + std::to_string(n), {}};
  Stream random(seed);
  for (int i = 0; i < n; ++i) {
    const vec3 p = random.in_box(vec3(-5), vec3(5));
    set.vpls.push_back(vpl_at(p, random.direction(), 0.01f + random.next().x));
  }
  return set;
}

inline NamedVpls two_walls(int n) {  // x = -3 and x = 4, facing each other
  NamedVpls set{"two walls of " + std::to_string(n), {}};
  Stream random(33);
  for (int i = 0; i < n; ++i) {
    const bool left = i % 2 == 0;
    const vec3 p = random.in_box(vec3(left ? -3 : 4, -2, -2), vec3(left ? -3 : 4, 2, 2));
    set.vpls.push_back(vpl_at(p, vec3(left ? 1 : -1, 0, 0), 1));
  }
  return set;
}

inline NamedVpls coincident(int n) {  // one place, three normals
  NamedVpls set{"coincident " + std::to_string(n), {}};
  const vec3 normals[3] = {vec3(0, -1, 0), vec3(0.6f, -0.8f, 0), vec3(0, 0, 1)};
  for (int i = 0; i < n; ++i) set.vpls.push_back(vpl_at(vec3(1, 2, -1), normals[i % 3], 1));
  return set;
}

inline NamedVpls one_bright(int n) {
  NamedVpls set = cloud(n, 34);
  set.name = "one bright among " + std::to_string(n);
  set.vpls[static_cast<std::size_t>(n) / 3].intensity *= 1e4f;
  return set;
}

inline std::vector<NamedVpls> vpl_sets() {
  std::vector<NamedVpls> sets{flat_plane(120), cloud(150), two_walls(100), coincident(20), one_bright(90)};
  for (const int n : {1, 2, 3}) sets.push_back(cloud(n));
  return sets;
}

// Lights and a tree over them.
class VplTree {
 public:
  explicit VplTree(std::vector<Vpl> vpls, Topology topology = Topology::kRadix,
                   SubstituteTree::Options options = {Topology::kRadix, 0.5f, 0.3f, kInfinity})
      : vpls_(std::move(vpls)) {
    for (const Vpl& vpl : vpls_) bounds_ = unite(bounds_, vpl.position);
    options.topology = topology;
    tree_.build(lights(), options);
  }
  VplTree(const VplTree&) = delete;
  VplTree& operator=(const VplTree&) = delete;

  VplView lights() const { return {vpls_, bounds_, 10}; }
  SubstituteTreeView view() const { return tree_.view(); }
  SubstituteWalk walk(Weights weight, bool cones = false, bool substitutes = false) const {
    return {tree_.view(), weight, 0.01f, cones, substitutes, 4};
  }

 private:
  std::vector<Vpl> vpls_;
  Box3 bounds_;
  SubstituteTree tree_;
};

inline Surface glossy_surface(vec3 position, vec3 normal, vec3 wo, float roughness) {
  Surface s = surface_at(position, normal);
  s.wo = glm::normalize(glm::dot(wo, normal) < 0 ? -wo : wo);
  s.diffuse = vec3(0.5f);
  s.specular = vec3(0.3f);
  s.roughness = roughness;
  return s;
}

// Points in, near and far from the lights above: above, below and on their planes, in their very places.
inline std::vector<Surface> walk_surfaces(int n, std::uint32_t seed = 41) {
  std::vector<Surface> surfaces;
  Stream random(seed);
  for (int i = 0; i < n; ++i) {
    vec3 p = random.in_box(vec3(-6), vec3(6));
    vec3 normal = random.direction();
    switch (i % 6) {
      case 0: p = random.in_box(vec3(-3, 0, -3), vec3(3, 0.5f, 3)); normal = vec3(0, 1, 0); break;
      case 1: p.y = 2; break;                          // in the plane of lights, any normal
      case 2: p.y = 2; normal = vec3(1, 0, 0); break;  // the plane of lights is at the horizon's normal
      case 3: p = vec3(1, 2, -1) + normal * (i % 12 == 3 ? 0.0f : 0.02f); break;
      case 4: p *= 20.0f; break;
      default: break;
    }
    const float roughness[3] = {0.08f, 0.3f, 0.9f};
    surfaces.push_back(glossy_surface(p, normal, random.direction(), roughness[i % 3]));
  }
  return surfaces;
}

}  // namespace lumigrove::testing
