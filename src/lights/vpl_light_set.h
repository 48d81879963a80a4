// Virtual point lights as a light set, alone or behind the emitters of a scene: whatever chooses among emitters then
// chooses among them.
#pragma once

#include <cstddef>

#include "base/large_array.h"
#include "lights/light_set.h"

namespace lumigrove {

class VplLightSet {
 public:
  // Keeps references to the lights. `clamp`: most of cos / d^2 at a virtual point light, 1/m^2.
  void gather(const VplView& vpls, float clamp);
  // The same behind `lights`, whose emitters keep their numbers.
  void gather_behind(const LightView& lights, const VplView& vpls, float clamp);

  LightView view() const { return view_; }
  std::size_t bytes() const { return emitters_.size() * sizeof(Emitter); }
  double gather_ms() const { return gather_ms_; }

 private:
  LargeArray<Emitter> emitters_;
  LightView view_;
  double gather_ms_ = 0;
};

}  // namespace lumigrove
