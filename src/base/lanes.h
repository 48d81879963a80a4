// W floats worked on at once: one or two registers on the CPU (GCC's vector types), plain loops that the
// compiler unrolls on the device. Same operations, same order of additions on both; reciprocal_sqrt alone may
// differ in its last bits from machine to machine.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include "base/vec.h"

#if !defined(__CUDACC__) && defined(__GNUC__)
#define LUMI_VECTOR_LANES 1
#if defined(__FMA__)
#include <immintrin.h>
#if defined(__AVX512F__) && defined(__AVX512VL__)
#define LUMI_AVX512_LANES 1
#endif
#endif
#else
#define LUMI_VECTOR_LANES 0
#endif

namespace lumigrove {

#define LUMI_PRAGMA(text) _Pragma(#text)
#if defined(__CUDACC__)
#define LUMI_ALWAYS_INLINE __forceinline__
#define LUMI_UNROLL(n) LUMI_PRAGMA(unroll n)
#else
#define LUMI_ALWAYS_INLINE [[gnu::always_inline]] inline
#define LUMI_UNROLL(n) LUMI_PRAGMA(GCC unroll n)
#endif

// Starts loading a cache line that will be read soon. To be called from inlined functions only: GCC drops calls of a
// function that does nothing else.
LUMI_HD LUMI_ALWAYS_INLINE void prefetch(const void* address) {
#if LUMI_VECTOR_LANES
  __builtin_prefetch(address);
#else
  (void)address;
#endif
}

// What was stored is loaded again: GCC would rather take lanes out of a register one by one, at two operations each.
LUMI_HD LUMI_ALWAYS_INLINE void forget_registers() {
#if LUMI_VECTOR_LANES
  asm volatile("" ::: "memory");
#endif
}

// The same for a line that will be written soon.
LUMI_HD LUMI_ALWAYS_INLINE void prefetch_to_write(const void* address) {
#if LUMI_VECTOR_LANES
  __builtin_prefetch(address, 1);
#else
  (void)address;
#endif
}

#if LUMI_VECTOR_LANES

// W: 2, 4, 8 or 16. Arithmetic and comparisons are the compiler's.
template <int W>
struct LaneTypes {
  typedef float Floats __attribute__((vector_size(W * sizeof(float))));
  typedef std::int32_t Ints __attribute__((vector_size(W * sizeof(float))));
};
template <int W>
using Lanes = typename LaneTypes<W>::Floats;

template <int W>
inline Lanes<W> broadcast(float x) {
  return x - Lanes<W>{};
}

template <int W>
inline Lanes<W> load_lanes(const float* from) {
  Lanes<W> lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}

// The first `count` lanes from memory, the others 0; what lies behind them is not read. 0 <= count <= W.
template <int W>
inline Lanes<W> load_first_lanes(const float* from, int count) {
#if defined(LUMI_AVX512_LANES)
  if constexpr (W == 16) return (Lanes<W>)_mm512_maskz_loadu_ps(static_cast<__mmask16>((1u << count) - 1), from);
#endif
  Lanes<W> lanes{};
  if (count > 0) std::memcpy(&lanes, from, static_cast<std::size_t>(count) * sizeof(float));
  return lanes;
}

template <int W>
inline void store_lanes(Lanes<W> lanes, float* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}

template <int W>
inline Lanes<W> abs_lanes(Lanes<W> a) {
  return (Lanes<W>)((typename LaneTypes<W>::Ints)a & 0x7fffffff);
}

// Intrinsics with a full mask, because GCC 12 makes two instructions of a comparison with a constant, and warns of
// the undefined register inside the plain forms.
template <int W>
inline Lanes<W> max_lanes(Lanes<W> a, Lanes<W> b) {
#if defined(LUMI_AVX512_LANES)
  if constexpr (W == 16) return (Lanes<W>)_mm512_maskz_max_ps(0xffff, (__m512)a, (__m512)b);
#endif
  return a > b ? a : b;
}

template <int W>
inline Lanes<W> min_lanes(Lanes<W> a, Lanes<W> b) {
#if defined(LUMI_AVX512_LANES)
  if constexpr (W == 16) return (Lanes<W>)_mm512_maskz_min_ps(0xffff, (__m512)a, (__m512)b);
#endif
  return a < b ? a : b;
}

// a * b + c, rounded once where the machine can. Written a * b + c + d * e, the compiler would choose which product
// is rounded, and might choose otherwise in another place.
template <int W>
inline Lanes<W> multiply_add(Lanes<W> a, Lanes<W> b, Lanes<W> c) {
#if defined(__FMA__)
#if defined(LUMI_AVX512_LANES)
  if constexpr (W == 16) return (Lanes<W>)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
#endif
  if constexpr (W == 8) return (Lanes<W>)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
  if constexpr (W == 4) return (Lanes<W>)_mm_fmadd_ps((__m128)a, (__m128)b, (__m128)c);
  Lanes<W> sum;
  for (int k = 0; k < W; ++k) sum[k] = __builtin_fmaf(a[k], b[k], c[k]);
  return sum;
#else
  return a * b + c;
#endif
}

// a where x <= y, elsewhere 0.
template <int W>
inline Lanes<W> keep_if_not_above(Lanes<W> x, Lanes<W> y, Lanes<W> a) {
  return x <= y ? a : Lanes<W>{};
}

// x where a > b, elsewhere y.
template <int W>
inline Lanes<W> choose_where_greater(Lanes<W> a, Lanes<W> b, Lanes<W> x, Lanes<W> y) {
  return a > b ? x : y;
}

// The bits of every lane as a whole number, and back.
template <int W>
using IntLanes = typename LaneTypes<W>::Ints;

template <int W>
inline IntLanes<W> broadcast_int(std::int32_t i) {
  return i - IntLanes<W>{};
}
template <int W>
inline IntLanes<W> bits_of(Lanes<W> a) {
  return (IntLanes<W>)a;
}
template <int W>
inline Lanes<W> from_bits(IntLanes<W> bits) {
  return (Lanes<W>)bits;
}
// As signed numbers, rounded to nearest above 2^24.
template <int W>
inline Lanes<W> to_float(IntLanes<W> a) {
  return __builtin_convertvector(a, Lanes<W>);
}
template <int W>
inline IntLanes<W> load_lanes(const std::uint32_t* from) {
  IntLanes<W> lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
template <int W>
inline void store_lanes(IntLanes<W> lanes, std::uint32_t* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}
template <int W>
inline IntLanes<W> choose_where_greater(Lanes<W> a, Lanes<W> b, IntLanes<W> x, IntLanes<W> y) {
  return a > b ? x : y;
}

// Rows i and i + kStride exchange their columns c and c + kStride, for all i and c without the bit kStride.
template <int W, int kStride, int... c>
LUMI_ALWAYS_INLINE void exchange_columns(Lanes<W>* rows, std::integer_sequence<int, c...>) {
  constexpr IntLanes<W> low{((c & kStride) != 0 ? W + c - kStride : c)...};
  constexpr IntLanes<W> high{((c & kStride) != 0 ? W + c : c + kStride)...};
#pragma GCC unroll 16
  for (int i = 0; i < W; ++i) {
    if ((i & kStride) != 0) continue;
    const Lanes<W> a = rows[i], b = rows[i + kStride];
    rows[i] = __builtin_shuffle(a, b, low);
    rows[i + kStride] = __builtin_shuffle(a, b, high);
  }
}

// rows[i][c] <-> rows[c][i], for W rows.
template <int W, int kStride = 1>
LUMI_ALWAYS_INLINE void transpose_lanes(Lanes<W>* rows) {
  exchange_columns<W, kStride>(rows, std::make_integer_sequence<int, W>());
  if constexpr (2 * kStride < W) transpose_lanes<W, 2 * kStride>(rows);
}

// All of a or all of b, without a branch.
template <int W>
inline Lanes<W> select_lanes(bool condition, Lanes<W> a, Lanes<W> b) {
  using Ints = typename LaneTypes<W>::Ints;
  const Ints mask = Ints{} - static_cast<std::int32_t>(condition);
  return (Lanes<W>)(((Ints)a & mask) | ((Ints)b & ~mask));
}

// Bytes as floats; Byte is std::int8_t or std::uint8_t.
template <int W, class Byte>
inline Lanes<W> load_bytes(const Byte* from) {
  typename LaneTypes<W>::Ints words;
#if defined(LUMI_AVX512_LANES)
  // GCC 12 would move the bytes one by one.
  constexpr bool kSigned = static_cast<Byte>(-1) < 0;
  if constexpr (W == 16) {
    const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(from));
    const auto wide = kSigned ? _mm512_maskz_cvtepi8_epi32(0xffff, bytes) : _mm512_maskz_cvtepu8_epi32(0xffff, bytes);
    std::memcpy(&words, &wide, sizeof words);
  } else if constexpr (W == 8) {
    const __m128i bytes = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(from));
    const auto wide = kSigned ? _mm256_cvtepi8_epi32(bytes) : _mm256_cvtepu8_epi32(bytes);
    std::memcpy(&words, &wide, sizeof words);
  } else
#endif
    for (int c = 0; c < W; ++c) words[c] = from[c];
  return __builtin_convertvector(words, Lanes<W>);
}

// 1 / sqrt(a), a > 0, at least 14 bits right.
template <int W>
inline Lanes<W> reciprocal_sqrt(Lanes<W> a) {
#if defined(LUMI_AVX512_LANES)
  if constexpr (W == 16) return (Lanes<W>)_mm512_maskz_rsqrt14_ps(0xffff, (__m512)a);
  if constexpr (W == 8) return (Lanes<W>)_mm256_rsqrt14_ps((__m256)a);
  if constexpr (W == 4) return (Lanes<W>)_mm_rsqrt14_ps((__m128)a);
  if constexpr (W == 2) {  // the same bits as in wider lanes
    const auto roots = reciprocal_sqrt<4>(Lanes<4>{a[0], a[1], 1, 1});
    return Lanes<W>{roots[0], roots[1]};
  }
#endif
  Lanes<W> root;
  for (int c = 0; c < W; ++c) root[c] = __builtin_sqrtf(a[c]);
  return 1.0f / root;
}

// 1 / a to within a few roundings, a normal number: a division takes five times as long.
template <int W>
inline Lanes<W> reciprocal(Lanes<W> a) {
#if defined(LUMI_AVX512_LANES)
  if constexpr (W == 16) {
    const auto guess = (Lanes<W>)_mm512_maskz_rcp14_ps(0xffff, (__m512)a);
    return guess * (2.0f - a * guess);
  }
#endif
  return 1.0f / a;
}

// Bit c is set where a[c] > b[c].
template <int W>
inline std::uint32_t greater_bits(Lanes<W> a, Lanes<W> b) {
#if defined(LUMI_AVX512_LANES)
  if constexpr (W == 16) return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_GT_OQ);
  if constexpr (W == 8) return _mm256_cmp_ps_mask((__m256)a, (__m256)b, _CMP_GT_OQ);
  if constexpr (W == 4) return _mm_cmp_ps_mask((__m128)a, (__m128)b, _CMP_GT_OQ);
#endif
  const auto greater = a > b;
  std::uint32_t bits = 0;
  for (int c = 0; c < W; ++c) bits |= greater[c] != 0 ? 1u << c : 0u;
  return bits;
}

// Lane c takes lane c - kBy, the first kBy lanes 0.
template <int W, int kBy>
inline Lanes<W> shift_lanes_up(Lanes<W> a) {
#if defined(LUMI_AVX512_LANES)
  if constexpr (W == 16)
    return (Lanes<W>)_mm512_maskz_alignr_epi32(0xffff, (__m512i)a, _mm512_setzero_si512(), W - kBy);
  if constexpr (W == 8) return (Lanes<W>)_mm256_alignr_epi32((__m256i)a, _mm256_setzero_si256(), W - kBy);
#endif
  typename LaneTypes<W>::Ints source;
  for (int c = 0; c < W; ++c) source[c] = c < kBy ? W : c - kBy;
  return __builtin_shuffle(a, Lanes<W>{}, source);
}

// Lane c becomes the sum of lanes 0 to c.
template <int W>
inline Lanes<W> prefix_sum(Lanes<W> a) {
  a += shift_lanes_up<W, 1>(a);
  if constexpr (W > 2) a += shift_lanes_up<W, 2>(a);
  if constexpr (W > 4) a += shift_lanes_up<W, 4>(a);
  if constexpr (W > 8) a += shift_lanes_up<W, 8>(a);
  return a;
}

#else

template <int W>
struct Lanes {
  float value[W];
  LUMI_HD float& operator[](int c) { return value[c]; }
  LUMI_HD float operator[](int c) const { return value[c]; }
};

// result[c] = value(c).
template <int W, class Value>
LUMI_HD inline Lanes<W> make_lanes(const Value& value) {
  Lanes<W> lanes;
  for (int c = 0; c < W; ++c) lanes[c] = value(c);
  return lanes;
}

template <int W>
LUMI_HD inline Lanes<W> broadcast(float x) {
  return make_lanes<W>([&](int) { return x; });
}

#define LUMI_LANE_OPERATOR(op)                                                    \
  template <int W>                                                                \
  LUMI_HD inline Lanes<W> operator op(const Lanes<W>& a, const Lanes<W>& b) {     \
    return make_lanes<W>([&](int c) { return a[c] op b[c]; });                    \
  }                                                                               \
  template <int W>                                                                \
  LUMI_HD inline Lanes<W> operator op(const Lanes<W>& a, float b) {               \
    return make_lanes<W>([&](int c) { return a[c] op b; });                       \
  }                                                                               \
  template <int W>                                                                \
  LUMI_HD inline Lanes<W> operator op(float a, const Lanes<W>& b) {               \
    return make_lanes<W>([&](int c) { return a op b[c]; });                       \
  }
LUMI_LANE_OPERATOR(+)
LUMI_LANE_OPERATOR(-)
LUMI_LANE_OPERATOR(*)
LUMI_LANE_OPERATOR(/)
#undef LUMI_LANE_OPERATOR

template <int W>
LUMI_HD inline Lanes<W> load_lanes(const float* from) {
  return make_lanes<W>([&](int c) { return from[c]; });
}

template <int W>
LUMI_HD inline Lanes<W> load_first_lanes(const float* from, int count) {
  return make_lanes<W>([&](int c) { return c < count ? from[c] : 0.0f; });
}

template <int W>
LUMI_HD inline void store_lanes(const Lanes<W>& lanes, float* to) {
  for (int c = 0; c < W; ++c) to[c] = lanes[c];
}

template <int W>
LUMI_HD inline Lanes<W> abs_lanes(const Lanes<W>& a) {
  return make_lanes<W>([&](int c) { return glm::abs(a[c]); });
}

template <int W>
LUMI_HD inline Lanes<W> max_lanes(const Lanes<W>& a, const Lanes<W>& b) {
  return make_lanes<W>([&](int c) { return a[c] > b[c] ? a[c] : b[c]; });
}

template <int W>
LUMI_HD inline Lanes<W> min_lanes(const Lanes<W>& a, const Lanes<W>& b) {
  return make_lanes<W>([&](int c) { return a[c] < b[c] ? a[c] : b[c]; });
}

template <int W>
LUMI_HD inline Lanes<W> multiply_add(const Lanes<W>& a, const Lanes<W>& b, const Lanes<W>& c) {
  return make_lanes<W>([&](int k) { return std::fma(a[k], b[k], c[k]); });
}

template <int W>
LUMI_HD inline Lanes<W> keep_if_not_above(const Lanes<W>& x, const Lanes<W>& y, const Lanes<W>& a) {
  return make_lanes<W>([&](int c) { return x[c] <= y[c] ? a[c] : 0.0f; });
}

template <int W>
LUMI_HD inline Lanes<W> choose_where_greater(const Lanes<W>& a, const Lanes<W>& b, const Lanes<W>& x,
                                             const Lanes<W>& y) {
  return make_lanes<W>([&](int c) { return a[c] > b[c] ? x[c] : y[c]; });
}

template <int W>
struct IntLanes {
  std::int32_t value[W];
  LUMI_HD std::int32_t& operator[](int c) { return value[c]; }
  LUMI_HD std::int32_t operator[](int c) const { return value[c]; }
};

template <int W, class Value>
LUMI_HD inline IntLanes<W> make_int_lanes(const Value& value) {
  IntLanes<W> lanes;
  for (int c = 0; c < W; ++c) lanes[c] = value(c);
  return lanes;
}

#define LUMI_LANE_OPERATOR(op)                                                          \
  template <int W>                                                                      \
  LUMI_HD inline IntLanes<W> operator op(const IntLanes<W>& a, const IntLanes<W>& b) {  \
    return make_int_lanes<W>([&](int c) { return a[c] op b[c]; });                      \
  }                                                                                     \
  template <int W>                                                                      \
  LUMI_HD inline IntLanes<W> operator op(const IntLanes<W>& a, std::int32_t b) {        \
    return make_int_lanes<W>([&](int c) { return a[c] op b; });                         \
  }
LUMI_LANE_OPERATOR(+)
LUMI_LANE_OPERATOR(&)
LUMI_LANE_OPERATOR(|)
LUMI_LANE_OPERATOR(<<)
LUMI_LANE_OPERATOR(>>)
#undef LUMI_LANE_OPERATOR

template <int W>
LUMI_HD inline IntLanes<W> broadcast_int(std::int32_t i) {
  return make_int_lanes<W>([&](int) { return i; });
}
template <int W>
LUMI_HD inline IntLanes<W> bits_of(const Lanes<W>& a) {
  IntLanes<W> bits;
  std::memcpy(&bits, &a, sizeof bits);
  return bits;
}
template <int W>
LUMI_HD inline Lanes<W> from_bits(const IntLanes<W>& bits) {
  Lanes<W> a;
  std::memcpy(&a, &bits, sizeof a);
  return a;
}
template <int W>
LUMI_HD inline Lanes<W> to_float(const IntLanes<W>& a) {
  return make_lanes<W>([&](int c) { return static_cast<float>(a[c]); });
}
template <int W>
LUMI_HD inline IntLanes<W> load_lanes(const std::uint32_t* from) {
  return make_int_lanes<W>([&](int c) { return static_cast<std::int32_t>(from[c]); });
}
template <int W>
LUMI_HD inline void store_lanes(const IntLanes<W>& lanes, std::uint32_t* to) {
  std::memcpy(to, &lanes, sizeof lanes);
}
template <int W>
LUMI_HD inline IntLanes<W> choose_where_greater(const Lanes<W>& a, const Lanes<W>& b, const IntLanes<W>& x,
                                                const IntLanes<W>& y) {
  return make_int_lanes<W>([&](int c) { return a[c] > b[c] ? x[c] : y[c]; });
}

template <int W>
LUMI_HD inline void transpose_lanes(Lanes<W>* rows) {
  for (int i = 0; i < W; ++i)
    for (int c = 0; c < i; ++c) {
      const float other = rows[c][i];
      rows[c][i] = rows[i][c];
      rows[i][c] = other;
    }
}

template <int W>
LUMI_HD inline Lanes<W> select_lanes(bool condition, const Lanes<W>& a, const Lanes<W>& b) {
  return make_lanes<W>([&](int c) { return condition ? a[c] : b[c]; });
}

template <int W, class Byte>
LUMI_HD inline Lanes<W> load_bytes(const Byte* from) {
  return make_lanes<W>([&](int c) { return static_cast<float>(from[c]); });
}

template <int W>
LUMI_HD inline Lanes<W> reciprocal_sqrt(const Lanes<W>& a) {
  return make_lanes<W>([&](int c) { return 1.0f / glm::sqrt(a[c]); });
}

template <int W>
LUMI_HD inline Lanes<W> reciprocal(const Lanes<W>& a) {
  return 1.0f / a;
}

template <int W>
LUMI_HD inline std::uint32_t greater_bits(const Lanes<W>& a, const Lanes<W>& b) {
  std::uint32_t bits = 0;
  for (int c = 0; c < W; ++c) bits |= a[c] > b[c] ? 1u << c : 0u;
  return bits;
}

template <int W>
LUMI_HD inline Lanes<W> prefix_sum(Lanes<W> a) {
  for (int by = 1; by < W; by *= 2) {
    const Lanes<W> before = a;
    for (int c = by; c < W; ++c) a[c] = before[c] + before[c - by];
  }
  return a;
}

#endif

template <int W>
struct LaneVec3 {
  Lanes<W> x, y, z;
};

template <int W>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<W> broadcast(vec3 v) {
  return {broadcast<W>(v.x), broadcast<W>(v.y), broadcast<W>(v.z)};
}

template <int W>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<W> dot(const LaneVec3<W>& a, const LaneVec3<W>& b) {
  return multiply_add<W>(a.z, b.z, multiply_add<W>(a.y, b.y, a.x * b.x));
}

// sum + dot(a, b)
template <int W>
LUMI_HD LUMI_ALWAYS_INLINE Lanes<W> add_dot(const Lanes<W>& sum, const LaneVec3<W>& a, const LaneVec3<W>& b) {
  return multiply_add<W>(a.z, b.z, multiply_add<W>(a.y, b.y, multiply_add<W>(a.x, b.x, sum)));
}

template <int W>
LUMI_HD LUMI_ALWAYS_INLINE LaneVec3<W> abs_lanes(const LaneVec3<W>& a) {
  return {abs_lanes<W>(a.x), abs_lanes<W>(a.y), abs_lanes<W>(a.z)};
}

// Index of the lowest and of the highest bit set; bits != 0.
LUMI_HD inline int lowest_bit(std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return __ffs(static_cast<int>(bits)) - 1;
#else
  return __builtin_ctz(bits);
#endif
}
LUMI_HD inline int highest_bit(std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  return 31 - __clz(static_cast<int>(bits));
#else
  return 31 - __builtin_clz(bits);
#endif
}

}  // namespace lumigrove
