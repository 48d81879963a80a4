// Method      Holds samplers of lights to their word, at points of a scene: whether lights are drawn as often as is
//             claimed, whether every light that shines at a point can be drawn there, whether the mean of the estimates is
//             the sum over all lights. Nothing is ever in the way: visibility is not the samplers' business.
// Paper       none of its own. K. Pearson, 1900, for the chi-square; S. Bernstein, 1924, for the bound of means; Z. Sidak,
//             "Rectangular Confidence Regions", JASA 62, 1967, for many tests at once. K. Subr, J. Arvo, "Statistical
//             Hypothesis Testing for Assessing Monte Carlo Estimators", Pacific Graphics 2007, for the idea.
// Symbols     f_l -> LightMoments -> Y of the unoccluded radiance that light l sends to the viewer by way of the point: its
//             mean over points of the light, and the mean of its square; S = sum f_l
//             c_l -> claimed -> how often one estimate draws l: SamplerAtPoint::pdf times the draws of each part
//             n, N -> draws of an estimate; estimates
//             V = sum E[f_l^2] / c_l - S^2 / n -> variance of an estimate, if the claims are true
//             alpha -> AuditOptions::significance -> probability that any test of the whole audit fails an honest sampler
// Equations   frequencies against N p: chi-square, cells pooled until each expects 20 draws, p-value by the chi-square
//             distribution. Draws in strata vary less than it says, so that the test is then on the safe side
//             f_l > 0 => c_l > 0, for every light: no statistics
//             |mean - S| : Bernstein's bound for V, or for the estimates' own variance where that is greater, and for the
//             largest possible f_l / c_l. Rare bright lights, which a z-test would take for bias, fail nobody
// Departures  p-values are corrected for the number of tests in the audit (Sidak).
// Estimator   S is the sum over stratified points of every light, more of them on lights nearby; its own error, from
//             E[f_l^2], is part of V.
// In -> Out   sampler, points -> AuditRow; all rows -> judge() -> verdicts and sentences
// Oracle      tests/audit_test.cpp: liars are caught by name, honest samplers pass.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "scene/surface.h"

namespace lumigrove {

struct AuditPoint {
  Surface surface;
  bool seen = false;  // by the camera; otherwise strewn over the surfaces
};

struct LightMoments {
  float mean = 0, square = 0, most = 0;
  float variance_of_mean = 0;  // of `mean`, which is known from some points of the light
};

// A sampler at one point. Its cells are what a draw can end at: lights, or whatever stands for several.
struct SamplerAtPoint {
  std::vector<double> parts;  // how often an estimate draws from each part: below each node of a cut, or just one part
  std::function<void(std::size_t part, std::uint32_t seed, std::span<std::uint32_t> cells)> draw;  // kNoCell: nothing
  std::function<void(std::size_t part, std::span<double> cells)> pdf;  // the claim, for every cell; starts as 0
  std::function<std::vector<double>(int count, std::uint32_t seed)> estimate;  // at least `count`, independent
  double work = 1;  // light samples that making one estimate takes
};
inline constexpr std::uint32_t kNoCell = 0xffffffffu;

// What a light is to the people who made the scene.
struct LightName {
  std::string kind = {};                     // triangle, point light, ..., environment, virtual point light
  std::string node = {}, mesh = {}, material = {}, light = {};  // names, where there are any
  std::uint32_t triangle = kNoCell;          // of the mesh
  std::uint32_t stable_id = kNoCell;         // as in the image layer `emitter`
  std::string text() const;
};

struct AuditedSampler {
  std::string name;
  std::string word;      // a sentence about what is not held against it; empty: nothing
  bool unbiased = true;  // is that its word?
  std::uint32_t lights = 0, cells = 0;
  std::function<SamplerAtPoint(const AuditPoint&, std::uint32_t number)> at;
  std::function<std::vector<LightMoments>(const AuditPoint&, std::uint32_t number)> light;
  // How often each light is drawn or stood for, from how often each cell is; empty: cells are lights.
  std::function<std::vector<double>(const std::vector<double>& cells)> of_lights;
  std::function<LightName(std::uint32_t light)> describe;
  std::function<LightName(std::uint32_t cell)> describe_cell;  // empty: as lights
};

struct AuditOptions {
  int draws = 32768;           // at each point
  std::uint32_t seed = 0;
  double significance = 1e-3;  // of the audit as a whole
};

// A light that shines at some point and is not drawn there.
struct MissedLight {
  std::uint32_t light = 0;
  LightName name;
  std::uint32_t points = 0, point = 0;  // how many; the one where it matters most
  double share = 0;                     // of all light there
};

// The worst of a kind of test.
struct WorstTest {
  double p = 1, corrected = 1;  // corrected: for all tests of the audit
  std::uint32_t point = 0;
  std::string what;             // in words
};

struct AuditRow {
  std::string name, word;
  bool unbiased = true;
  std::uint32_t lights = 0, points = 0;  // points: that any light shines at
  std::uint64_t draws = 0, estimates = 0;
  std::size_t tests = 0;
  WorstTest frequencies, mean;
  std::uint32_t missed_count = 0;
  std::vector<MissedLight> missed;  // the first kNamedLights
  double mean_ratio = 1, z = 0;     // over all points, those of less variance counting more
  std::vector<std::uint8_t> reached;  // by light: does it shine at any point?
  std::vector<std::string> failures;  // by judge(): sentences
  bool holds() const { return failures.empty(); }
};
inline constexpr std::size_t kNamedLights = 10;

// Raw p-values; nothing is judged yet.
AuditRow audit_sampler(const AuditedSampler& sampler, std::span<const AuditPoint> points, const AuditOptions& options);

// Corrects the p-values for the tests of all rows, and writes a sentence for each broken claim.
void judge(std::span<AuditRow> rows, std::span<const AuditPoint> points, const AuditOptions& options);

// "(1, 2, 3), seen by the camera"
std::string point_text(const AuditPoint& point);

}  // namespace lumigrove
