// One word that two threads hand over between them: what the first wrote before arriving, the second may read.
#pragma once

#include <cstdint>

#if !defined(__CUDA_ARCH__)
#include <atomic>
#endif

#include "base/vec.h"

namespace lumigrove {

// Leaves `value` in `word` if that holds `empty` and returns `empty`; otherwise returns what the other thread left.
// At most two calls for a word; `value` != `empty`.
LUMI_HD inline std::uint32_t hand_over(std::uint32_t& word, std::uint32_t value, std::uint32_t empty) {
#if defined(__CUDA_ARCH__)
  (void)empty;
  __threadfence();
  const std::uint32_t before = atomicExch(&word, value);
  __threadfence();
  return before;
#else
  const std::atomic_ref<std::uint32_t> shared(word);
  const std::uint32_t before = shared.load(std::memory_order_acquire);
  if (before != empty) return before;  // much cheaper than an exchange
  return shared.exchange(value, std::memory_order_acq_rel);
#endif
}

}  // namespace lumigrove
