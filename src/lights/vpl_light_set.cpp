#include "lights/vpl_light_set.h"

#include "base/stopwatch.h"
#include "device/device.h"
#include "device/reduce.h"
#include "lights/emitter.h"
#include "lights/vpl_emitter_kernel.h"

namespace lumigrove {

void VplLightSet::gather(const VplView& vpls, float clamp) {
  LightView nothing;
  nothing.diagonal = vpls.diagonal;
  gather_behind(nothing, vpls, clamp);
}

void VplLightSet::gather_behind(const LightView& lights, const VplView& vpls, float clamp) {
  const Stopwatch watch;
  const std::size_t first = lights.emitters.size();
  emitters_.resize(first + vpls.vpls.size());
  const std::span<Emitter> all(emitters_);
  launch(
      static_cast<int>(first),
      [&](int i) { all[static_cast<std::size_t>(i)] = lights.emitters[static_cast<std::size_t>(i)]; }, 4096);
  launch(static_cast<int>(vpls.vpls.size()), VplEmitterKernel{vpls.vpls, all.subspan(first)}, 4096);

  view_ = lights;
  view_.emitters = emitters_;
  view_.vpls = vpls.vpls;
  view_.vpl_clamp = clamp;
  if (!vpls.vpls.empty()) view_.bounds = unite(lights.bounds, vpls.bounds);
  const double flux = reduce(
      static_cast<int>(vpls.vpls.size()), 0.0,
      [&](int i) { return static_cast<double>(emitter_flux(view_, static_cast<std::uint32_t>(first) + i)); },
      [](double a, double b) { return a + b; });
  view_.local_flux = static_cast<float>(static_cast<double>(lights.local_flux) + flux);
  gather_ms_ = watch.ms();
}

}  // namespace lumigrove
