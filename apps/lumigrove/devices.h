// Where Lumigrove can render.
#pragma once

#include <string>

namespace lumigrove {

std::string processor_name();  // Linux; other systems get none
std::string device_list();  // a line a device

// Throws Error listing the devices when none is called `name`.
void require_device(const std::string& name);

}  // namespace lumigrove
