// The built-in scenes behind one table (builtin.cpp). A scene is a function from its parsed parameters to a
// Scene.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "lumigrove/scene.h"

namespace lumigrove::builtin {

// A number between `lo` and `hi` (whole unless `real`), or one of `choices` when there are any.
struct ParameterSpec {
  std::string name, default_value, description;
  double lo = 0, hi = 0;
  bool real = false;
  std::vector<std::string> choices;
};

// Checked values of every parameter of one scene.
class Parameters {
 public:
  // `query` is what follows '?': "lights=50000&seed=3". Throws Error naming `scene` and the valid parameters.
  Parameters(std::string_view scene, const std::vector<ParameterSpec>& specs, std::string_view query);

  int integer(std::string_view name) const;
  std::uint32_t seed() const { return static_cast<std::uint32_t>(integer("seed")); }
  float real(std::string_view name) const;
  const std::string& text(std::string_view name) const;

 private:
  std::map<std::string, std::string, std::less<>> values_;
};

struct Definition {
  std::string name, description;
  bool animated = false;
  std::vector<ParameterSpec> parameters;
  Scene (*make)(const Parameters&) = nullptr;
};

inline ParameterSpec seed_parameter() {
  return {"seed", "1", "random seed, 0 to 1000000", 0, 1e6, false, {}};
}

// One file each.
Definition night_city();
Definition cornell_lights();
Definition towers();
Definition colonnade();
Definition living_room();
Definition single();
Definition fireflies();

}  // namespace lumigrove::builtin
