// Values as the commands' JSON writes them.
#pragma once

#include <nlohmann/json.hpp>

#include "lumigrove/vec.h"

namespace lumigrove {

using Json = nlohmann::ordered_json;

inline Json json_list(vec3 v) { return Json::array({v.x, v.y, v.z}); }

}  // namespace lumigrove
