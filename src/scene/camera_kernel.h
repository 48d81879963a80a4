// Primary rays of a pinhole camera. Pixel (0,0) is top left; the field of view is vertical.
#pragma once

#include <span>

#include "base/rng.h"
#include "base/vec.h"
#include "lumigrove/scene.h"
#include "trace/ray.h"

namespace lumigrove {

// Pixels [x0, x1) x [y0, y1) of an image.
struct PixelWindow {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  LUMI_HD int width() const { return x1 - x0; }
  LUMI_HD int height() const { return y1 - y0; }
  LUMI_HD int count() const { return width() * height(); }
};

// Neighbours in a launch are neighbours in the image: packets of 16 rays cover a square, and the 64 surfaces that are lit
// together a square of such squares.
inline constexpr int kPixelBlock = 4, kPixelSuperblock = 8;

struct Pixel {
  int x, y;
};

// One level of the order: bands of kSize rows, each cut into blocks of kSize columns (the last band and the last block of a
// band may be smaller).
template <int kSize>
struct BlockOrder {
  PixelWindow window;

  struct Place {
    PixelWindow block;
    int in_block;
  };
  LUMI_HD Place block_of_index(int index) const {
    const int band_size = kSize * window.width();
    const int band = index / band_size, in_band = index - band * band_size;
    const int rows = glm::min(kSize, window.height() - band * kSize);
    // Dividing by the constant, which is a shift, in the whole blocks that make up nearly all of an image.
    const int block = rows == kSize ? in_band / (kSize * kSize) : in_band / (kSize * rows);
    const int x = window.x0 + block * kSize, y = window.y0 + band * kSize;
    return {{x, y, glm::min(x + kSize, window.x1), y + rows}, in_band - block * kSize * rows};
  }
  LUMI_HD Place block_of_pixel(Pixel pixel) const {  // in_block: index of the block's first pixel
    const int band = (pixel.y - window.y0) / kSize, block = (pixel.x - window.x0) / kSize;
    const int x = window.x0 + block * kSize, y = window.y0 + band * kSize;
    const int y1 = glm::min(y + kSize, window.y1);
    return {{x, y, glm::min(x + kSize, window.x1), y1}, band * kSize * window.width() + block * kSize * (y1 - y)};
  }
};

// Launch index -> pixel: blocks of kPixelSuperblock, in each blocks of kPixelBlock, in each row by row. Every pixel of the
// window comes once.
LUMI_HD inline Pixel pixel_of_index(const PixelWindow& window, int index) {
  const auto outer = BlockOrder<kPixelSuperblock>{window}.block_of_index(index);
  const auto inner = BlockOrder<kPixelBlock>{outer.block}.block_of_index(outer.in_block);
  const int columns = inner.block.width();
  const int row = columns == kPixelBlock ? inner.in_block / kPixelBlock : inner.in_block / columns;
  return {inner.block.x0 + inner.in_block - row * columns, inner.block.y0 + row};
}

// Its inverse.
LUMI_HD inline int index_of_pixel(const PixelWindow& window, Pixel pixel) {
  const auto outer = BlockOrder<kPixelSuperblock>{window}.block_of_pixel(pixel);
  const auto inner = BlockOrder<kPixelBlock>{outer.block}.block_of_pixel(pixel);
  return outer.in_block + inner.in_block + (pixel.y - inner.block.y0) * inner.block.width() + pixel.x - inner.block.x0;
}

// A camera for an image of `width` x `height` pixels. A point of the image plane at distance 1 is
// forward + right * x + down * y, with (x, y) = corner + pixel position * pixel size.
struct CameraView {
  vec3 position, right, down, forward;
  vec2 corner, pixel_size;
  float znear;
  int width, height;
};

inline CameraView make_camera_view(const CameraInstance& camera, int width, int height) {
  const float size = 2.0f * glm::tan(0.5f * camera.camera.vertical_fov) / static_cast<float>(height);
  CameraView view;
  view.position = camera.position;
  view.right = camera.right;
  view.down = -camera.up;
  view.forward = camera.forward;
  view.pixel_size = vec2(size);
  view.corner = vec2(static_cast<float>(width), static_cast<float>(height)) * (-0.5f * size);
  view.znear = camera.camera.znear;
  view.width = width;
  view.height = height;
  return view;
}

// Ray through `at` (in pixels from the top left corner of the image); unit direction; starts at the near
// plane. Writes member by member into memory: copying a whole Ray that was just put together waits for its
// parts.
LUMI_HD inline void write_camera_ray(const CameraView& camera, vec2 at, Ray& ray) {
  const vec2 p = camera.corner + at * camera.pixel_size;
  const vec3 d = camera.forward + camera.right * p.x + camera.down * p.y;
  const float length = glm::sqrt(length_squared(d));
  ray.origin = camera.position;
  ray.tmin = camera.znear * length;
  ray.direction = d * (1.0f / length);
  ray.tmax = kInfinity;
}

LUMI_HD inline Ray camera_ray(const CameraView& camera, vec2 at) {
  Ray ray;
  write_camera_ray(camera, at, ray);
  return ray;
}

// The number of a pixel in random numbers: of the whole image, so that a crop window shows the same noise.
LUMI_HD inline std::uint32_t rng_pixel(const CameraView& camera, Pixel pixel) {
  return static_cast<std::uint32_t>(pixel.y) * static_cast<std::uint32_t>(camera.width) +
         static_cast<std::uint32_t>(pixel.x);
}

// One ray a pixel of the window, in the order of `pixel_of_index`, and its pixel's rng_pixel.
struct CameraKernel {
  CameraView camera;
  PixelWindow window;
  std::span<Ray> rays;
  std::span<std::uint32_t> pixels;
  std::uint32_t seed = 0, frame = 0;
  bool jitter = true;  // uniform in the pixel; otherwise its centre

  LUMI_HD void operator()(int i) const {
    const Pixel pixel = pixel_of_index(window, i);
    const std::uint32_t number = rng_pixel(camera, pixel);
    pixels[static_cast<std::size_t>(i)] = number;
    vec2 offset(0.5f);
    if (jitter) offset = vec2(Rng{seed, frame, number}.uniform4(kDimPixel));
    const vec2 at = vec2(static_cast<float>(pixel.x), static_cast<float>(pixel.y)) + offset;
    write_camera_ray(camera, at, rays[static_cast<std::size_t>(i)]);
  }
};

}  // namespace lumigrove
