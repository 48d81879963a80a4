// Runs code that may crash, hang or eat all memory on hostile input (a third-party parser) in a child
// process.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "lumigrove/error.h"

namespace lumigrove {

struct GuardLimits {
  double cpu_seconds = 10;                          // processor time of the child
  std::size_t memory_bytes = std::size_t{4} << 30;  // address space beyond what this process has already
};

// The bytes that `work` returns in a forked child. An Error thrown by `work` is thrown here with the same
// sentence. When the child dies otherwise, throws Error "<what> ...", for example "model.fbx: Assimp crashed
// reading it (signal 11)" for what = "model.fbx: Assimp". Nothing else that `work` does is seen by this
// process. `work` must not use threads, locks shared with threads, or the graphics processor; its output to
// the terminal is discarded.
std::vector<std::uint8_t> call_guarded(const std::string& what, const GuardLimits& limits,
                                       const std::function<std::vector<std::uint8_t>()>& work);

}  // namespace lumigrove
