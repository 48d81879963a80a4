#include "frame/film.h"

#include <utility>

#include "device/device.h"

namespace lumigrove {
namespace {

template <class Get>
Layer float_layer(const Film& film, const char* name, std::vector<std::string> channels, const Get& get) {
  Layer layer;
  layer.name = name;
  layer.channels = std::move(channels);
  const std::size_t n = layer.channels.size();
  layer.values.resize(film.pixels.size() * n);
  launch(
      static_cast<int>(film.pixels.size()),
      [&](int i) {
        const vec4 value = get(film.pixels[static_cast<std::size_t>(i)]);
        for (std::size_t c = 0; c < n; ++c)
          layer.values[static_cast<std::size_t>(i) * n + c] = value[static_cast<int>(c)];
      },
      8192);
  return layer;
}

template <class Get>
Layer id_layer(const Film& film, const char* name, const Get& get) {
  Layer layer;
  layer.name = name;
  layer.channels = {"id"};
  layer.ids.resize(film.pixels.size());
  launch(
      static_cast<int>(film.pixels.size()),
      [&](int i) { layer.ids[static_cast<std::size_t>(i)] = get(film.pixels[static_cast<std::size_t>(i)]); },
      8192);
  return layer;
}

Layer walk_layer(const Film& film) {
  Layer layer;
  layer.name = "walk";
  layer.channels = {"steps", "size", "substitute", "boxed", "clamped"};
  layer.values.reserve(film.walks.size() * layer.channels.size());
  for (const WalkPixel& p : film.walks)
    layer.values.insert(layer.values.end(), {p.steps, p.size, p.substitute, p.boxed, p.clamped});
  return layer;
}

FilmPixel black_pixel() {
  FilmPixel pixel{};
  pixel.depth = kInfinity;
  pixel.emitter = pixel.instance = kNoId;
  return pixel;
}

}  // namespace

Film::Film(int film_width, int film_height, bool shows_walks)
    : width(film_width),
      height(film_height),
      pixels(static_cast<std::size_t>(film_width) * static_cast<std::size_t>(film_height), black_pixel()),
      walks(shows_walks ? pixels.size() : 0, WalkPixel{}) {}

Image develop(const Film& film, int samples) {
  using P = const FilmPixel&;
  const std::vector<std::string> rgb{"R", "G", "B"}, xyz{"X", "Y", "Z"};
  Image image;
  image.width = film.width;
  image.height = film.height;
  image.layers.push_back(float_layer(film, "", {"R", "G", "B", "A"},
                                     [](P p) { return vec4(p.direct + p.indirect + p.emission, p.alpha); }));
  image.layers.push_back(float_layer(film, "direct", rgb, [](P p) { return vec4(p.direct, 0); }));
  image.layers.push_back(float_layer(film, "indirect", rgb, [](P p) { return vec4(p.indirect, 0); }));
  image.layers.push_back(float_layer(film, "emission", rgb, [](P p) { return vec4(p.emission, 0); }));
  image.layers.push_back(float_layer(film, "albedo", rgb, [](P p) { return vec4(p.albedo, 0); }));
  image.layers.push_back(float_layer(film, "N", xyz, [](P p) { return vec4(p.normal, 0); }));
  image.layers.push_back(float_layer(film, "P", xyz, [](P p) { return vec4(p.position, 0); }));
  image.layers.push_back(float_layer(film, "Z", {"Z"}, [](P p) { return vec4(p.depth); }));
  if (samples >= 2) {
    const float scale = 1.0f / (static_cast<float>(samples) * static_cast<float>(samples - 1));
    image.layers.push_back(
        float_layer(film, "variance", rgb, [scale](P p) { return vec4(p.moment2 * scale, 0); }));
  }
  if (!film.walks.empty()) image.layers.push_back(walk_layer(film));
  image.layers.push_back(id_layer(film, "emitter", [](P p) { return p.emitter; }));
  image.layers.push_back(id_layer(film, "instance", [](P p) { return p.instance; }));
  return image;
}

}  // namespace lumigrove
