#include "machine.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <ctime>
#include <thread>

#include "devices.h"

namespace lumigrove {
Machine this_machine(int threads) {
  Machine machine;
  machine.processor = processor_name();
  utsname system{};
  if (uname(&system) == 0) machine.system = fmt::format("{} {} {}", system.sysname, system.release, system.machine);
  machine.cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  machine.threads = threads > 0 ? threads : machine.cores;
  machine.memory_bytes = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
  return machine;
}

std::string utc_now() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

}  // namespace lumigrove
