// Pictures of the substitute tree at work, drawn over the frame that it lit. Host only.
#pragma once

#include <string>
#include <vector>

#include "frame/frame.h"
#include "lumigrove/image.h"

namespace lumigrove {

// --- drawing -----------------------------------------------------------------------------------------------

// A point of the image: pixels from its top left corner, and metres along the view direction.
struct ImagePoint {
  vec2 at;
  float depth;
};

// Lines and discs over a picture, hidden where the picture's own surfaces are nearer.
class Canvas {
 public:
  // `picture`: display-ready, sRGB-encoded, three floats a pixel. `depth`: one a pixel, metres along the view
  // direction, infinite where nothing was hit.
  Canvas(int width, int height, std::vector<float> picture, std::vector<float> depth);

  void disc(ImagePoint centre, float radius, vec3 colour);
  void line(ImagePoint a, ImagePoint b, float width, vec3 colour);

  const std::vector<float>& picture() const { return picture_; }

 private:
  // Mixes `colour` into the pixel by `coverage` unless something is in front of it.
  void put(int x, int y, float depth, float coverage, vec3 colour);

  int width_, height_;
  std::vector<float> picture_, depth_;
};

// Where the camera sees `p`; nothing behind the near plane. Behind it: depth below znear.
ImagePoint project(const CameraView& camera, vec3 p);

// --- overlays ----------------------------------------------------------------------------------------------

enum class Overlay : std::uint8_t {
  kVpls,      // every light as a dot in its colour (Figure 2a of the paper)
  kEllipses,  // substitutes that the pixels' walks end at, by their standard deviations (Figure 2b)
  kSteps,     // length of the walks in false colour (Figure 5)
  kSize,      // diagonal of the substitutes' boxes in false colour
};

// "vpls", "ellipses", "steps", "size"; anything else throws Error.
Overlay overlay_from_name(const std::string& name);

struct OverlayPicture {
  std::vector<float> picture;       // display-ready
  std::vector<std::string> legend;  // what the colours mean, a line each
};

// `rendered` is the frame of `settings`; its tone-mapped beauty lies, darker, under what is drawn.
OverlayPicture draw_overlay(const World& world, const Settings& settings, const Image& rendered, const ToneMap& tone,
                            Overlay overlay);

}  // namespace lumigrove
