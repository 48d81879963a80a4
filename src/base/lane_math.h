// Functions of lanes that the machine lacks, good to about 1e-6.
#pragma once

#include "base/lanes.h"
#include "base/rng.h"

namespace lumigrove {

// 1 / sqrt(a), a > 0, to within a few roundings.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<W> inverse_sqrt(const Lanes<W>& a) {
  const Lanes<W> guess = reciprocal_sqrt<W>(a);
  return guess * (1.5f - 0.5f * a * (guess * guess));
}

// Natural logarithm of a normal number a > 0: exponent and mantissa; atanh series of the latter about sqrt(1/2)..sqrt(2).
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<W> log_lanes(const Lanes<W>& a) {
  constexpr std::int32_t kSqrtHalf = 0x3f3504f3;
  const IntLanes<W> above = bits_of<W>(a) + (0x3f800000 - kSqrtHalf);
  const Lanes<W> exponent = to_float<W>((above >> 23) + -127);
  const Lanes<W> mantissa = from_bits<W>((above & 0x007fffff) + kSqrtHalf);
  const Lanes<W> z = (mantissa - 1.0f) * reciprocal<W>(mantissa + 1.0f), z2 = z * z;
  Lanes<W> series = broadcast<W>(2.0f / 9);
  series = multiply_add<W>(series, z2, broadcast<W>(2.0f / 7));
  series = multiply_add<W>(series, z2, broadcast<W>(2.0f / 5));
  series = multiply_add<W>(series, z2, broadcast<W>(2.0f / 3));
  series = multiply_add<W>(series, z2, broadcast<W>(2.0f));
  return multiply_add<W>(exponent, broadcast<W>(0.693147181f), series * z);
}

// sin(2 pi t), |t| <= 1/2: folded to a quarter turn, then the series of the sine.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<W> sine_of_turns(const Lanes<W>& t) {
  const Lanes<W> quarter = broadcast<W>(0.25f), half = broadcast<W>(0.5f);
  const Lanes<W> upper = choose_where_greater<W>(t, quarter, half - t, t);
  const Lanes<W> x = choose_where_greater<W>(broadcast<W>(-0.25f), upper, broadcast<W>(-0.5f) - upper, upper) *
                     (2 * kPi);
  const Lanes<W> x2 = x * x;
  Lanes<W> series = broadcast<W>(2.7557319e-6f);
  series = multiply_add<W>(series, x2, broadcast<W>(-1.9841270e-4f));
  series = multiply_add<W>(series, x2, broadcast<W>(8.3333333e-3f));
  series = multiply_add<W>(series, x2, broadcast<W>(-1.6666667e-1f));
  return multiply_add<W>(series * x2, x, x);
}

// cos and sin of 2 pi u, 0 <= u <= 1.
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE void sine_cosine_of_turns(const Lanes<W>& u, Lanes<W>& sine, Lanes<W>& cosine) {
  const Lanes<W> t = u - 0.25f, wrapped = choose_where_greater<W>(t, broadcast<W>(0.5f), t - 1.0f, t);
  sine = sine_of_turns<W>(0.5f - u);
  cosine = sine_of_turns<W>(0.0f - wrapped);
}

}  // namespace lumigrove
