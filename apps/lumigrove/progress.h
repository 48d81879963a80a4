// Progress on stderr: of a render or of a sequence of frames, and of longer jobs.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "lumigrove/renderer.h"

namespace lumigrove {

enum class ProgressStyle {
  kSilent,
  kBar,    // one line, redrawn in place
  kPlain,  // a line every few seconds, and one at the end
  kJson,   // one JSON object a line
};

// "auto" (bar on a terminal, plain lines otherwise), "bar", "plain", "json" or "none".
ProgressStyle progress_style(const std::string& name);

// --progress NAME
void add_progress_option(CLI::App& command, std::string& name);

// One line about a job whose share of work done is known.
class ProgressLine {
 public:
  explicit ProgressLine(ProgressStyle style) : style_(style) {}
  ~ProgressLine() { end(); }  // ends the bar's line

  bool due(bool last) const;  // whether it is time to show something
  // `done`: share of the work; `fields` are the JSON style's own, beside done, elapsed_s and left_s.
  void show(double done, const std::string& text, nlohmann::json fields);
  void end();  // so that something else can be printed

 private:
  using Clock = std::chrono::steady_clock;

  double elapsed() const;
  void draw_bar(double done, const std::string& text);

  ProgressStyle style_;
  Clock::time_point start_ = Clock::now();
  double last_shown_ = -1;      // seconds after start, -1 never
  std::size_t bar_length_ = 0;  // characters on the terminal's line
};

class ProgressPrinter {
 public:
  ProgressPrinter(ProgressStyle style, int frame_count) : line_(style), frame_count_(frame_count) {}

  void begin_frame(int frame);            // number of the frame that comes next
  void update(const Progress& progress);  // of this frame
  void end_line() { line_.end(); }        // so that something else can be printed

 private:
  ProgressLine line_;
  int frame_count_, frame_ = 0, frames_begun_ = 0;
};

}  // namespace lumigrove
