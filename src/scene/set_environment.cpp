#include "scene/set_environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "lumigrove/image.h"

namespace lumigrove {
namespace {

// Numbers and commas only: anything else is a file name.
bool is_colour(const std::string& text) {
  return std::count(text.begin(), text.end(), ',') == 2 && text.front() != ',' && text.back() != ',' &&
         text.find(",,") == std::string::npos &&
         text.find_first_not_of("-+0123456789.eE,") == std::string::npos;
}

bool is_radiance(vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z) && v.x >= 0 && v.y >= 0 && v.z >= 0;
}

vec3 parse_radiance(const std::string& text) {
  vec3 value(0);
  int length = 0;
  const int count = std::sscanf(text.c_str(), "%f,%f,%f%n", &value.x, &value.y, &value.z, &length);
  if (count != 3 || length != static_cast<int>(text.size()) || !is_radiance(value))
    throw Error(
        fmt::format("environment '{}' must be three finite numbers r,g,b of at least 0, or a file", text));
  return value;
}

// The beauty of `file` as RGBA texels.
Image8or32 load_environment_image(const std::string& file) {
  const Image image = read_image(file);
  const Layer* beauty = image.layers.empty() ? nullptr : &image.layers.front();
  const std::size_t pixels = static_cast<std::size_t>(image.width) * image.height;
  if (!beauty || beauty->values.empty()) throw Error(fmt::format("environment '{}' holds no colour", file));
  const std::size_t channels = beauty->channels.size();
  Image8or32 result;
  result.name = file;
  result.width = image.width;
  result.height = image.height;
  result.texels32.assign(pixels * 4, 1.0f);
  for (std::size_t p = 0; p < pixels; ++p) {
    const float* in = &beauty->values[p * channels];
    const vec3 rgb = channels >= 3 ? vec3(in[0], in[1], in[2]) : vec3(in[0]);
    if (!is_radiance(rgb))
      throw Error(fmt::format("environment '{}' holds a negative or non-finite pixel", file));
    for (int c = 0; c < 3; ++c) result.texels32[p * 4 + c] = rgb[c];
  }
  return result;
}

}  // namespace

void set_environment(Scene& scene, const std::string& text) {
  Environment environment;
  if (is_colour(text)) {
    environment.radiance = parse_radiance(text);
  } else {
    if (std::error_code error; !std::filesystem::exists(text, error))
      throw Error(fmt::format("environment '{}' is neither three numbers r,g,b nor a file", text));
    scene.images.push_back(load_environment_image(text));
    environment.radiance = vec3(1);
    environment.image = static_cast<int>(scene.images.size()) - 1;
  }
  scene.environment = environment;
}

}  // namespace lumigrove
