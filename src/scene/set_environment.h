// An environment light given by hand, for files that cannot hold one.
#pragma once

#include <string>

#include "lumigrove/scene.h"

namespace lumigrove {

// `text`: "r,g,b" (constant radiance, W/(sr m^2)) or an equirectangular image file, linear unless 8 bits
// deep. Replaces the scene's environment. Throws Error naming `text`.
void set_environment(Scene& scene, const std::string& text);

}  // namespace lumigrove
