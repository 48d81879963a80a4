// Virtual point lights as emitters of a light set.
#pragma once

#include <span>

#include "lights/light_set.h"

namespace lumigrove {

LUMI_HD inline Emitter vpl_emitter(const Vpl& vpl, std::uint32_t index) {
  return {vpl.position, vpl.normal, vpl.intensity, Emitter::kVpl | index};
}

struct VplEmitterKernel {
  std::span<const Vpl> vpls;
  std::span<Emitter> emitters;

  LUMI_HD void operator()(int i) const {
    const auto k = static_cast<std::size_t>(i);
    emitters[k] = vpl_emitter(vpls[k], static_cast<std::uint32_t>(i));
  }
};

}  // namespace lumigrove
