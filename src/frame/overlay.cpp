#include "frame/overlay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/srgb.h"
#include "frame/explain.h"
#include "image/difference.h"
#include "methods/substitute_tree/substitute_tree_statistics.h"

namespace lumigrove {

// --- drawing -----------------------------------------------------------------------------------------------

Canvas::Canvas(int width, int height, std::vector<float> picture, std::vector<float> depth)
    : width_(width), height_(height), picture_(std::move(picture)), depth_(std::move(depth)) {}

void Canvas::put(int x, int y, float depth, float coverage, vec3 colour) {
  if (x < 0 || y < 0 || x >= width_ || y >= height_ || !(coverage > 0)) return;
  const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  // What is drawn mostly lies on the very surface that it is compared with.
  constexpr float kOnSurface = 1.005f;
  if (!(depth <= depth_[at] * kOnSurface)) return;
  for (int c = 0; c < 3; ++c) {
    float& value = picture_[3 * at + static_cast<std::size_t>(c)];
    value += (colour[c] - value) * std::min(coverage, 1.0f);
  }
}

void Canvas::disc(ImagePoint centre, float radius, vec3 colour) {
  const vec2 lo = glm::floor(centre.at - radius - 0.5f), hi = glm::ceil(centre.at + radius + 0.5f);
  if (!(hi.x > 0 && hi.y > 0 && lo.x < static_cast<float>(width_) && lo.y < static_cast<float>(height_))) return;
  for (int y = static_cast<int>(lo.y); y < static_cast<int>(hi.y); ++y)
    for (int x = static_cast<int>(lo.x); x < static_cast<int>(hi.x); ++x) {
      const vec2 pixel = vec2(static_cast<float>(x), static_cast<float>(y)) + 0.5f;
      put(x, y, centre.depth, radius + 0.5f - glm::length(pixel - centre.at), colour);
    }
}

// Column by column, or row by row where the line is steep: every pixel is touched once.
void Canvas::line(ImagePoint a, ImagePoint b, float width, vec3 colour) {
  const vec2 along = b.at - a.at;
  const int major = std::abs(along.x) >= std::abs(along.y) ? 0 : 1, minor = 1 - major;
  if (a.at[major] > b.at[major]) std::swap(a, b);
  const float length = b.at[major] - a.at[major];
  const float slope = length > 0 ? (b.at[minor] - a.at[minor]) / length : 0.0f;
  const float half = 0.5f * width * std::sqrt(1 + slope * slope);  // along the minor axis
  const float limit = static_cast<float>(major == 0 ? width_ : height_);
  const float from = std::clamp(std::floor(a.at[major]), 0.0f, limit), to = std::clamp(b.at[major], 0.0f, limit);
  for (float m = from; m < to; ++m) {
    const float s = length > 0 ? std::clamp((m + 0.5f - a.at[major]) / length, 0.0f, 1.0f) : 0.0f;
    const float centre = a.at[minor] + s * length * slope;
    if (!(std::abs(centre) < 1e6f)) continue;
    const float depth = 1 / ((1 - s) / a.depth + s / b.depth);  // linear in the image is its reciprocal
    for (float n = std::floor(centre - half - 0.5f); n <= centre + half + 0.5f; ++n) {
      const float coverage = half + 0.5f - std::abs(n + 0.5f - centre);
      const int x = static_cast<int>(major == 0 ? m : n), y = static_cast<int>(major == 0 ? n : m);
      put(x, y, depth, coverage, colour);
    }
  }
}

ImagePoint project(const CameraView& camera, vec3 p) {
  const vec3 d = p - camera.position;
  const float depth = glm::dot(d, camera.forward);
  if (!(depth > camera.znear)) return {vec2(0), depth};
  const vec2 plane(glm::dot(d, camera.right) / depth, glm::dot(d, camera.down) / depth);
  return {(plane - camera.corner) / camera.pixel_size, depth};
}

namespace {

// --- what lies under them ----------------------------------------------------------------------------------

struct Scenery {
  const World& world;
  const Settings& settings;
  CameraView camera;
  SeenSurfaces seen;         // the whole image, through the pixels' centres
  std::vector<float> depth;  // row by row
  std::vector<float> picture;

  std::size_t pixels() const { return depth.size(); }
};

std::vector<float> beauty(const Image& image, const ToneMap& tone) {
  const Layer& layer = image.layers.front();
  const std::size_t channels = layer.channels.size();
  std::vector<float> rgb;
  for (std::size_t i = 0; i < layer.values.size(); i += channels)
    for (std::size_t c = 0; c < 3; ++c) rgb.push_back(layer.values[i + c]);
  return tone_map(rgb, tone);
}

Scenery make_scenery(const World& world, const Settings& settings, const Image& rendered, const ToneMap& tone) {
  Scenery s{world, settings, make_camera_view(world.camera, settings.width, settings.height), {}, {}, {}};
  s.seen = see_surfaces(world, settings, {0, 0, settings.width, settings.height}, false);
  s.depth.assign(s.seen.pixels.size(), kInfinity);
  for (std::size_t i = 0; i < s.seen.pixels.size(); ++i) {
    const Surface& surface = s.seen.surfaces[i];
    if (surface.instance != kNoId)
      s.depth[s.seen.pixels[i]] = glm::dot(surface.position - s.camera.position, s.camera.forward);
  }
  s.picture = beauty(rendered, tone);
  return s;
}

std::vector<float> dimmed(std::vector<float> picture, float by) {
  for (float& value : picture) value *= by;
  return picture;
}

// Sizes of lines and dots follow the image, so that a small picture of a big one looks alike.
float line_unit(const Settings& settings) { return std::max(1.0f, static_cast<float>(settings.height) / 720.0f); }

// One diffuse walk a pixel, in the order of Scenery::seen; dead where there is no surface.
std::vector<DrawnLight> walk_everywhere(const Scenery& s, const IndirectLighting& lighting, int sample) {
  std::vector<WalkStart> starts;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < s.pixels(); ++i) {
    if (s.seen.surfaces[i].instance == kNoId) continue;
    starts.push_back({&s.seen.surfaces[i], s.seen.pixels[i], walk_dimension(sample)});
    index.push_back(i);
  }
  std::vector<DrawnLight> drawn(starts.size()), all(s.pixels());
  draw_lights(lighting, starts, Lobes::kDiffuse, drawn);
  for (std::size_t k = 0; k < index.size(); ++k) all[index[k]] = drawn[k];
  return all;
}

// --- every light as a dot ----------------------------------------------------------------------------------

vec3 encoded(vec3 linear) {
  vec3 c;
  for (int k = 0; k < 3; ++k) c[k] = linear_to_srgb(std::clamp(linear[k], 0.0f, 1.0f));
  return c;
}

OverlayPicture draw_vpls(const Scenery& s) {
  Canvas canvas(s.settings.width, s.settings.height, dimmed(s.picture, 0.25f), s.depth);
  const VplView lights = s.world.vpls.view();
  std::vector<float> strengths;
  for (const Vpl& vpl : lights.vpls) strengths.push_back(max_component(vpl.intensity));
  const float bright = quantiles_of(strengths)[5];
  std::size_t facing = 0;
  for (const Vpl& vpl : lights.vpls) {
    const float strength = max_component(vpl.intensity);
    const ImagePoint point = project(s.camera, vpl.position);
    if (!(strength > 0) || !(point.depth > s.camera.znear)) continue;
    if (!(glm::dot(vpl.normal, s.camera.position - vpl.position) > 0)) continue;
    ++facing;
    const float brightness = std::clamp(std::pow(strength / bright, 0.4f), 0.2f, 1.0f);
    canvas.disc(point, 0.9f * line_unit(s.settings), encoded(vpl.intensity * (brightness / strength)));
  }
  return {
      canvas.picture(),
      {fmt::format("dots: VPLs in the colour of their intensity, brighter where that is higher ({} VPLs, {} of them "
                   "on the viewer's side of their surface)",
                   lights.vpls.size(), facing)}};
}

// --- substitutes as ellipses -------------------------------------------------------------------------------

void draw_curve(Canvas& canvas, const CameraView& camera, const std::vector<vec3>& points, float width, vec3 colour) {
  for (std::size_t k = 0; k + 1 < points.size(); ++k) {
    const ImagePoint a = project(camera, points[k]), b = project(camera, points[k + 1]);
    if (a.depth > camera.znear && b.depth > camera.znear) canvas.line(a, b, width, colour);
  }
}

// A straight line, in parts, so that what is hidden of it is hidden exactly and its depth stays right near the eye.
void draw_straight(Canvas& canvas, const CameraView& camera, vec3 a, vec3 b, float width, vec3 colour) {
  constexpr int kParts = 8;
  std::vector<vec3> points;
  for (int k = 0; k <= kParts; ++k) points.push_back(glm::mix(a, b, static_cast<float>(k) / kParts));
  draw_curve(canvas, camera, points, width, colour);
}

void draw_ellipse(Canvas& canvas, const CameraView& camera, const Distribution& d, float unit) {
  const PrincipalAxes axes = principal_axes(d);
  const vec3 u = axes.axis[0] * axes.sigma[0], v = axes.axis[1] * axes.sigma[1];
  constexpr int kCorners = 32;
  std::vector<vec3> rim;
  for (int k = 0; k <= kCorners; ++k) {
    const float phi = 2 * kPi * static_cast<float>(k) / kCorners;
    rim.push_back(d.mean + u * std::cos(phi) + v * std::sin(phi));
  }
  draw_curve(canvas, camera, rim, unit, vec3(0.85f, 0.85f, 0.8f));
  draw_straight(canvas, camera, d.mean - u, d.mean + u, 1.4f * unit, vec3(1, 0.2f, 0.15f));
  draw_straight(canvas, camera, d.mean - v, d.mean + v, 1.4f * unit, vec3(0.2f, 0.95f, 0.25f));
  // The deviation along the normal would be too short to see: its line shows the direction.
  const float shown = std::max(axes.sigma[2], 0.25f * (axes.sigma[0] + axes.sigma[1]));
  draw_straight(canvas, camera, d.mean, d.mean + axes.axis[2] * shown, 1.4f * unit, vec3(0.3f, 0.55f, 1));
}

constexpr std::size_t kMostEllipses = 1000;

OverlayPicture draw_ellipses(const Scenery& s, const IndirectLighting& lighting) {
  const std::vector<DrawnLight> drawn = walk_everywhere(s, lighting, 0);
  std::unordered_map<std::uint32_t, std::size_t> users;
  std::size_t walks = 0;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    if (drawn[i].walk.end != WalkEnd::kSubstitute) continue;
    ++users[drawn[i].walk.node];
    ++walks;
  }
  const SubstituteTreeView& tree = lighting.sampler.walk.tree;
  std::vector<std::pair<std::size_t, std::uint32_t>> most;  // users, node
  for (const auto& [node, count] : users) {
    const Distribution& d = tree.distributions[node];
    const ImagePoint centre = project(s.camera, d.mean);
    const bool inside = centre.depth > s.camera.znear && centre.at.x >= 0 && centre.at.y >= 0 &&
                        centre.at.x < static_cast<float>(s.settings.width) &&
                        centre.at.y < static_cast<float>(s.settings.height);
    if (inside && glm::dot(d.normal, s.camera.position - d.mean) > 0) most.emplace_back(count, node);
  }
  const auto more = [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  };
  std::sort(most.begin(), most.end(), more);
  const std::size_t found = most.size();
  if (most.size() > kMostEllipses) most.resize(kMostEllipses);
  Canvas canvas(s.settings.width, s.settings.height, dimmed(s.picture, 0.35f), s.depth);
  for (const auto& [count, node] : most)
    draw_ellipse(canvas, s.camera, tree.distributions[node], line_unit(s.settings));
  return {canvas.picture(),
          {fmt::format("{} walks end at {} different substitutes, {} of which face the viewer inside the image; the {} "
                       "most used are drawn",
                       walks, users.size(), found, most.size()),
           "red, green: one standard deviation along the principal axes on the surface, with the ellipse in grey",
           "blue: the normal, at least as long as half the mean of the two; the deviation along it is mostly too "
           "short to see"}};
}

// --- false colour ------------------------------------------------------------------------------------------

// Walks a pixel whose mean is shown.
constexpr int kShownWalks = 16;

// Means over the walks of each pixel, row by row; NaN where there is none.
struct PixelMeans {
  std::vector<float> mean;
  std::uint64_t walks = 0, counted = 0;
};

// `value` of a walk is NaN where it does not count.
template <class Value>
PixelMeans mean_over_walks(const Scenery& s, const IndirectLighting& lighting, const Value& value) {
  std::vector<float> sum(s.pixels(), 0), count(s.pixels(), 0);
  PixelMeans means;
  for (int w = 0; w < kShownWalks; ++w) {
    const std::vector<DrawnLight> drawn = walk_everywhere(s, lighting, w);
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      if (s.seen.surfaces[i].instance == kNoId) continue;
      ++means.walks;
      const float v = value(drawn[i].walk);
      if (std::isnan(v)) continue;
      ++means.counted;
      sum[s.seen.pixels[i]] += v;
      count[s.seen.pixels[i]] += 1;
    }
  }
  means.mean.resize(s.pixels());
  for (std::size_t i = 0; i < sum.size(); ++i) means.mean[i] = count[i] > 0 ? sum[i] / count[i] : std::nanf("");
  return means;
}

// From black to pale yellow; the few values outside take the colour of the nearest end.
struct ColourScale {
  float lo = 0, hi = 1;
};

ColourScale fit_scale(const std::vector<float>& values) {
  std::vector<float> known;
  for (const float v : values)
    if (!std::isnan(v)) known.push_back(v);
  if (known.empty()) return {};
  std::sort(known.begin(), known.end());
  const auto at = [&](double share) {
    return known[static_cast<std::size_t>(share * static_cast<double>(known.size() - 1))];
  };
  const ColourScale scale{at(0.01), at(0.99)};
  return {scale.lo, std::max(scale.hi, scale.lo + 1e-3f)};
}

// The values over a trace of the picture, which alone shows where there is none.
std::vector<float> false_colour(const std::vector<float>& picture, const std::vector<float>& values,
                                const ColourScale& scale) {
  constexpr float kTrace = 0.15f;
  std::vector<float> result = dimmed(picture, kTrace);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isnan(values[i])) continue;
    const vec3 colour = magma((values[i] - scale.lo) / (scale.hi - scale.lo));
    for (std::size_t c = 0; c < 3; ++c) result[3 * i + c] += (1 - kTrace) * colour[static_cast<int>(c)];
  }
  return result;
}

// The scale in words that fit `magma`; `number` turns a value into what is printed.
template <class Number>
std::string legend_of(const std::string& what, const ColourScale& scale, const Number& number) {
  constexpr std::array<const char*, 5> kColours = {"black", "dark purple", "purple-red", "orange", "pale yellow"};
  std::string line = what + ':';
  for (std::size_t k = 0; k < kColours.size(); ++k) {
    const float value = scale.lo + (scale.hi - scale.lo) * 0.25f * static_cast<float>(k);
    line += fmt::format("{} {:.3g} {}", k > 0 ? "," : "", number(value), kColours[k]);
  }
  return line;
}

OverlayPicture draw_steps(const Scenery& s, const IndirectLighting& lighting) {
  const PixelMeans steps =
      mean_over_walks(s, lighting, [](const WalkResult& walk) { return static_cast<float>(walk.steps); });
  const ColourScale scale = fit_scale(steps.mean);
  double sum = 0, pixels = 0;
  for (const float mean : steps.mean) {
    if (std::isnan(mean)) continue;
    sum += static_cast<double>(mean);
    ++pixels;
  }
  return {false_colour(s.picture, steps.mean, scale),
          {legend_of("steps of a walk", scale, [](float value) { return value; }),
           fmt::format("mean of the image {:.2f}; every pixel shows the mean of {} diffuse walks",
                       sum / std::max(1.0, pixels), kShownWalks)}};
}

OverlayPicture draw_size(const Scenery& s, const IndirectLighting& lighting) {
  const PixelMeans sizes = mean_over_walks(s, lighting, [](const WalkResult& walk) {
    return walk.end == WalkEnd::kSubstitute ? std::log10(std::max(walk.box.diagonal(), 1e-12f)) : std::nanf("");
  });
  const ColourScale scale = fit_scale(sizes.mean);
  return {
      false_colour(s.picture, sizes.mean, scale),
      {legend_of("metres across the substitute's box", scale, [](float value) { return std::pow(10.0f, value); }),
       fmt::format(
           "every pixel shows the geometric mean of those of {} diffuse walks that end at substitutes, {:.1f} % "
           "of all",
           kShownWalks, 100 * static_cast<double>(sizes.counted) / std::max(1.0, static_cast<double>(sizes.walks)))}};
}

}  // namespace

Overlay overlay_from_name(const std::string& name) {
  if (name == "vpls") return Overlay::kVpls;
  if (name == "ellipses") return Overlay::kEllipses;
  if (name == "steps") return Overlay::kSteps;
  if (name == "size") return Overlay::kSize;
  throw Error(fmt::format("unknown overlay '{}'; valid are vpls, ellipses, steps and size", name));
}

OverlayPicture draw_overlay(const World& world, const Settings& settings, const Image& rendered, const ToneMap& tone,
                            Overlay overlay) {
  const Scenery scenery = make_scenery(world, settings, rendered, tone);
  const IndirectLighting lighting = make_indirect_lighting(world, settings, 0);
  switch (overlay) {
    case Overlay::kVpls:
      return draw_vpls(scenery);
    case Overlay::kEllipses:
      return draw_ellipses(scenery, lighting);
    case Overlay::kSteps:
      return draw_steps(scenery, lighting);
    case Overlay::kSize:
      break;
  }
  return draw_size(scenery, lighting);
}

}  // namespace lumigrove
