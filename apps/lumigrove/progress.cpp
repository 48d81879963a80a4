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

double ProgressLine::elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

bool ProgressLine::due(bool last) const {
  if (style_ == ProgressStyle::kSilent) return false;
  if (last) return true;
  if (last_shown_ < 0 && style_ != ProgressStyle::kPlain) return true;
  return elapsed() - std::max(last_shown_, 0.0) >= interval_of(style_);
}

void ProgressLine::show(double done, const std::string& text, nlohmann::json fields) {
  const double seconds = elapsed();
  last_shown_ = seconds;
  if (style_ == ProgressStyle::kBar) {
    draw_bar(done, text);
  } else if (style_ == ProgressStyle::kJson) {
    fields["done"] = done;
    fields["elapsed_s"] = seconds;
    fields["left_s"] = remaining(done, seconds);
    fmt::print(stderr, "{}\n", fields.dump());
  } else if (style_ == ProgressStyle::kPlain) {
    fmt::print(stderr, "{:3.0f}%  {}, {} elapsed{}\n", 100 * done, text, clock_text(seconds), left_text(done, seconds));
  }
}

void ProgressLine::draw_bar(double done, const std::string& text) {
  const int filled = static_cast<int>(done * kBarWidth);
  std::string line = fmt::format("[{}{}] {:3.0f}%  {}{}", std::string(filled, '#'), std::string(kBarWidth - filled, '-'),
                                 100 * done, text, left_text(done, elapsed()));
  const std::size_t length = line.size();
  if (length < bar_length_) line.append(bar_length_ - length, ' ');  // over the rest of a longer line
  bar_length_ = length;
  fmt::print(stderr, "\r{}", line);
  std::fflush(stderr);
}

void ProgressLine::end() {
  if (bar_length_ > 0) std::fputs("\n", stderr);
  bar_length_ = 0;
}

void ProgressPrinter::begin_frame(int frame) {
  frame_ = frame;
  ++frames_begun_;
}

void ProgressPrinter::update(const Progress& progress) {
  const bool last = progress.spp_done >= progress.spp_total && frames_begun_ == frame_count_;
  if (!line_.due(last)) return;
  const double in_frame =
      progress.spp_total > 0 ? static_cast<double>(progress.spp_done) / progress.spp_total : 1;
  std::string counts = fmt::format("{}/{} spp", progress.spp_done, progress.spp_total);
  if (frame_count_ > 1)
    counts = fmt::format("frame {} ({}/{}), {}", frame_, frames_begun_, frame_count_, counts);
  line_.show((frames_begun_ - 1 + in_frame) / frame_count_, counts,
             {{"frame", frame_},
              {"frames_done", frames_begun_ - 1},
              {"frames_total", frame_count_},
              {"spp_done", progress.spp_done},
              {"spp_total", progress.spp_total}});
}

}  // namespace lumigrove
