// A method at work on one moment of a scene: one camera sample after another, with a clock that runs only while it
// works.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frame/frame.h"
#include "metrics/metrics.h"
#include "results.h"

namespace lumigrove {

// What methods are measured by: light that surfaces reflect. Emission that the camera sees directly no method samples; its
// noise along the edges of bright lights is the same for all and would drown their differences.
inline constexpr const char* kAllLight = "all light";        // direct and indirect
inline constexpr const char* kDirectLight = "direct light";  // all that a method without transport finds
// or the name of a layer.

class Contestant {
 public:
  // `scene` must outlive it. Throws Error as make_world does.
  Contestant(const Scene& scene, std::shared_ptr<Geometry> geometry, const Settings& settings);

  // Seconds that a camera sample takes, by two small ones; they also warm caches and buffers.
  double predict_sample_s();

  // Forgets the image and the clock. What the method builds over the scene's lights is built anew, on the clock.
  void begin(std::uint32_t seed);
  void sample();  // one more camera sample of the whole image

  std::uint64_t emitters() const { return world_->lights.view().emitters.size(); }
  int spp() const { return spp_; }
  double seconds() const { return build_s_ + samples_s_; }
  double median_sample_s() const;
  double rays() const;
  RgbImage image(const std::string& light) const;  // the mean so far; spp() > 0
  RgbImage part(vec3 FilmPixel::*light) const;     // direct, indirect or emission
  const Settings& settings() const { return settings_; }

  // Times, rays and sizes since `begin`.
  void describe(Run& run) const;

 private:
  double time_small_sample(int divisor);

  Settings settings_;
  std::unique_ptr<World> world_;
  std::unique_ptr<Film> film_;
  RenderStats stats_;
  int spp_ = 0;
  double build_s_ = 0, samples_s_ = 0;
  std::vector<double> sample_s_;
};

}  // namespace lumigrove
