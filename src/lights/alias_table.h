// Walker's alias table (A. Walker 1977; linear-time construction of M. Vose 1991): one of n items with
// probability proportional to its weight, in constant time. Unbiased. `sample_alias` returns the item,
// AliasView::pdf its probability; both come from the same stored weights.
#pragma once

#include <span>
#include <vector>

#include "base/vec.h"

namespace lumigrove {

struct AliasSlot {
  float keep;           // probability of staying in this slot
  std::uint32_t other;  // otherwise
};

struct AliasView {
  std::span<const AliasSlot> slots;
  float total = 0;  // sum of weights

  // Probability of an item of this weight.
  LUMI_HD float pdf(float weight) const { return total > 0 ? weight / total : 0; }
};

// Requires total > 0. `u` in [0,1): its integer part in slots picks one, the remainder decides.
LUMI_HD inline std::uint32_t sample_alias(const AliasView& table, float u_slot, float u_keep) {
  const std::uint32_t n = static_cast<std::uint32_t>(table.slots.size());
  // In double: a float could not name every slot of a table of millions.
  std::uint32_t slot = static_cast<std::uint32_t>(static_cast<double>(u_slot) * n);
  if (slot >= n) slot = n - 1;
  return u_keep < table.slots[slot].keep ? slot : table.slots[slot].other;
}

class AliasTable {
 public:
  // Weights must be finite and >= 0; all zero gives a table with total 0, which must not be sampled.
  void build(std::span<const float> weights);

  AliasView view() const { return {slots_, total_}; }
  std::size_t bytes() const { return slots_.size() * sizeof(AliasSlot); }

 private:
  std::vector<AliasSlot> slots_;
  float total_ = 0;
};

}  // namespace lumigrove
