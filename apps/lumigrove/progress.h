// Progress of a render or of a sequence of frames, on stderr.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
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

class ProgressPrinter {
 public:
  ProgressPrinter(ProgressStyle style, int frame_count);
  ~ProgressPrinter();  // ends the bar's line

  void begin_frame(int frame);            // number of the frame that comes next
  void update(const Progress& progress);  // of this frame
  void end_line();                        // so that something else can be printed

 private:
  using Clock = std::chrono::steady_clock;

  void draw_bar(double done, double elapsed, const std::string& counts);
  void print_json(const Progress& progress, double done, double elapsed) const;

  ProgressStyle style_;
  int frame_count_, frame_ = 0, frames_begun_ = 0;
  Clock::time_point start_ = Clock::now();
  double last_shown_ = -1;      // seconds after start, -1 never
  std::size_t bar_length_ = 0;  // characters on the terminal's line
};

}  // namespace lumigrove
