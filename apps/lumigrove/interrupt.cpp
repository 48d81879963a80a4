#include "interrupt.h"

#include <unistd.h>

#include <atomic>
#include <csignal>

namespace lumigrove {
namespace {

std::atomic<int> received_signal{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal handler may touch nothing else");

constexpr char kNotice[] = "\nfinishing this sample; once more to quit at once\n";
std::atomic<bool> give_notice{false};

// Calls only what POSIX allows in a signal handler.
void remember(int signal_number) {
  received_signal = signal_number;
  std::signal(signal_number, SIG_DFL);
  if (give_notice && write(STDERR_FILENO, kNotice, sizeof(kNotice) - 1) < 0) give_notice = false;
}

}  // namespace

InterruptGuard::InterruptGuard() {
  received_signal = 0;
  give_notice = isatty(STDERR_FILENO) != 0;
  old_interrupt_ = std::signal(SIGINT, remember);
  old_terminate_ = std::signal(SIGTERM, remember);
}

InterruptGuard::~InterruptGuard() {
  std::signal(SIGINT, old_interrupt_);
  std::signal(SIGTERM, old_terminate_);
}

bool InterruptGuard::interrupted() const { return received_signal != 0; }
int InterruptGuard::exit_status() const { return 128 + received_signal; }

}  // namespace lumigrove
