#include "plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "html.h"

namespace lumigrove {
namespace {

// --- looks ---------------------------------------------------------------------------------------------------------

constexpr int kStyles = 10;

// Contrast at least 4.5 with the page, so that labels can have the colours of their lines.
struct StyleColors {
  const char *light, *dark;
};
constexpr std::array<StyleColors, kStyles> kColors = {{{"#0067b0", "#62b8f5"},
                                                       {"#b84300", "#ff9a5c"},
                                                       {"#00755a", "#3ddbab"},
                                                       {"#8f2f86", "#e99ddb"},
                                                       {"#7a5c00", "#edc645"},
                                                       {"#a3123f", "#ff8298"},
                                                       {"#00707c", "#63dbe8"},
                                                       {"#4f45b8", "#b0a8ff"},
                                                       {"#52606d", "#b9c3ce"},
                                                       {"#4d6b00", "#bfd860"}}};
constexpr std::array<const char*, 5> kDashes = {"", "7 3", "2 3", "9 3 2 3", "12 4"};

std::string variables(bool dark) {
  std::string text = dark ? "--plot-ink:#e6e9ed;--plot-soft:#a9b2bc;--plot-grid:#343b44;--plot-ground:#15191e;"
                          : "--plot-ink:#1c2126;--plot-soft:#56616b;--plot-grid:#e3e7eb;--plot-ground:#ffffff;";
  for (std::size_t i = 0; i < kColors.size(); ++i)
    text += fmt::format("--line-{}:{};", i, dark ? kColors[i].dark : kColors[i].light);
  return text;
}

// The marker of a style around (x, y).
std::string marker(int style, double x, double y) {
  constexpr double r = 3.2;
  switch (style % 5) {
    case 0: return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\"/>", x, y, r);
    case 1: return fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"5.8\" height=\"5.8\"/>", x - 2.9, y - 2.9);
    case 2: return fmt::format("<path d=\"M{:.1f} {:.1f}l3.8 6.6h-7.6z\"/>", x, y - 4.2);
    case 3: return fmt::format("<path d=\"M{:.1f} {:.1f}l4.2 4.2l-4.2 4.2l-4.2 -4.2z\"/>", x, y - 4.2);
    default: return fmt::format("<path d=\"M{:.1f} {:.1f}l3.8 -6.6h-7.6z\"/>", x, y + 4.2);
  }
}

std::string dash_attribute(int style) {
  const char* dash = kDashes[static_cast<std::size_t>(style / 2 % 5)];
  return *dash ? fmt::format(" stroke-dasharray=\"{}\"", dash) : "";
}

// --- scales --------------------------------------------------------------------------------------------------------

struct Tick {
  double value = 0;
  bool labelled = true;
};

// From values to pixels.
struct Scale {
  double low = 0, high = 1;        // of the axis, logarithms of them when it is logarithmic
  double from = 0, to = 1;         // pixels
  bool logarithmic = true;
  double operator()(double value) const {
    const double t = ((logarithmic ? std::log10(value) : value) - low) / (high - low);
    return from + t * (to - from);
  }
  bool holds(double value) const {
    if (!is_number(value) || (logarithmic && !(value > 0))) return false;
    const double v = logarithmic ? std::log10(value) : value;
    return v >= low - 1e-9 && v <= high + 1e-9;
  }
};

// 1, 2 or 5 times a power of ten, at least `step`.
double nice_step(double step) {
  const double decade = std::pow(10, std::floor(std::log10(step)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (factor * decade >= step * 0.999) return factor * decade;
  return 10 * decade;
}

// Covers the values, with some air around them.
Scale scale_of(const std::vector<double>& values, bool logarithmic, double from, double to) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : values) {
    if (!is_number(value) || (logarithmic && !(value > 0))) continue;
    const double v = logarithmic ? std::log10(value) : value;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  if (!(low <= high)) low = high = 0;
  if (high - low < (logarithmic ? 0.3 : 1e-12)) {  // one value: half a decade around it
    const double half = logarithmic ? 0.25 : std::max(0.5, std::abs(high) * 0.1);
    low -= half;
    high += half;
  }
  const double air = 0.04 * (high - low);
  if (!logarithmic && low >= 0 && low < 0.5 * high) low = air;  // from zero where zero is near
  return {low - air, high + air, from, to, logarithmic};
}

std::vector<Tick> log_ticks(const Scale& scale) {
  std::vector<Tick> ticks;
  const bool label_minor = scale.high - scale.low < (scale.from > scale.to ? 2.6 : 1.7);  // upwards there is more room
  for (int decade = static_cast<int>(std::floor(scale.low)); decade <= scale.high; ++decade)
    for (int digit = 1; digit < 10; ++digit) {
      const double value = digit * std::pow(10.0, decade);
      if (scale.holds(value)) ticks.push_back({value, digit == 1 || (label_minor && (digit == 2 || digit == 5))});
    }
  return ticks;
}

std::vector<Tick> linear_ticks(const Scale& scale) {
  std::vector<Tick> ticks;
  const double step = nice_step((scale.high - scale.low) / 6);
  for (double value = std::ceil(scale.low / step) * step; value <= scale.high; value += step)
    ticks.push_back({std::abs(value) < 1e-9 * step ? 0 : value});
  return ticks;
}

std::vector<Tick> ticks_of(const Scale& scale) { return scale.logarithmic ? log_ticks(scale) : linear_ticks(scale); }

std::string tick_text(double value, Unit unit) {
  if (unit == Unit::kSeconds && value < 0.99) return fmt::format("{:.6g} ms", value * 1e3);
  if (unit == Unit::kSeconds) return fmt::format("{:.6g} s", value);
  return fmt::format("{:.6g}", value);
}

// --- parts ---------------------------------------------------------------------------------------------------------

struct Frame {
  Scale x, y;
  double left, right, top, bottom;
};

std::vector<double> all_x(const Plot& plot) {
  std::vector<double> values = {plot.rule};
  for (const Series& series : plot.series)
    for (const PlotPoint& point : series.points) values.push_back(point.x);
  return values;
}

// The low ends of wide bands may be anywhere, below zero too; what is above a fifth of the value counts.
std::vector<double> all_y(const Plot& plot) {
  std::vector<double> values;
  for (const Series& series : plot.series)
    for (const PlotPoint& point : series.points) {
      values.insert(values.end(), {point.y, point.high});
      if (!plot.y.logarithmic || point.low > 0.2 * point.y) values.push_back(point.low);
    }
  if (is_number(plot.floor) && plot.floor > 0) {
    double least = plot.floor;
    for (const double value : values)
      if (value > 0) least = std::min(least, value);
    values.push_back(std::max(plot.floor * 0.8, least * 0.2));  // far below all lines it would waste the plot
  }
  return values;
}

Frame frame_of(const Plot& plot) {
  std::size_t longest = 4;
  for (const Series& series : plot.series) longest = std::max(longest, std::min<std::size_t>(series.name.size(), 18));
  Frame frame{};
  frame.left = 66;
  frame.right = plot.width - 24 - 7.6 * static_cast<double>(longest);
  frame.top = 18;
  frame.bottom = plot.height - 42;
  frame.x = scale_of(all_x(plot), plot.x.logarithmic, frame.left, frame.right);
  frame.y = scale_of(all_y(plot), plot.y.logarithmic, frame.bottom, frame.top);
  return frame;
}

std::string axes_svg(const Plot& plot, const Frame& f) {
  std::string grid, labels;
  for (const Tick& tick : ticks_of(f.x)) {
    const double x = f.x(tick.value);
    grid += fmt::format("<path class=\"{}\" d=\"M{:.1f} {:.1f}V{:.1f}\"/>", tick.labelled ? "major" : "minor", x, f.top,
                        f.bottom);
    if (tick.labelled)
      labels += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>", x, f.bottom + 16,
                            tick_text(tick.value, plot.x.unit));
  }
  for (const Tick& tick : ticks_of(f.y)) {
    const double y = f.y(tick.value);
    grid += fmt::format("<path class=\"{}\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>", tick.labelled ? "major" : "minor", f.left, y,
                        f.right);
    if (tick.labelled)
      labels += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>", f.left - 7, y + 4,
                            tick_text(tick.value, plot.y.unit));
  }
  const double middle = (f.top + f.bottom) / 2;
  labels += fmt::format("<text class=\"axis\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>",
                        (f.left + f.right) / 2, f.bottom + 34, escape_html(plot.x.label));
  labels += fmt::format("<text class=\"axis\" x=\"14\" y=\"{0:.1f}\" text-anchor=\"middle\" transform=\"rotate(-90 14 "
                        "{0:.1f})\">{1}</text>",
                        middle, escape_html(plot.y.label));
  return fmt::format("<g class=\"grid\">{}</g><g class=\"ticks\">{}</g>", grid, labels);
}

std::string rule_svg(const Plot& plot, const Frame& f) {
  if (!f.x.holds(plot.rule)) return "";
  const double x = f.x(plot.rule);
  const bool at_end = x > f.right - 90;
  return fmt::format("<g class=\"rule\"><path d=\"M{0:.1f} {1:.1f}V{2:.1f}\"/><text x=\"{3:.1f}\" y=\"{4:.1f}\" "
                     "text-anchor=\"{5}\">{6}</text></g>",
                     x, f.top, f.bottom, x + (at_end ? -5 : 5), f.top + 11, at_end ? "end" : "start",
                     escape_html(plot.rule_label));
}

std::string floor_svg(const Plot& plot, const Frame& f) {
  if (!f.y.holds(plot.floor)) return "";
  const double y = f.y(plot.floor);
  return fmt::format(
      "<pattern id=\"{0}-hatch\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\">"
      "<path class=\"hatch\" d=\"M0 0V6\"/></pattern><g class=\"floor\"><rect x=\"{1:.1f}\" y=\"{2:.1f}\" width=\"{3:.1f}\" "
      "height=\"{4:.1f}\" fill=\"url(#{0}-hatch)\"/><path d=\"M{1:.1f} {2:.1f}h{3:.1f}\"/><text x=\"{5:.1f}\" "
      "y=\"{6:.1f}\">{7}</text></g>",
      escape_html(plot.key), f.left, y, f.right - f.left, std::max(0.0, f.bottom - y), f.left + 6, y - 5,
      escape_html(plot.floor_label));
}

// A line of the given slope in the empty corner above falling curves.
std::string guide_svg(const Plot& plot, const Frame& f) {
  if (plot.guide == 0) return "";
  const double x0 = 0.52, x1 = 0.8;  // of the width
  const double log_x0 = f.x.low + x0 * (f.x.high - f.x.low), log_x1 = f.x.low + x1 * (f.x.high - f.x.low);
  const double top = f.y.high - 0.07 * (f.y.high - f.y.low);
  const double fall = plot.guide * (log_x1 - log_x0);
  const auto pixel_y = [&](double v) { return f.y.from + (v - f.y.low) / (f.y.high - f.y.low) * (f.y.to - f.y.from); };
  const double left = f.left + x0 * (f.right - f.left), right = f.left + x1 * (f.right - f.left);
  const double end = std::min(pixel_y(top + fall), f.bottom);
  return fmt::format("<g class=\"guide\"><path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\"/><text x=\"{:.1f}\" y=\"{:.1f}\">{}</text></g>",
                     left, pixel_y(top), right, end, right + 5, end + 4, escape_html(plot.guide_label));
}

double inside(const Frame& f, double y) { return std::clamp(f.y.holds(y) ? f.y(y) : f.bottom, f.top, f.bottom); }

std::string band_svg(const Series& series, const Frame& f) {
  std::string above, below;
  for (const PlotPoint& point : series.points) {
    if (!is_number(point.low) || !f.x.holds(point.x)) continue;
    above += fmt::format("{}{:.1f} {:.1f}", above.empty() ? "M" : "L", f.x(point.x), inside(f, point.high));
    below = fmt::format("L{:.1f} {:.1f}", f.x(point.x), inside(f, point.low)) + below;
  }
  return above.empty() ? "" : fmt::format("<path class=\"band\" d=\"{}{}Z\"/>", above, below);
}

std::string line_svg(const Series& series, const Frame& f) {
  std::string path, markers;
  for (const PlotPoint& point : series.points) {
    if (!f.x.holds(point.x) || !f.y.holds(point.y)) continue;
    const double x = f.x(point.x), y = f.y(point.y);
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x, y);
    markers += marker(series.style, x, y);
  }
  return path.empty() ? "" : fmt::format("<path class=\"line\"{} d=\"{}\"/><g class=\"marks\">{}</g>",
                                         dash_attribute(series.style), path, markers);
}

// Names at the ends of the lines, moved apart where they would overlap.
struct EndLabel {
  std::size_t series = 0;
  double x = 0, y = 0;  // end of the line
  double at = 0;        // height of the label
};

std::vector<EndLabel> end_labels(const Plot& plot, const Frame& f) {
  constexpr double kLeading = 14;
  std::vector<EndLabel> labels;
  for (std::size_t s = 0; s < plot.series.size(); ++s)
    for (auto point = plot.series[s].points.rbegin(); point != plot.series[s].points.rend(); ++point)
      if (f.x.holds(point->x) && f.y.holds(point->y)) {
        labels.push_back({s, f.x(point->x), f.y(point->y), f.y(point->y)});
        break;
      }
  std::stable_sort(labels.begin(), labels.end(), [](const EndLabel& a, const EndLabel& b) { return a.y < b.y; });
  for (std::size_t i = 1; i < labels.size(); ++i) labels[i].at = std::max(labels[i].at, labels[i - 1].at + kLeading);
  double limit = f.bottom;
  for (auto label = labels.rbegin(); label != labels.rend(); ++label, limit -= kLeading)
    label->at = std::min(label->at, limit);
  return labels;
}

std::string short_name(const std::string& name) {
  return name.size() <= 18 ? name : name.substr(0, 17) + "…";
}

std::string label_svg(const Plot& plot, const Frame& f, const EndLabel& label) {
  const Series& series = plot.series[label.series];
  return fmt::format("<path class=\"leader\" d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\"/><text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>",
                     label.x + 5, label.y, f.right + 11, label.at, f.right + 14, label.at + 4,
                     escape_html(short_name(series.name)));
}

std::string series_svg(const Plot& plot, const Frame& f) {
  const std::vector<EndLabel> labels = end_labels(plot, f);
  std::string text;
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    const Series& series = plot.series[s];
    std::string label;
    for (const EndLabel& end : labels)
      if (end.series == s) label = label_svg(plot, f, end);
    text += fmt::format("<g class=\"series line-{}\" data-series=\"{}\">{}{}{}</g>\n", series.style % kStyles,
                        escape_html(series.name), band_svg(series, f), line_svg(series, f), label);
  }
  return text;
}

std::string legend_svg(const Plot& plot) {
  std::string text;
  double x = 66;
  for (const Series& series : plot.series) {
    text += fmt::format("<g class=\"series line-{0}\" transform=\"translate({1:.1f} {2})\"><path class=\"line\"{3} d=\"M0 "
                        "0H26\"/><g class=\"marks\">{4}</g><text x=\"32\" y=\"4\">{5}</text></g>",
                        series.style % kStyles, x, plot.height + 10, dash_attribute(series.style),
                        marker(series.style, 13, 0), escape_html(short_name(series.name)));
    x += 50 + 6.8 * static_cast<double>(std::min<std::size_t>(series.name.size(), 18));
  }
  return text;
}

std::string svg_of(const Plot& plot, const std::string& attributes, const std::string& style, bool legend) {
  const Frame frame = frame_of(plot);
  return fmt::format(
      "<svg class=\"plot\"{0} viewBox=\"0 0 {1} {2}\" role=\"img\" aria-labelledby=\"{3}-title {3}-desc\">\n"
      "<title id=\"{3}-title\">{4}</title><desc id=\"{3}-desc\">{5}</desc>\n{6}{7}{8}\n{9}{10}\n{11}{12}</svg>\n",
      attributes, plot.width, plot.height + (legend ? 26 : 0), escape_html(plot.key), escape_html(plot.title),
      escape_html(plot.description), style,
      legend ? fmt::format("<rect class=\"ground\" width=\"{}\" height=\"{}\"/>", plot.width, plot.height + 26) : "",
      axes_svg(plot, frame), floor_svg(plot, frame) + guide_svg(plot, frame), rule_svg(plot, frame),
      series_svg(plot, frame), legend ? legend_svg(plot) : "");
}

// --- from results --------------------------------------------------------------------------------------------------

// Which end is where, for those who cannot see the lines.
std::string describe(const Plot& plot) {
  std::string text = fmt::format("{} against {}.", plot.y.label, plot.x.label);
  for (const Series& series : plot.series) {
    if (series.points.empty()) continue;
    const PlotPoint &first = series.points.front(), &last = series.points.back();
    text += fmt::format(" {}: from {} at {} to {} at {}.", series.name, number_text(first.y),
                        tick_text(first.x, plot.x.unit), number_text(last.y), tick_text(last.x, plot.x.unit));
  }
  if (is_number(plot.floor)) text += fmt::format(" {}: {}.", plot.floor_label, number_text(plot.floor));
  return text;
}

PlotPoint point_of(double x, const Interval& interval) { return {x, interval.mean, interval.low, interval.high}; }

const char* frame_value_label(FrameValue value) {
  return value == FrameValue::kRmse ? "RMSE" : value == FrameValue::kTemporalError ? "temporal error" : "flicker";
}

std::vector<double> frame_values(const Results& results, int method, int frame, FrameValue value, Budget budget) {
  std::vector<double> values;
  if (value == FrameValue::kRmse) {
    for (const Run& run : results.runs)
      if (run.method == method && run.frame == frame && run.stage(budget).spp > 0)
        values.push_back(run.stage(budget).errors[0]);
  } else {
    for (const FrameChange& change : results.changes)
      if (change.method == method && change.frame == frame && change.budget == budget)
        values.push_back(value == FrameValue::kFlicker ? change.flicker : change.error);
  }
  return values;
}

}  // namespace

std::string plot_svg(const Plot& plot) { return svg_of(plot, "", "", false); }

std::string standalone_svg(const Plot& plot) {
  return svg_of(plot, fmt::format(" xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\"", plot.width, plot.height + 26),
                "<style>" + plot_style() + "</style>\n", true);
}

std::string plot_style() {
  std::string text = fmt::format(
      ":root{{{0}}}\n@media (prefers-color-scheme:dark){{:root:not([data-theme=light]){{{1}}}}}\n:root[data-theme=dark]{{{1}}}\n"
      "@media print{{:root{{{0}}}}}\n",
      variables(false), variables(true));
  for (int i = 0; i < kStyles; ++i) text += fmt::format(".line-{0}{{color:var(--line-{0})}}", i);
  return text +
         "\n.plot{font:12px system-ui,sans-serif;font-variant-numeric:tabular-nums}"
         ".plot text{fill:var(--plot-ink)}.plot .ticks text{fill:var(--plot-soft)}.plot .ticks .axis{fill:var(--plot-ink)}"
         ".plot .ground{fill:var(--plot-ground)}"
         ".plot .grid path{stroke:var(--plot-grid);stroke-width:1;fill:none}.plot .grid .minor{stroke-width:.5}"
         ".plot .rule path{stroke:var(--plot-ink);stroke-width:1;fill:none}"
         ".plot .rule text,.plot .floor text,.plot .guide text{font-size:11px;fill:var(--plot-soft)}"
         ".plot .floor path,.plot .hatch{stroke:var(--plot-soft);stroke-width:1;fill:none}.plot .hatch{stroke-width:1.2;opacity:.6}"
         ".plot .guide path{stroke:var(--plot-soft);stroke-width:1;stroke-dasharray:1 3;fill:none}"
         ".plot .line{fill:none;stroke:currentColor;stroke-width:1.8;stroke-linejoin:round}"
         ".plot .marks{fill:currentColor}.plot .band{fill:currentColor;opacity:.16}"
         ".plot .leader{stroke:currentColor;stroke-width:.8;opacity:.6;fill:none}"
         ".plot .series text{fill:currentColor;font-weight:600}\n";
}

std::string line_sample_svg(int style) {
  return fmt::format("<svg class=\"plot sample line-{}\" width=\"30\" height=\"12\" viewBox=\"0 0 30 12\" aria-hidden=\"true\">"
                     "<path class=\"line\"{} d=\"M1 6H29\"/><g class=\"marks\">{}</g></svg>",
                     style % kStyles, dash_attribute(style), marker(style, 15, 6));
}

Plot convergence_plot(const Results& results, const std::string& light, Measure measure, Budget against) {
  const bool rmse = measure == Measure::kRmse, by_time = against == Budget::kTime;
  Plot plot;
  plot.key = fmt::format("curve-{}-{}", rmse ? "rmse" : "relmse", budget_key(against));
  plot.title = fmt::format("{} against {}", rmse ? "RMSE" : "relMSE", by_time ? "time" : "samples");
  plot.x = by_time ? Axis{"time of a method", Unit::kSeconds} : Axis{"camera samples a pixel"};
  plot.y = {rmse ? "RMSE" : "relMSE"};
  plot.rule = by_time ? results.budget_s : results.budget_spp;
  plot.rule_label = by_time ? seconds_text(results.budget_s) : fmt::format("{} spp", results.budget_spp);
  plot.floor = reference_errors(results, light)[rmse ? 0 : 1];
  plot.floor_label = "error of the reference itself";
  plot.guide = rmse ? -0.5 : -1;
  plot.guide_label = rmse ? "1/√n" : "1/n";
  for (const CurveBand& band : curve_bands(results)) {
    const Contender& method = results.methods[static_cast<std::size_t>(band.method)];
    if (method.light != light) continue;
    Series series{method.name, band.method, {}};
    for (const CurveBand::Point& point : band.points)
      series.points.push_back(point_of(by_time ? point.seconds : point.spp, rmse ? point.rmse : point.rel_mse));
    plot.series.push_back(std::move(series));
  }
  plot.description = describe(plot);
  return plot;
}

Plot frame_plot(const Results& results, const std::string& light, FrameValue value, Budget budget) {
  Plot plot;
  plot.key = fmt::format("frames-{}-{}", frame_value_label(value), budget_key(budget));
  std::replace(plot.key.begin(), plot.key.end(), ' ', '-');
  plot.title = fmt::format("{} by frame at {}", frame_value_label(value), budget_label(budget));
  plot.x = {"frame", Unit::kNumber, false};
  plot.y = {frame_value_label(value), Unit::kNumber, false};
  plot.width = 400;
  plot.height = 230;
  for (std::size_t m = 0; m < results.methods.size(); ++m) {
    if (results.methods[m].light != light) continue;
    Series series{results.methods[m].name, static_cast<int>(m), {}};
    for (const int frame : results.frames) {
      const Interval interval = interval_of(frame_values(results, static_cast<int>(m), frame, value, budget));
      if (interval.count == 0) continue;
      series.points.push_back(point_of(frame, interval));
      double& low = series.points.back().low;
      if (value != FrameValue::kFlicker && low < 0) low = 0;  // neither error can be below
    }
    if (!series.points.empty()) plot.series.push_back(std::move(series));
  }
  plot.description = describe(plot);
  return plot;
}

}  // namespace lumigrove
