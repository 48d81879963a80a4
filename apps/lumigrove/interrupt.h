// Ctrl-C (SIGINT) and SIGTERM while something worth keeping is being made.
#pragma once

namespace lumigrove {

// While one lives, the first signal only sets a mark (and says so on a terminal); a second one ends the
// program at once, as without the guard.
class InterruptGuard {
 public:
  InterruptGuard();
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;

  bool interrupted() const;
  int exit_status() const;  // 128 + signal, as shells report it

 private:
  void (*old_interrupt_)(int);
  void (*old_terminate_)(int);
};

}  // namespace lumigrove
