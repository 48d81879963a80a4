#include <fmt/format.h>

#include <cmath>

#include "base/srgb.h"
#include "device/device.h"
#include "lumigrove/image.h"

namespace lumigrove {
namespace {

// K. Narkowicz, "ACES Filmic Tone Mapping Curve", 2015: a rational fit of the ACES reference rendering
// transform. The fit includes an exposure of 1/0.6, which is taken back here.
float filmic(float linear) {
  const float x = 0.6f * linear;
  if (x > 1e4f) return 1;  // far above white; squares would overflow
  return x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f);
}

float encode(float linear, ToneCurve curve) {
  if (!(linear > 0)) return 0;  // negative or NaN
  const float display = curve == ToneCurve::kFilmic ? filmic(linear) : linear;
  return display < 1 ? linear_to_srgb(display) : 1.0f;
}

}  // namespace

ToneCurve tone_curve_from_name(const std::string& name) {
  if (name == "filmic") return ToneCurve::kFilmic;
  if (name == "srgb") return ToneCurve::kSrgb;
  throw Error(fmt::format("unknown tone curve '{}'; valid are filmic and srgb", name));
}

std::vector<float> tone_map(const std::vector<float>& rgb, const ToneMap& tone) {
  const float gain = std::exp2(tone.exposure_ev);
  std::vector<float> encoded(rgb.size());
  launch(static_cast<int>(rgb.size()), [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    encoded[at] = encode(rgb[at] * gain, tone.curve);
  });
  return encoded;
}

}  // namespace lumigrove
