#include "regions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

namespace lumigrove {
namespace {

// Sums over rectangles in constant time.
class SumTable {
 public:
  SumTable(const std::vector<float>& values, int width, int height)
      : stride_(static_cast<std::size_t>(width) + 1), sums_(stride_ * (static_cast<std::size_t>(height) + 1)) {
    for (std::size_t y = 1; y * stride_ < sums_.size(); ++y)
      for (std::size_t x = 1; x < stride_; ++x)
        sums_[y * stride_ + x] = static_cast<double>(values[(y - 1) * (stride_ - 1) + x - 1]) +
                                 sums_[(y - 1) * stride_ + x] + sums_[y * stride_ + x - 1] - sums_[(y - 1) * stride_ + x - 1];
  }
  double mean(const Region& r) const {
    const auto at = [&](int x, int y) { return sums_[static_cast<std::size_t>(y) * stride_ + static_cast<std::size_t>(x)]; };
    const double sum = at(r.x + r.width, r.y + r.height) - at(r.x, r.y + r.height) - at(r.x + r.width, r.y) + at(r.x, r.y);
    return sum / (static_cast<double>(r.width) * r.height);
  }

 private:
  std::size_t stride_;
  std::vector<double> sums_;
};

// Every quarter of a window, with the mean of every map.
std::vector<Region> windows_of(const std::vector<SumTable>& tables, int width, int height) {
  const int side = std::min({std::max(16, width / 10), width, height}), step = std::max(1, side / 4);
  std::vector<Region> windows;
  for (int y = 0; y + side <= height; y += step)
    for (int x = 0; x + side <= width; x += step) {
      Region window{x, y, side, side, {}, {}};
      for (const SumTable& table : tables) window.flip.push_back(table.mean(window));
      windows.push_back(std::move(window));
    }
  return windows;
}

bool overlap(const Region& a, const Region& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

// The window with the largest score(window) among those that touch none of the chosen; nullptr: there is none.
template <class Score>
const Region* best_free(const std::vector<Region>& windows, const std::vector<Region>& chosen, const Score& score) {
  const Region* best = nullptr;
  for (const Region& window : windows) {
    if (best && score(window) <= score(*best)) continue;
    if (std::none_of(chosen.begin(), chosen.end(), [&](const Region& c) { return overlap(c, window); })) best = &window;
  }
  return best;
}

double sum_of(const Region& r) {
  double sum = 0;
  for (const double value : r.flip) sum += value;
  return sum;
}
double spread_of(const Region& r) {
  const auto [least, most] = std::minmax_element(r.flip.begin(), r.flip.end());
  return *most - *least;
}

}  // namespace

std::vector<Region> find_regions(const std::vector<std::vector<float>>& maps, int width, int height, int worst) {
  if (maps.empty()) return {};
  std::vector<SumTable> tables;
  for (const std::vector<float>& map : maps) tables.emplace_back(map, width, height);
  const std::vector<Region> windows = windows_of(tables, width, height);
  std::vector<Region> chosen;
  for (int i = 0; i < worst; ++i) {
    const Region* region = best_free(windows, chosen, sum_of);
    if (!region) break;
    chosen.push_back(*region);
    chosen.back().why = fmt::format("worst {}", i + 1);
  }
  const Region* differs = maps.size() > 1 ? best_free(windows, chosen, spread_of) : nullptr;
  if (differs) {
    chosen.push_back(*differs);
    chosen.back().why = "methods differ most";
  }
  return chosen;
}

}  // namespace lumigrove
