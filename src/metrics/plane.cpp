#include "metrics/plane.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "device/device.h"

namespace lumigrove {
namespace {

// One row of `plane` with `radius` repeated border pixels on both sides.
template <class T>
void pad_row(const BasicPlane<T>& plane, int y, int radius, std::vector<T>& padded) {
  const T* row = plane.values.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(plane.width);
  padded.assign(static_cast<std::size_t>(radius), row[0]);
  padded.insert(padded.end(), row, row + plane.width);
  padded.insert(padded.end(), static_cast<std::size_t>(radius), row[plane.width - 1]);
}

template <class T>
BasicPlane<T> filter_rows(const BasicPlane<T>& plane, const std::vector<T>& kernel) {
  BasicPlane<T> result(plane.width, plane.height);
  const int radius = static_cast<int>(kernel.size() / 2);
  const auto filter_row = [&](int y) {
    std::vector<T> padded;
    pad_row(plane, y, radius, padded);
    T* out = result.values.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(plane.width);
    for (std::size_t k = 0; k < kernel.size(); ++k)
      for (int x = 0; x < plane.width; ++x) out[x] += kernel[k] * padded[k + static_cast<std::size_t>(x)];
  };
  launch(plane.height, filter_row, 16);
  return result;
}

template <class T>
BasicPlane<T> filter_columns(const BasicPlane<T>& plane, const std::vector<T>& kernel) {
  BasicPlane<T> result(plane.width, plane.height);
  const int radius = static_cast<int>(kernel.size() / 2);
  const std::size_t width = static_cast<std::size_t>(plane.width);
  const auto filter_row = [&](int y) {
    T* out = result.values.data() + static_cast<std::size_t>(y) * width;
    for (int k = -radius; k <= radius; ++k) {
      const int source = std::clamp(y + k, 0, plane.height - 1);
      const T* in = plane.values.data() + static_cast<std::size_t>(source) * width;
      const T weight = kernel[static_cast<std::size_t>(k + radius)];
      for (std::size_t x = 0; x < width; ++x) out[x] += weight * in[x];
    }
  };
  launch(plane.height, filter_row, 16);
  return result;
}

}  // namespace

template <class T>
BasicPlane<T> filter_separable(const BasicPlane<T>& plane, const std::vector<T>& kernel_x,
                               const std::vector<T>& kernel_y) {
  return filter_columns(filter_rows(plane, kernel_x), kernel_y);
}

std::vector<double> gaussian(double sigma, int radius) {
  std::vector<double> kernel;
  for (int x = -radius; x <= radius; ++x) kernel.push_back(std::exp(-x * x / (2 * sigma * sigma)));
  return kernel;
}

template <class T>
std::vector<T> normalized(const std::vector<double>& kernel) {
  const double sum = std::accumulate(kernel.begin(), kernel.end(), 0.0);
  std::vector<T> result;
  for (double weight : kernel) result.push_back(static_cast<T>(weight / sum));
  return result;
}

template Plane filter_separable(const Plane&, const std::vector<float>&, const std::vector<float>&);
template DoublePlane filter_separable(const DoublePlane&, const std::vector<double>&,
                                      const std::vector<double>&);
template std::vector<float> normalized<float>(const std::vector<double>&);
template std::vector<double> normalized<double>(const std::vector<double>&);

}  // namespace lumigrove
