// Wall-clock time of a step, in milliseconds.
#pragma once

#include <chrono>

namespace lumigrove {

// Runs from its construction.
class Stopwatch {
 public:
  double ms() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

// Adds the time of its own life to a counter.
class ScopedTimer {
 public:
  explicit ScopedTimer(double& ms) : ms_(ms) {}
  ~ScopedTimer() { ms_ += watch_.ms(); }
  ScopedTimer(const ScopedTimer&) = delete;
  ScopedTimer& operator=(const ScopedTimer&) = delete;

 private:
  double& ms_;
  Stopwatch watch_;
};

}  // namespace lumigrove
