// One channel of an image, and separable filters on it.
#pragma once

#include <cstddef>
#include <vector>

namespace lumigrove {

template <class T>
struct BasicPlane {
  int width = 0, height = 0;
  std::vector<T> values;  // row 0 on top

  BasicPlane(int w, int h)
      : width(w), height(h), values(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  int size() const { return static_cast<int>(values.size()); }
};
using Plane = BasicPlane<float>;
using DoublePlane = BasicPlane<double>;

// Correlation with kernel_y[j] * kernel_x[i], both of odd length and centred; beyond the border the nearest
// pixel repeats.
template <class T>
BasicPlane<T> filter_separable(const BasicPlane<T>& plane, const std::vector<T>& kernel_x,
                               const std::vector<T>& kernel_y);

// exp(-x^2 / (2 sigma^2)) at x = -radius..radius, not normalised.
std::vector<double> gaussian(double sigma, int radius);

// Each weight divided by the sum of all.
template <class T>
std::vector<T> normalized(const std::vector<double>& kernel);

}  // namespace lumigrove
