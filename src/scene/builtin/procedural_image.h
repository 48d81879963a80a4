// Procedural textures. `p` runs over the unit square, v downwards; images repeat when the function does.
#pragma once

#include <functional>
#include <string>

#include "lumigrove/scene.h"

namespace lumigrove::builtin {

// Base colour: linear RGB in [0,1], stored as sRGB. Returns the image's index.
int add_color_image(Scene& scene, std::string name, int size, const std::function<vec3(vec2 p)>& color);
// Roughness in the green channel, metallic 0, as glTF wants them.
int add_roughness_image(Scene& scene, std::string name, int size,
                        const std::function<float(vec2 p)>& roughness);

// A repeating use of `image`, one copy of it `metres` wide on solids whose uv are in metres.
TextureUse tiled(int image, vec2 metres);

// Fractal noise that repeats over the unit square.
float tiling_noise(vec2 p, float frequency, int octaves, std::uint32_t seed);

// Rectangles in running bond (each row shifted by half): which one `p` is in and how far from its edge.
struct BrickPoint {
  int row = 0, column = 0;
  float edge = 0;  // distance to the nearest joint in units of a brick's height
};
BrickPoint running_bond(vec2 p, int columns, int rows);

}  // namespace lumigrove::builtin
