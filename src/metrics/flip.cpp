// Method      FLIP: the difference that a viewer sees when two images alternate at the same place, a value in
// [0,1]
//             for every pixel.
// Paper       P. Andersson, J. Nilsson, T. Akenine-Moller, M. Oskarsson, K. Astrom, M. D. Fairchild, "FLIP: A
//             Difference Evaluator for Alternating Images", Proc. ACM Comput. Graph. Interact. Tech. 3(2),
//             2020.
// Symbols     p    -> pixels_per_degree   of the viewer's visual angle
//             q_c  -> kColorExponent      p_c, p_t -> kKnee, kKneeError   (colour pipeline)
//             w    -> kFeatureWidth       degrees, peak to trough of the detectors;  q_f -> kFeatureExponent
//             dE_c -> color_difference    dE_f -> feature_difference
// Departures  Two-dimensional filters are applied as products of one-dimensional ones, which they are
// (blue-yellow: a
//             sum of two); the RGB to XYZ matrix is derived from the sRGB primaries and D65.
#include <algorithm>
#include <array>
#include <cmath>

#include "base/srgb.h"
#include "device/device.h"
#include "metrics/check.h"
#include "metrics/plane.h"

namespace lumigrove {
namespace {

constexpr float kColorExponent = 0.7f, kKnee = 0.4f, kKneeError = 0.95f;
constexpr double kFeatureWidth = 0.082;
constexpr float kFeatureExponent = 0.5f;

// --- colour spaces
// ----------------------------------------------------------------------------------------------

// Linear RGB <-> XYZ relative to white (X = Y = Z = 1 for R = G = B = 1).
struct ColorSpace {
  mat3 to_xyz, to_rgb;
};

// From the chromaticities of the sRGB primaries and of D65 (IEC 61966-2-1).
ColorSpace make_color_space() {
  const auto xyz = [](double x, double y) { return glm::dvec3(x / y, 1, (1 - x - y) / y); };
  const glm::dmat3 primaries(xyz(0.64, 0.33), xyz(0.30, 0.60), xyz(0.15, 0.06));
  const glm::dvec3 white = xyz(0.3127, 0.3290);
  const glm::dvec3 amounts = glm::inverse(primaries) * white;
  glm::dmat3 to_xyz(primaries[0] * amounts[0], primaries[1] * amounts[1], primaries[2] * amounts[2]);
  for (int column = 0; column < 3; ++column) to_xyz[column] /= white;
  return {mat3(to_xyz), mat3(glm::inverse(to_xyz))};
}

// The paper's opponent space: Y achromatic, Cx red-green, Cz blue-yellow; linear in XYZ.
vec3 xyz_to_ycxcz(vec3 xyz) { return vec3(116 * xyz.y - 16, 500 * (xyz.x - xyz.y), 200 * (xyz.y - xyz.z)); }
vec3 ycxcz_to_xyz(vec3 c) {
  const float y = (c.x + 16) / 116;
  return vec3(y + c.y / 500, y, y - c.z / 200);
}

// CIE 1976 L*a*b*.
float lab_curve(float t) {
  constexpr float kDelta = 6.0f / 29;
  return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0f / 29;
}
vec3 xyz_to_lab(vec3 xyz) {
  const float x = lab_curve(xyz.x), y = lab_curve(xyz.y), z = lab_curve(xyz.z);
  return vec3(116 * y - 16, 500 * (x - y), 200 * (y - z));
}

// Colourfulness grows with luminance (Hunt effect).
vec3 hunt_lab(vec3 lab) { return vec3(lab.x, 0.01f * lab.x * lab.y, 0.01f * lab.x * lab.z); }

// HyAB: city-block in lightness, Euclidean in chroma.
float hyab(vec3 a, vec3 b) { return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z); }

// --- colour pipeline
// --------------------------------------------------------------------------------------------

using Opponent = std::array<Plane, 3>;  // Y, Cx, Cz

Opponent to_opponent(const RgbImage& image, const ColorSpace& space) {
  Opponent planes{Plane(image.width, image.height), Plane(image.width, image.height),
                  Plane(image.width, image.height)};
  launch(planes[0].size(), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    const auto linear = [&](std::size_t c) {
      return srgb_to_linear(std::clamp(image.rgb[3 * at + c], 0.0f, 1.0f));
    };
    const vec3 c = xyz_to_ycxcz(space.to_xyz * vec3(linear(0), linear(1), linear(2)));
    planes[0].values[at] = c.x;
    planes[1].values[at] = c.y;
    planes[2].values[at] = c.z;
  });
  return planes;
}

// One term a * sqrt(pi/b) * exp(-pi^2 x^2 / b), x in degrees, of a contrast sensitivity function in image
// space.
struct CsfTerm {
  double a, b;
};
constexpr CsfTerm kAchromatic{1, 0.0047}, kRedGreen{1, 0.0053},
    kBlueYellow[2] = {{34.1, 0.04}, {13.5, 0.025}};

// Three standard deviations of the widest term, for all channels.
int csf_radius(double pixels_per_degree) {
  const double sigma = std::sqrt(kBlueYellow[0].b / (2 * kPi * kPi));
  return static_cast<int>(std::ceil(3 * sigma * pixels_per_degree));
}

std::vector<double> csf_kernel(const CsfTerm& term, double pixels_per_degree) {
  const double sigma = std::sqrt(term.b / 2) / kPi * pixels_per_degree;
  return gaussian(sigma, csf_radius(pixels_per_degree));
}

Plane filter_csf(const Plane& plane, const CsfTerm& term, double pixels_per_degree) {
  const std::vector<float> kernel = normalized<float>(csf_kernel(term, pixels_per_degree));
  return filter_separable(plane, kernel, kernel);
}

// Sum of the term over the two-dimensional window: its share of the filter.
double csf_weight(const CsfTerm& term, double pixels_per_degree) {
  double sum = 0;
  for (double weight : csf_kernel(term, pixels_per_degree)) sum += weight;
  return term.a * std::sqrt(kPi / term.b) * sum * sum;
}

Plane filter_blue_yellow(const Plane& plane, double pixels_per_degree) {
  Plane wide = filter_csf(plane, kBlueYellow[0], pixels_per_degree);
  const Plane narrow = filter_csf(plane, kBlueYellow[1], pixels_per_degree);
  const double wide_weight = csf_weight(kBlueYellow[0], pixels_per_degree);
  const double narrow_weight = csf_weight(kBlueYellow[1], pixels_per_degree);
  const float share = static_cast<float>(wide_weight / (wide_weight + narrow_weight));
  launch(wide.size(), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    wide.values[at] = share * wide.values[at] + (1 - share) * narrow.values[at];
  });
  return wide;
}

Opponent filter_contrast(const Opponent& planes, double pixels_per_degree) {
  return {filter_csf(planes[0], kAchromatic, pixels_per_degree),
          filter_csf(planes[1], kRedGreen, pixels_per_degree),
          filter_blue_yellow(planes[2], pixels_per_degree)};
}

// Filtered colour, clamped to what a display shows, in the space where HyAB measures.
vec3 perceived(const Opponent& planes, std::size_t at, const ColorSpace& space) {
  const vec3 c(planes[0].values[at], planes[1].values[at], planes[2].values[at]);
  const vec3 rgb = glm::clamp(space.to_rgb * ycxcz_to_xyz(c), vec3(0), vec3(1));
  return hunt_lab(xyz_to_lab(space.to_xyz * rgb));
}

// The largest HyAB distance between colours of the display is that of green and blue.
float largest_difference(const ColorSpace& space) {
  const vec3 green = hunt_lab(xyz_to_lab(space.to_xyz * vec3(0, 1, 0)));
  const vec3 blue = hunt_lab(xyz_to_lab(space.to_xyz * vec3(0, 0, 1)));
  return std::pow(hyab(green, blue), kColorExponent);
}

// Compresses large differences: [0, kKnee * largest] maps to [0, kKneeError], the rest to [kKneeError, 1].
float color_difference(float distance, float largest) {
  const float powered = std::pow(distance, kColorExponent), knee = kKnee * largest;
  if (powered < knee) return kKneeError / knee * powered;
  return std::min(1.0f, kKneeError + (powered - knee) / (largest - knee) * (1 - kKneeError));
}

// --- feature pipeline
// -------------------------------------------------------------------------------------------

// Positive weights sum to 1 and negative ones to -1.
std::vector<float> balanced(const std::vector<double>& kernel) {
  double positive = 0, negative = 0;
  for (double weight : kernel) (weight > 0 ? positive : negative) += std::abs(weight);
  std::vector<float> result;
  for (double weight : kernel)
    result.push_back(static_cast<float>(weight / (weight > 0 ? positive : negative)));
  return result;
}

struct FeatureKernels {
  std::vector<float> smooth, edge, point;  // Gaussian, its first and its second derivative
};

FeatureKernels make_feature_kernels(double pixels_per_degree) {
  const double sigma = 0.5 * kFeatureWidth * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  const std::vector<double> smooth = gaussian(sigma, radius);
  std::vector<double> edge, point;
  for (int x = -radius; x <= radius; ++x) {
    const double g = smooth[static_cast<std::size_t>(x + radius)];
    edge.push_back(-x * g);
    point.push_back((x * x / (sigma * sigma) - 1) * g);
  }
  return {normalized<float>(smooth), balanced(edge), balanced(point)};
}

// Length of the two directional responses.
Plane detect(const Plane& gray, const std::vector<float>& derivative, const std::vector<float>& smooth) {
  Plane along_x = filter_separable(gray, derivative, smooth);
  const Plane along_y = filter_separable(gray, smooth, derivative);
  launch(along_x.size(), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    along_x.values[at] = std::hypot(along_x.values[at], along_y.values[at]);
  });
  return along_x;
}

struct Features {
  Plane edges, points;
};

Features detect_features(const Plane& achromatic, const FeatureKernels& kernels) {
  Plane gray = achromatic;
  for (float& value : gray.values) value = (value + 16) / 116;
  return {detect(gray, kernels.edge, kernels.smooth), detect(gray, kernels.point, kernels.smooth)};
}

float feature_difference(const Features& reference, const Features& test, std::size_t at) {
  const float edges = std::abs(reference.edges.values[at] - test.edges.values[at]);
  const float points = std::abs(reference.points.values[at] - test.points.values[at]);
  return std::min(1.0f, std::pow(std::max(edges, points) / std::sqrt(2.0f), kFeatureExponent));
}

}  // namespace

std::vector<float> flip_map(const RgbImage& reference, const RgbImage& test, float pixels_per_degree) {
  check_pair(reference, test);
  if (!(pixels_per_degree >= 1 && pixels_per_degree <= 1000))
    throw Error("FLIP: pixels per degree must lie between 1 and 1000");
  const ColorSpace space = make_color_space();
  const Opponent opponent_r = to_opponent(reference, space), opponent_t = to_opponent(test, space);
  const Opponent seen_r = filter_contrast(opponent_r, pixels_per_degree);
  const Opponent seen_t = filter_contrast(opponent_t, pixels_per_degree);
  const FeatureKernels kernels = make_feature_kernels(pixels_per_degree);
  const Features features_r = detect_features(opponent_r[0], kernels);
  const Features features_t = detect_features(opponent_t[0], kernels);
  const float largest = largest_difference(space);

  std::vector<float> map(seen_r[0].values.size());
  launch(static_cast<int>(map.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    const float color =
        color_difference(hyab(perceived(seen_r, at, space), perceived(seen_t, at, space)), largest);
    map[at] = std::pow(color, 1 - feature_difference(features_r, features_t, at));
  });
  return map;
}

}  // namespace lumigrove
