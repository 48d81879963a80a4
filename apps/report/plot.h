// Line plots as SVG: logarithmic for convergence, linear for frames. Colours are CSS variables, light and dark; every
// line also has dashes and a marker of its own.
#pragma once

#include <string>
#include <vector>

#include "summary.h"

namespace lumigrove {

struct PlotPoint {
  double x = 0, y = 0;
  double low = kNotMeasured, high = kNotMeasured;  // of its band
};

struct Series {
  std::string name;
  int style = 0;  // colour, dashes and marker
  std::vector<PlotPoint> points;
};

enum class Unit : std::uint8_t { kNumber, kSeconds };

struct Axis {
  std::string label;
  Unit unit = Unit::kNumber;
  bool logarithmic = true;
};

struct Plot {
  std::string key;  // unique in a page
  std::string title, description;
  Axis x, y;
  std::vector<Series> series;
  double rule = kNotMeasured;  // x of a vertical line
  std::string rule_label;
  double floor = kNotMeasured;  // y below which nothing can be told apart
  std::string floor_label;
  double guide = 0;  // slope of a guide in log-log; 0: none
  std::string guide_label;
  int width = 600, height = 360;
};

// <svg> that takes its colours from plot_style() around it.
std::string plot_svg(const Plot& plot);
// A file of its own: the style inside, and a legend.
std::string standalone_svg(const Plot& plot);

// CSS: variables for both schemes (data-theme on the root element overrides), and rules of .plot.
std::string plot_style();
// A sample of a line, for legends in a page.
std::string line_sample_svg(int style);

enum class Measure : std::uint8_t { kRmse, kRelMse };

// Error of the methods measured on `light` against time or samples.
Plot convergence_plot(const Results& results, const std::string& light, Measure measure, Budget against);

// By frame at a budget, over seeds. Empty without sequences.
enum class FrameValue : std::uint8_t { kRmse, kTemporalError, kFlicker };
Plot frame_plot(const Results& results, const std::string& light, FrameValue value, Budget budget);

}  // namespace lumigrove
