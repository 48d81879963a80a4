#include "progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string_view>

namespace lumigrove {
namespace {

constexpr double kBarInterval = 0.1;    // s between redraws
constexpr double kPlainInterval = 5.0;  // s between lines
constexpr double kJsonInterval = 0.5;
constexpr int kBarWidth = 24;  // characters

bool stderr_is_terminal() {
  const char* terminal = std::getenv("TERM");
  return isatty(STDERR_FILENO) && terminal && std::string_view(terminal) != "dumb";
}

double interval_of(ProgressStyle style) {
  if (style == ProgressStyle::kBar) return kBarInterval;
  return style == ProgressStyle::kJson ? kJsonInterval : kPlainInterval;
}

std::string clock_text(double seconds) {
  const auto whole = static_cast<long long>(seconds + 0.5);
  if (whole >= 3600) return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

double remaining(double done, double elapsed) { return done > 0 ? elapsed * (1 - done) / done : 0; }

// ", 0:12 left", or nothing at the end.
std::string left_text(double done, double elapsed) {
  return done < 1 ? fmt::format(", {} left", clock_text(remaining(done, elapsed))) : std::string();
}

}  // namespace

ProgressStyle progress_style(const std::string& name) {
  if (name == "auto") return stderr_is_terminal() ? ProgressStyle::kBar : ProgressStyle::kPlain;
  if (name == "bar") return ProgressStyle::kBar;
  if (name == "plain") return ProgressStyle::kPlain;
  if (name == "json") return ProgressStyle::kJson;
  if (name == "none") return ProgressStyle::kSilent;
  throw Error(fmt::format("--progress is '{}', but must be auto, bar, plain, json or none", name));
}

void add_progress_option(CLI::App& command, std::string& name) {
  command
      .add_option("--progress", name, "auto, bar, plain, json or none (default auto: a bar on a terminal)")
      ->check(CLI::IsMember({"auto", "bar", "plain", "json", "none"}));
}

ProgressPrinter::ProgressPrinter(ProgressStyle style, int frame_count)
    : style_(style), frame_count_(frame_count) {}

ProgressPrinter::~ProgressPrinter() { end_line(); }

void ProgressPrinter::end_line() {
  if (bar_length_ > 0) std::fputs("\n", stderr);
  bar_length_ = 0;
}

void ProgressPrinter::begin_frame(int frame) {
  frame_ = frame;
  ++frames_begun_;
}

void ProgressPrinter::update(const Progress& progress) {
  if (style_ == ProgressStyle::kSilent) return;
  const double elapsed = std::chrono::duration<double>(Clock::now() - start_).count();
  const double in_frame =
      progress.spp_total > 0 ? static_cast<double>(progress.spp_done) / progress.spp_total : 1;
  const double done = (frames_begun_ - 1 + in_frame) / frame_count_;
  const bool last = progress.spp_done >= progress.spp_total && frames_begun_ == frame_count_;
  const double since = last_shown_ < 0 && style_ == ProgressStyle::kPlain ? elapsed : elapsed - last_shown_;
  const bool due = since >= interval_of(style_) || (last_shown_ < 0 && style_ != ProgressStyle::kPlain);
  if (!due && !last) return;
  last_shown_ = elapsed;

  std::string counts = fmt::format("{}/{} spp", progress.spp_done, progress.spp_total);
  if (frame_count_ > 1)
    counts = fmt::format("frame {} ({}/{}), {}", frame_, frames_begun_, frame_count_, counts);
  if (style_ == ProgressStyle::kBar)
    draw_bar(done, elapsed, counts);
  else if (style_ == ProgressStyle::kJson)
    print_json(progress, done, elapsed);
  else
    fmt::print(stderr, "{:3.0f}%  {}, {} elapsed{}\n", 100 * done, counts, clock_text(elapsed),
               left_text(done, elapsed));
}

void ProgressPrinter::draw_bar(double done, double elapsed, const std::string& counts) {
  const int filled = static_cast<int>(done * kBarWidth);
  std::string line =
      fmt::format("[{}{}] {:3.0f}%  {}{}", std::string(filled, '#'), std::string(kBarWidth - filled, '-'),
                  100 * done, counts, left_text(done, elapsed));
  const std::size_t length = line.size();
  if (length < bar_length_) line.append(bar_length_ - length, ' ');  // over the rest of a longer line
  bar_length_ = length;
  fmt::print(stderr, "\r{}", line);
  std::fflush(stderr);
}

void ProgressPrinter::print_json(const Progress& progress, double done, double elapsed) const {
  const nlohmann::json line = {{"frame", frame_},
                               {"frames_done", frames_begun_ - 1},
                               {"frames_total", frame_count_},
                               {"spp_done", progress.spp_done},
                               {"spp_total", progress.spp_total},
                               {"done", done},
                               {"elapsed_s", elapsed},
                               {"left_s", remaining(done, elapsed)}};
  fmt::print(stderr, "{}\n", line.dump());
}

}  // namespace lumigrove
