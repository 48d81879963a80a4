#include "base/lane_math.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace lumigrove {
namespace {

template <class Width>
class Lane : public ::testing::Test {
 public:
  static constexpr int kWidth = Width::value;
  using Floats = Lanes<kWidth>;
  using Ints = IntLanes<kWidth>;

  static Floats floats(float first, float step) {
    Floats lanes{};
    for (int c = 0; c < kWidth; ++c) lanes[c] = first + step * static_cast<float>(c);
    return lanes;
  }
  static std::vector<std::uint32_t> words(std::uint32_t first) {
    std::vector<std::uint32_t> result;
    for (std::uint32_t c = 0; c < kWidth; ++c) result.push_back(first + c * 0x0f1e2d3cu);
    return result;
  }
};

using Widths = ::testing::Types<std::integral_constant<int, 4>, std::integral_constant<int, 8>,
                                std::integral_constant<int, 16>>;
TYPED_TEST_SUITE(Lane, Widths, );

TYPED_TEST(Lane, TransposeExchangesRowsAndColumns) {
  constexpr int W = TestFixture::kWidth;
  Lanes<W> rows[W];
  for (int i = 0; i < W; ++i)
    for (int c = 0; c < W; ++c) rows[i][c] = static_cast<float>(100 * i + c);
  transpose_lanes<W>(rows);
  for (int i = 0; i < W; ++i)
    for (int c = 0; c < W; ++c) EXPECT_EQ(rows[i][c], static_cast<float>(100 * c + i)) << i << " " << c;
}

// Words of nodes go through it that are no numbers: bits must survive, NaN and denormals too.
TYPED_TEST(Lane, TransposeKeepsEveryBit) {
  constexpr int W = TestFixture::kWidth;
  constexpr std::uint32_t kPatterns[] = {0x7f800001u, 0xffffffffu, 0x00000001u, 0x80000000u, 0x7fc12345u, 0x3f800000u};
  const auto pattern = [&](int i, int c) { return kPatterns[(i * 7 + c) % 6] ^ static_cast<std::uint32_t>(i << 8); };
  Lanes<W> rows[W];
  for (int i = 0; i < W; ++i) {
    std::uint32_t words[W];
    for (int c = 0; c < W; ++c) words[c] = pattern(i, c);
    std::memcpy(&rows[i], words, sizeof words);
  }
  transpose_lanes<W>(rows);
  for (int i = 0; i < W; ++i) {
    std::uint32_t words[W];
    std::memcpy(words, &rows[i], sizeof words);
    for (int c = 0; c < W; ++c) EXPECT_EQ(words[c], pattern(c, i)) << i << " " << c;
  }
}

TYPED_TEST(Lane, PrefixSumAddsAllBefore) {
  constexpr int W = TestFixture::kWidth;
  const Lanes<W> a = TestFixture::floats(1, 0.5f), sums = prefix_sum<W>(a);
  float sum = 0;
  for (int c = 0; c < W; ++c) EXPECT_EQ(sums[c], sum += a[c]) << c;  // all exact
}

TYPED_TEST(Lane, WholeNumbersAreLoadedAndStored) {
  constexpr int W = TestFixture::kWidth;
  const std::vector<std::uint32_t> words = TestFixture::words(0xfedcba98u);
  std::vector<std::uint32_t> stored(W);
  store_lanes<W>(load_lanes<W>(words.data()), stored.data());
  EXPECT_EQ(stored, words);
  store_lanes<W>(broadcast_int<W>(-7), stored.data());
  EXPECT_EQ(stored, std::vector<std::uint32_t>(W, static_cast<std::uint32_t>(-7)));
}

TYPED_TEST(Lane, WholeNumbersCombineAndShiftAsOrdinaryOnes) {
  constexpr int W = TestFixture::kWidth;
  const std::vector<std::uint32_t> words = TestFixture::words(0x80000001u);
  const IntLanes<W> a = load_lanes<W>(words.data()), b = broadcast_int<W>(0x00ff00f0);
  const IntLanes<W> sum = a + b, both = a & b, either = a | b, left = a << 5, right = a >> 5, low = a & 0xffff;
  for (int c = 0; c < W; ++c) {
    const std::uint32_t word = words[static_cast<std::size_t>(c)];
    EXPECT_EQ(static_cast<std::uint32_t>(sum[c]), word + 0x00ff00f0u);
    EXPECT_EQ(static_cast<std::uint32_t>(both[c]), word & 0x00ff00f0u);
    EXPECT_EQ(static_cast<std::uint32_t>(either[c]), word | 0x00ff00f0u);
    EXPECT_EQ(static_cast<std::uint32_t>(left[c]), word << 5);
    EXPECT_EQ(right[c], static_cast<std::int32_t>(word) >> 5);  // keeps the sign
    EXPECT_EQ(static_cast<std::uint32_t>(low[c]), word & 0xffffu);
  }
}

TYPED_TEST(Lane, BitsOfFloatsComeBack) {
  constexpr int W = TestFixture::kWidth;
  const Lanes<W> a = TestFixture::floats(-1.5f, 0.7f);
  const IntLanes<W> bits = bits_of<W>(a);
  const Lanes<W> back = from_bits<W>(bits), numbers = to_float<W>(bits);
  for (int c = 0; c < W; ++c) {
    const float value = a[c];
    std::int32_t expected;
    std::memcpy(&expected, &value, sizeof expected);
    EXPECT_EQ(bits[c], expected);
    EXPECT_EQ(back[c], value);
    EXPECT_EQ(numbers[c], static_cast<float>(expected));
  }
}

TYPED_TEST(Lane, ChoosingIsByLane) {
  constexpr int W = TestFixture::kWidth;
  const Lanes<W> a = TestFixture::floats(0, 1), limit = broadcast<W>(1.5f);
  const Lanes<W> chosen = choose_where_greater<W>(a, limit, broadcast<W>(10), a);
  const IntLanes<W> number = choose_where_greater<W>(a, limit, broadcast_int<W>(3), broadcast_int<W>(-4));
  const Lanes<W> kept = keep_if_not_above<W>(a, limit, a + 1.0f);
  for (int c = 0; c < W; ++c) {
    EXPECT_EQ(chosen[c], c > 1 ? 10 : static_cast<float>(c));
    EXPECT_EQ(number[c], c > 1 ? 3 : -4);
    EXPECT_EQ(kept[c], c > 1 ? 0 : static_cast<float>(c + 1));
  }
  EXPECT_EQ(greater_bits<W>(a, limit), (1u << W) - 1 - 3u);
  // NaN is not greater than anything.
  const Lanes<W> nan = broadcast<W>(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(greater_bits<W>(nan, limit), 0u);
  EXPECT_EQ((choose_where_greater<W>(nan, limit, a, limit))[0], 1.5f);
}

TYPED_TEST(Lane, BytesKeepTheirSign) {
  constexpr int W = TestFixture::kWidth;
  std::int8_t with_sign[W];
  std::uint8_t without[W];
  for (int c = 0; c < W; ++c) {
    with_sign[c] = static_cast<std::int8_t>(-128 + 17 * c);
    without[c] = static_cast<std::uint8_t>(255 - 16 * c);
  }
  const Lanes<W> a = load_bytes<W>(with_sign), b = load_bytes<W>(without);
  for (int c = 0; c < W; ++c) {
    EXPECT_EQ(a[c], static_cast<float>(with_sign[c]));
    EXPECT_EQ(b[c], static_cast<float>(without[c]));
  }
}

TYPED_TEST(Lane, ReciprocalRootsHaveFourteenBits) {
  constexpr int W = TestFixture::kWidth;
  for (const float first : {1e-30f, 1e-4f, 1.0f, 1e20f}) {
    const Lanes<W> a = TestFixture::floats(first, 0.37f * first), root = reciprocal_sqrt<W>(a);
    for (int c = 0; c < W; ++c)
      EXPECT_NEAR(static_cast<double>(root[c]) * std::sqrt(static_cast<double>(a[c])), 1, 0x1p-14);
  }
}

TYPED_TEST(Lane, LoadingTheFirstLeavesTheOthersZero) {
  constexpr int W = TestFixture::kWidth;
  for (int count = 0; count <= W; ++count) {
    const std::vector<float> from(static_cast<std::size_t>(count), 2.5f);  // no more may be read
    const Lanes<W> lanes = load_first_lanes<W>(from.data(), count);
    for (int c = 0; c < W; ++c) EXPECT_EQ(lanes[c], c < count ? 2.5f : 0.0f);
  }
}

TYPED_TEST(Lane, FunctionsAreThoseOfTheStandardLibrary) {
  constexpr int W = TestFixture::kWidth;
  for (int k = 0; k < 4000; ++k) {
    const auto share = static_cast<float>(k) / 4000;
    const Lanes<W> u = TestFixture::floats(share, 1e-5f);
    const Lanes<W> a = TestFixture::floats(std::exp(60 * share - 30), 1e-7f);
    Lanes<W> sine, cosine;
    sine_cosine_of_turns<W>(u, sine, cosine);
    const Lanes<W> log = log_lanes<W>(a), root = inverse_sqrt<W>(a);
    for (int c = 0; c < W; ++c) {
      const double turn = 2 * M_PI * static_cast<double>(u[c]), value = static_cast<double>(a[c]);
      ASSERT_NEAR(sine[c], std::sin(turn), 4e-6) << u[c];
      ASSERT_NEAR(cosine[c], std::cos(turn), 4e-6) << u[c];
      ASSERT_NEAR(log[c], std::log(value), 1e-6 * std::max(1.0, std::abs(std::log(value)))) << a[c];
      ASSERT_NEAR(static_cast<double>(root[c]) * std::sqrt(value), 1, 1e-6) << a[c];
    }
  }
}

TYPED_TEST(Lane, DotAddsThreeProducts) {
  constexpr int W = TestFixture::kWidth;
  const LaneVec3<W> a{TestFixture::floats(1, 1), TestFixture::floats(-2, 1), TestFixture::floats(3, -1)};
  const LaneVec3<W> b = broadcast<W>(vec3(2, 3, -4));
  const Lanes<W> product = dot<W>(a, b), size = dot<W>(abs_lanes<W>(a), abs_lanes<W>(b));
  const Lanes<W> more = add_dot<W>(broadcast<W>(5), a, b);
  for (int c = 0; c < W; ++c) {
    const vec3 v(a.x[c], a.y[c], a.z[c]);
    EXPECT_EQ(product[c], glm::dot(v, vec3(2, 3, -4)));
    EXPECT_EQ(more[c], glm::dot(v, vec3(2, 3, -4)) + 5);
    EXPECT_EQ(size[c], glm::dot(glm::abs(v), vec3(2, 3, 4)));
  }
}

}  // namespace
}  // namespace lumigrove
