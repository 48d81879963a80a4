#include "devices.h"

#include <fmt/format.h>

#include <fstream>
#include <thread>

#include "lumigrove/error.h"

namespace lumigrove {
namespace {

constexpr const char* kCpu = "cpu";

}  // namespace

std::string processor_name() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.starts_with("model name")) return line.substr(std::min(line.find(':') + 2, line.size()));
  return "processor of unknown name";
}

std::string device_list() {
  return fmt::format("{}  {}, {} threads\n", kCpu, processor_name(), std::thread::hardware_concurrency());
}

void require_device(const std::string& name) {
  if (name != kCpu) throw Error(fmt::format("unknown device '{}'; this build has {}", name, kCpu));
}

}  // namespace lumigrove
