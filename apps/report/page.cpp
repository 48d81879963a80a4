#include "page.h"

#include <fmt/format.h>

#include <algorithm>

#include "assets.h"
#include "base/atomic_file.h"
#include "html.h"
#include "plot.h"
#include "summary_tables.h"
#include "viewer_data.h"

namespace lumigrove {
namespace {

std::string plural(std::size_t count, const char* word) {
  return fmt::format("{} {}{}", count, word, count == 1 ? "" : "s");
}

// --- head of the report --------------------------------------------------------------------------------------------

std::string header_html(const Results& results) {
  std::string facts = fmt::format("{}×{} pixels · equal time {} · equal samples {} spp · {}", results.width, results.height,
                                  seconds_text(results.budget_s), results.budget_spp,
                                  plural(static_cast<std::size_t>(results.seeds), "seed"));
  if (results.frames.size() > 1)
    facts += fmt::format(" · {} frames at {} a second", results.frames.size(), number_text(results.fps));
  return fmt::format("<p class=\"facts\">{}</p>\n<p class=\"facts\">{}{}{}</p>\n", facts, escape_html(results.scene_summary),
                     results.scene_summary.empty() || results.date.empty() ? "" : " · ", escape_html(results.date));
}

std::string cautions_html(const Results& results) {
  const std::vector<std::string> sentences = cautions(results);
  if (sentences.empty()) return "";
  std::string items;
  for (const std::string& sentence : sentences) items += "<li>" + escape_html(sentence) + "</li>\n";
  return "<section class=\"cautions\" aria-labelledby=\"cautions-heading\">\n<h2 id=\"cautions-heading\">Before the "
         "numbers</h2>\n<ul>\n" + items + "</ul>\n</section>\n";
}

// --- numbers of one light ------------------------------------------------------------------------------------------

std::string metric_notes_html(const Results& results, const std::string& light) {
  std::string text = "<div class=\"notes\"><p>Small numbers are half widths of 95 % intervals (Student's t over ";
  text += results.frames.size() > 1 ? "seeds and frames" : "seeds";
  text += results.seeds < 2 ? "; with one seed there are none). " : "). ";
  text += "Equal ranks: the intervals, or the error of the reference, cannot tell the methods apart. A click on a heading "
          "sorts.</p>\n<dl>";
  const Errors own = reference_errors(results, light);
  for (std::size_t m = 0; m < metrics().size(); ++m)
    text += fmt::format("<div><dt>{}</dt><dd>{}; {} is better; error of the reference itself: {}{}</dd></div>\n",
                        metrics()[m].label, escape_html(metrics()[m].formula),
                        metrics()[m].lower_is_better ? "lower" : "higher",
                        is_number(own[m]) ? number_text(own[m]) : "unknown",
                        is_number(own[m]) && !metrics()[m].lower_is_better ? " below 1" : "");
  for (const Reference& reference : results.references)
    if (reference.light == light && reference.frame == results.frames.front())
      text += fmt::format("<div><dt>Reference</dt><dd>{}; {}</dd></div>\n", escape_html(reference.origin),
                          escape_html(reference.file));
  return text + "</dl></div>\n";
}

// Why methods are called what they are called.
std::string estimators_html(const Results& results, const std::string& light) {
  std::string items;
  for (const Contender& method : results.methods)
    if (method.light == light && !method.why.empty())
      items += fmt::format("<li><b>{}</b>, {}: {}</li>\n", escape_html(method.name), escape_html(method.estimator),
                           escape_html(method.why));
  return items.empty() ? "" : "<ul class=\"notes\">\n" + items + "</ul>\n";
}

std::string choice_html(const std::string& group, const std::string& value, const std::string& label, bool pressed) {
  return fmt::format("<button type=\"button\" data-choose=\"{}={}\" aria-pressed=\"{}\">{}</button>", group, value,
                     pressed ? "true" : "false", label);
}

std::string legend_html(const Results& results, const std::string& light) {
  std::string items;
  for (std::size_t m = 0; m < results.methods.size(); ++m)
    if (results.methods[m].light == light)
      items += fmt::format("<button type=\"button\" data-line=\"{0}\">{1}{0}</button>\n", escape_html(results.methods[m].name),
                           line_sample_svg(static_cast<int>(m)));
  return "<div class=\"legend\" role=\"group\" aria-label=\"Highlight a method\">" + items + "</div>\n";
}

std::string curves_html(const Results& results, const std::string& light, std::size_t index) {
  const std::string group = fmt::format("measure-{}", index);
  std::string plots;
  for (const Measure measure : {Measure::kRmse, Measure::kRelMse}) {
    std::string pair;
    for (const Budget against : kBudgets) {
      Plot plot = convergence_plot(results, light, measure, against);
      if (plot.series.empty()) return "";
      plot.key += fmt::format("-{}", index);
      pair += plot_svg(plot);
    }
    const bool first = measure == Measure::kRmse;
    plots += fmt::format("<div class=\"plots\" data-group=\"{}\" data-value=\"{}\"{}>{}</div>\n", group,
                         first ? "rmse" : "relmse", first ? "" : " hidden", pair);
  }
  return fmt::format(
      "<figure class=\"curves\">\n<div class=\"controls\"><div class=\"group\" role=\"group\" aria-label=\"Error\">{}{}</div>\n"
      "{}</div>\n{}<figcaption>Error while rendering goes on: mean over seeds with its 95 % band. Vertical: where methods are "
      "compared. Hatched: below the error of the reference itself nothing can be told apart. Dotted: the slope of an "
      "unbiased estimate.</figcaption>\n</figure>\n",
      choice_html(group, "rmse", "RMSE", true), choice_html(group, "relmse", "relMSE", false), legend_html(results, light),
      plots);
}

std::string frames_html(const Results& results, const std::string& light, std::size_t index) {
  if (results.frames.size() < 2) return "";
  const std::string group = fmt::format("frames-{}", index);
  std::string plots, choices;
  for (const Budget budget : kBudgets) {
    std::string row;
    for (const FrameValue value : {FrameValue::kRmse, FrameValue::kTemporalError, FrameValue::kFlicker}) {
      Plot plot = frame_plot(results, light, value, budget);
      plot.key += fmt::format("-{}", index);
      if (!plot.series.empty()) row += plot_svg(plot);
    }
    const bool first = budget == kBudgets.front();
    plots += fmt::format("<div class=\"plots three\" data-group=\"{}\" data-value=\"{}\"{}>{}</div>\n", group,
                         budget_key(budget), first ? "" : " hidden", row);
    choices += choice_html(group, budget_key(budget), budget_label(budget), first);
  }
  return fmt::format(
      "<h3>Frame by frame</h3>\n<figure class=\"curves\">\n<div class=\"controls\"><div class=\"group\" role=\"group\" "
      "aria-label=\"Budget\">{}</div>\n{}</div>\n{}<figcaption>Mean over seeds with its 95 % band. Temporal error: mean |(a' - a) "
      "- (r' - r)| between neighbouring frames; flicker: mean |a' - a| - mean |r' - r|; a the method, r the reference, both "
      "tone-mapped sRGB.</figcaption>\n</figure>\n",
      choices, legend_html(results, light), plots);
}

std::string light_html(const Results& results, const std::string& light, std::size_t index, bool only) {
  std::string text = fmt::format("<section aria-labelledby=\"light-{0}\">\n<h2 id=\"light-{0}\">{1}</h2>\n", index,
                                 only ? "Results" : "Results: " + escape_html(light));
  text += fmt::format("<p>Measured on {}{}.</p>\n", escape_html(light),
                      only ? "" : "; methods measured on different light are not compared with each other");
  for (const Budget budget : kBudgets) {
    Table table = summary_table(results, budget, light);
    table.key += fmt::format("-{}", index);
    text += to_html(table);
  }
  text += estimators_html(results, light) + metric_notes_html(results, light);
  text += "<h3>How the error falls</h3>\n" + curves_html(results, light, index) + frames_html(results, light, index);
  Table cost = cost_table(results, light);
  cost.key += fmt::format("-{}", index);
  if (!cost.rows.empty()) text += "<h3>Costs</h3>\n" + to_html(cost);
  return text + "</section>\n";
}

// --- pictures ------------------------------------------------------------------------------------------------------

std::string viewer_html(const ViewerData& data) {
  std::string text = std::string(kViewerHtml) + "<p class=\"notes\">" + escape_html(data.embedded) + "</p>\n";
  for (std::size_t i = 0; i < data.pictures.size(); ++i)
    text += fmt::format("<script type=\"text/plain\" id=\"picture-{}\">{}</script>\n", i, data.pictures[i]);
  return text + "<script type=\"application/json\" id=\"report-data\">" + data.json + "</script>\n";
}

// --- receipt -------------------------------------------------------------------------------------------------------

std::string fact_html(const char* name, const std::string& value) {
  return value.empty() ? "" : fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", name, escape_html(value));
}

std::string command_html(const std::string& id, const std::string& label, const std::string& command) {
  if (command.empty()) return "";
  return fmt::format("<div class=\"command\"><span>{1}</span><code id=\"{0}\">{2}</code><button type=\"button\" class=\"copy\" "
                     "data-copies=\"{0}\" aria-label=\"Copy the command: {1}\">Copy</button></div>\n",
                     id, escape_html(label), escape_html(command));
}

std::string method_html(const Contender& method, std::size_t index) {
  std::string text = fmt::format("<h3>{}</h3>\n<p>{}</p>\n", escape_html(method.name), escape_html(method.description));
  if (!method.citation.empty()) text += "<p class=\"notes\">" + escape_html(method.citation) + "</p>\n";
  for (const Budget budget : kBudgets)
    text += command_html(fmt::format("command-{}-{}", index, budget_key(budget)),
                         fmt::format("{}, {}", method.name, budget_label(budget)),
                         method.commands[static_cast<std::size_t>(budget)]);
  if (!method.settings.empty())
    text += fmt::format("<details><summary>Settings of {}</summary><pre>{}</pre></details>\n", escape_html(method.name),
                        escape_html(method.settings));
  return text;
}

std::string receipt_html(const Results& results) {
  const Machine& machine = results.machine;
  const std::string memory = machine.memory_bytes > 0 ? ", " + bytes_text(machine.memory_bytes) + " of memory" : "";
  std::string text = "<section aria-labelledby=\"receipt-heading\">\n<h2 id=\"receipt-heading\">Receipt</h2>\n<dl class=\"facts\">\n";
  text += fact_html("Program", "Lumigrove " + results.version) + fact_html("Started", results.date);
  text += fact_html("Processor", machine.processor.empty() ? "" : fmt::format("{}, {} cores, {} threads{}", machine.processor,
                                                                              machine.cores, machine.threads, memory));
  text += fact_html("System", machine.system) + fact_html("Scene", results.scene);
  text += fact_html("Scene hash", results.scene_hash) + fact_html("Environment", results.environment);
  text += fact_html("Tone", fmt::format("{}, exposure {} EV, before SSIM, FLIP and pictures", results.tone, results.exposure_ev));
  text += fact_html("FLIP", fmt::format("{} pixels a degree", number_text(results.pixels_per_degree, 4)));
  text += fact_html("Seeds", fmt::format("{}, from {}", results.seeds, results.first_seed));
  text += "</dl>\n" + command_html("command", "This comparison", results.command);
  for (std::size_t m = 0; m < results.methods.size(); ++m) text += method_html(results.methods[m], m);
  return text + "</section>\n";
}

}  // namespace

std::string html_page(const std::string& title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src "
      "'unsafe-inline'; img-src data: blob:\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n"
      "<title>{0}</title>\n<style>\n{1}{2}</style>\n</head>\n<body>\n<header>\n<h1>{0}</h1>\n<button type=\"button\" "
      "id=\"theme\" title=\"Colours of this page\">Colours: auto</button>\n</header>\n<main>\n{3}</main>\n<script>\n{4}</script>\n"
      "</body>\n</html>\n",
      escape_html(title), plot_style(), kReportCss, body, kReportJs);
}

void write_table_page(const std::filesystem::path& file, const std::string& title, const std::string& introduction,
                      const Table& table) {
  write_text_atomically(file, html_page(title, "<p>" + escape_html(introduction) + "</p>\n" + to_html(table)));
}

void write_report(const Results& results, const std::filesystem::path& folder, std::size_t most_bytes) {
  const std::vector<std::string> lights = lights_of(results);
  std::string before = header_html(results) + cautions_html(results), after = receipt_html(results);
  for (std::size_t l = 0; l < lights.size(); ++l) before += light_html(results, lights[l], l, lights.size() == 1);
  const std::string title = fmt::format("{}: {} compared", results.scene, plural(results.methods.size(), "method"));
  // Bias maps and words about pictures take the small rest.
  const std::size_t rest = html_page(title, before + after).size() + most_bytes / 50;
  const ViewerData data = make_viewer_data(results, folder, most_bytes > rest ? most_bytes - rest : 0);
  write_text_atomically(folder / "report.html", html_page(title, before + viewer_html(data) + after));
}

}  // namespace lumigrove
