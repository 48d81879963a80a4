// Cones of normals in four bytes, as nodes of light trees store them.
#pragma once

#include <cstdint>

#include "base/vec.h"

namespace lumigrove {

inline constexpr float kConeAxis = 127, kConeRadius = 255;

// Directions n' with |n' - axis()| <= width(). The default one holds all directions.
struct PackedCone {
  std::int8_t x = 0, y = 0, z = 0;
  std::uint8_t radius = 255;

  LUMI_HD vec3 axis() const { return vec3(x, y, z) * (1 / kConeAxis); }
  LUMI_HD float width() const { return static_cast<float>(radius) * (2 / kConeRadius); }
};

// |axis| <= 1. Stored to within kPackedAxisError, so `radius` is to be measured from PackedCone::axis(), or that much
// larger.
inline constexpr float kPackedAxisError = 0.8661f / kConeAxis;  // half a unit in each of three components
LUMI_HD inline PackedCone pack_axis(vec3 axis) {
  const auto pack = [](float v) { return static_cast<std::int8_t>(v * kConeAxis + (v < 0 ? -0.5f : 0.5f)); };
  return {pack(axis.x), pack(axis.y), pack(axis.z), 0};
}

// Rounded up, with enough for the roundings of a walk's dot products.
LUMI_HD inline std::uint8_t pack_radius(float radius) {
  return static_cast<std::uint8_t>(glm::clamp(glm::ceil((radius + 1e-4f) * (0.5f * kConeRadius)), 0.0f, kConeRadius));
}

// Holds one normal.
LUMI_HD inline PackedCone pack_normal(vec3 normal) {
  PackedCone cone = pack_axis(normal);
  cone.radius = pack_radius(glm::length(normal - cone.axis()));
  return cone;
}

// Holds both. Never larger than the larger one when that holds the other, so that many cones of nearly flat surfaces
// unite without growing by roundings.
LUMI_HD inline PackedCone unite(PackedCone a, PackedCone b) {
  constexpr float kUnit = 0.5f * kConeRadius / kConeAxis;  // a step of an axis in steps of the radius
  const vec3 p(a.x, a.y, a.z), q(b.x, b.y, b.z);
  const float apart = glm::length(p - q) * (kUnit * (1 + 1e-6f)), ra = a.radius, rb = b.radius;
  if (ra >= rb + apart) return a;
  if (rb >= ra + apart) return b;
  const vec3 sum = p + q;
  const float length = glm::length(sum);
  PackedCone both = pack_axis(length > 0.5f ? sum / length : vec3(0));
  const vec3 c(both.x, both.y, both.z);
  const float radius = glm::max(ra + glm::length(p - c) * kUnit, rb + glm::length(q - c) * kUnit);
  if (!(radius + 1e-3f < kConeRadius)) return {};
  both.radius = static_cast<std::uint8_t>(glm::ceil(radius + 1e-3f));
  return both;
}

}  // namespace lumigrove
