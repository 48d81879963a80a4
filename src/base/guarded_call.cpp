#include "base/guarded_call.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>

namespace lumigrove {
namespace {

enum class Outcome : std::uint64_t { kNone, kResult, kError };

// In front of the answer; written last, so that a child that dies midway leaves kNone.
struct Header {
  Outcome outcome = Outcome::kNone;
  std::uint64_t bytes = 0;
};

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {
    if (fd_ < 0) throw Error(fmt::format("cannot start a reading process: {}", std::strerror(errno)));
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor() { close(); }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

bool write_all(int fd, const void* data, std::size_t size, off_t offset) {
  const char* at = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = pwrite(fd, at, size, offset);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    at += written;
    offset += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

bool read_all(int fd, void* data, std::size_t size, off_t offset) {
  char* at = static_cast<char*>(data);
  while (size > 0) {
    const ssize_t got = pread(fd, at, size, offset);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    at += got;
    offset += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

std::size_t address_space_in_use() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

void limit(int resource, rlim_t soft) {
  rlimit bounds{};
  getrlimit(static_cast<__rlimit_resource>(resource), &bounds);
  bounds.rlim_cur = std::min(soft, bounds.rlim_max);
  setrlimit(static_cast<__rlimit_resource>(resource), &bounds);
}

// Everything that the child does; never returns.
[[noreturn]] void child_main(int answer, const GuardLimits& limits, std::size_t address_space,
                             const std::function<std::vector<std::uint8_t>()>& work) {
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL})
    signal(number, SIG_DFL);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, static_cast<rlim_t>(std::ceil(limits.cpu_seconds)));
  limit(RLIMIT_AS, address_space + limits.memory_bytes);
#if !defined(__SANITIZE_ADDRESS__)  // a sanitizer's report must be seen
  const int nowhere = open("/dev/null", O_WRONLY);
  dup2(nowhere, STDOUT_FILENO);
  dup2(nowhere, STDERR_FILENO);
#endif
  std::vector<std::uint8_t> bytes;
  Header header{Outcome::kResult, 0};
  const auto fail = [&](const char* sentence) {
    header.outcome = Outcome::kError;
    bytes.assign(sentence, sentence + std::strlen(sentence));
  };
  try {
    bytes = work();
  } catch (const std::bad_alloc&) {
    fail("");
  } catch (const std::exception& error) {
    fail(error.what());
  }
  header.bytes = bytes.size();
  if (write_all(answer, bytes.data(), bytes.size(), sizeof(header)))
    write_all(answer, &header, sizeof(header), 0);
  _exit(0);  // no destructors, no exit handlers: they belong to the parent
}

// Waits until the child's end of the pipe closes, which it does when the child is gone. A child that sleeps
// instead of computing is not caught by its processor time, hence the clock here.
bool wait_for_end(int pipe_end, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(seconds);
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    pollfd watched{pipe_end, POLLIN, 0};
    const int ready = poll(&watched, 1, static_cast<int>(std::min<std::int64_t>(left, 1 << 20)));
    if (ready > 0) return true;
  }
}

std::string describe_end(int status, bool timed_out) {
  if (timed_out) return "did not come to an end";
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) return "did not come to an end";
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGINT || WTERMSIG(status) == SIGTERM))
    return "was interrupted";
  if (WIFSIGNALED(status)) return fmt::format("crashed (signal {})", WTERMSIG(status));
  return "crashed";
}

}  // namespace

std::vector<std::uint8_t> call_guarded(const std::string& what, const GuardLimits& limits,
                                       const std::function<std::vector<std::uint8_t>()>& work) {
  FileDescriptor answer(memfd_create("lumigrove", MFD_CLOEXEC));
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0)
    throw Error(fmt::format("cannot start a reading process: {}", std::strerror(errno)));
  FileDescriptor alive(ends[0]), held_by_child(ends[1]);
  const std::size_t address_space = address_space_in_use();
  const pid_t child = fork();
  if (child < 0) throw Error(fmt::format("cannot start a reading process: {}", std::strerror(errno)));
  if (child == 0) {
    alive.close();
    child_main(answer.get(), limits, address_space, work);
  }
  held_by_child.close();
  const bool timed_out = !wait_for_end(alive.get(), 10 + 10 * limits.cpu_seconds);
  if (timed_out) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }

  Header header;
  std::vector<std::uint8_t> bytes;
  const bool complete =
      read_all(answer.get(), &header, sizeof(header), 0) && header.outcome != Outcome::kNone;
  if (complete) bytes.resize(header.bytes);
  if (!complete || !read_all(answer.get(), bytes.data(), bytes.size(), sizeof(header)))
    throw Error(fmt::format("{} {}", what, describe_end(status, timed_out)));
  if (header.outcome == Outcome::kResult) return bytes;
  if (bytes.empty()) throw Error(fmt::format("{} ran out of memory", what));
  throw Error(std::string(bytes.begin(), bytes.end()));
}

}  // namespace lumigrove
