#include "lights/alias_table.h"

namespace lumigrove {

void AliasTable::build(std::span<const float> weights) {
  const std::size_t n = weights.size();
  double total = 0;
  for (const float w : weights) total += w;
  total_ = static_cast<float>(total);
  slots_.assign(n, {1.0f, 0});
  if (!(total > 0)) return;

  std::vector<double> scaled(n);
  std::vector<std::uint32_t> small, large;
  for (std::size_t i = 0; i < n; ++i) {
    scaled[i] = weights[i] * static_cast<double>(n) / total;
    (scaled[i] < 1 ? small : large).push_back(static_cast<std::uint32_t>(i));
  }
  while (!small.empty() && !large.empty()) {
    const std::uint32_t s = small.back(), l = large.back();
    small.pop_back();
    slots_[s] = {static_cast<float>(scaled[s]), l};
    scaled[l] -= 1 - scaled[s];
    if (scaled[l] < 1) {
      large.pop_back();
      small.push_back(l);
    }
  }
  for (const std::uint32_t l : large) slots_[l] = {1.0f, l};
  // Rounding may leave small slots over; those of weight 0 must still never be returned.
  std::uint32_t positive = 0;
  while (!(weights[positive] > 0)) ++positive;
  for (const std::uint32_t s : small)
    slots_[s] = weights[s] > 0 ? AliasSlot{1.0f, s} : AliasSlot{0.0f, positive};
}

}  // namespace lumigrove
