#include "table.h"

#include <fmt/format.h>

#include <algorithm>

#include "html.h"

namespace lumigrove {
namespace {

// Characters of UTF-8.
int length_of(const std::string& text) {
  return static_cast<int>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

std::string text_of(const Cell& cell) { return cell.note.empty() ? cell.text : cell.text + " " + cell.note; }

std::string pad(const std::string& text, int width, bool to_right) {
  const std::string blanks(static_cast<std::size_t>(std::max(0, width - length_of(text))), ' ');
  return to_right ? blanks + text : text + blanks;
}

// Two blanks keep apart a number and the text right of it.
int gap_before(const Table& table, std::size_t column) {
  if (column == 0) return 0;
  return table.columns[column - 1].numeric && !table.columns[column].numeric ? 2 : 1;
}

std::string without_trailing_blanks(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

// One line from text(column).
template <class Text>
std::string line_of(const Table& table, const std::vector<int>& widths, const Text& text) {
  std::string line;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    if (!table.columns[c].on_terminal) continue;
    line += std::string(static_cast<std::size_t>(line.empty() ? 0 : gap_before(table, c)), ' ');
    line += pad(text(c), widths[c], table.columns[c].numeric);
  }
  return without_trailing_blanks(std::move(line)) + "\n";
}

// Where a column starts.
std::size_t start_of(const Table& table, const std::vector<int>& widths, std::size_t column) {
  int start = 0;
  for (std::size_t c = 0; c < column; ++c)
    if (table.columns[c].on_terminal) start += widths[c] + gap_before(table, c + 1);
  return static_cast<std::size_t>(start);
}

// As set in print: what a keyboard lacks.
std::string typeset(std::string text) {
  for (std::size_t at = text.find("+-"); at != text.npos; at = text.find("+-", at)) text.replace(at, 2, "±");
  const std::size_t factor = text.find('x');
  if (factor <= 1 && factor + 1 < text.size() && std::isdigit(static_cast<unsigned char>(text[factor + 1])))
    text.replace(factor, 1, "×");
  return escape_html(text);
}

std::string title_attribute(const std::string& title) {
  return title.empty() ? "" : fmt::format(" title=\"{}\"", escape_html(title));
}

std::string small_html(const std::string& note) {
  return note.empty() ? "" : fmt::format("<small>{}</small>", typeset(note));
}

std::string heading_html(const Column& column) {
  const char* first = column.numeric && !column.lower_is_better ? "descending" : "ascending";
  return fmt::format("<th scope=\"col\" aria-sort=\"none\"{}><button type=\"button\" data-first=\"{}\"{}>{}</button></th>",
                     column.numeric ? " class=\"number\"" : "", first, title_attribute(column.title),
                     escape_html(column.label.empty() ? column.title : column.label));
}

std::string cell_html(const Table& table, const Row& row, std::size_t c) {
  const Column& column = table.columns[c];
  const Cell& cell = row.cells[c];
  const bool names = c == table.name_column;
  std::string attributes = names ? " scope=\"row\"" : "";
  if (column.numeric) attributes += fmt::format(" class=\"number{}\"", cell.strong ? " best" : "");
  if (column.numeric && is_number(cell.value)) attributes += fmt::format(" data-value=\"{:.9g}\"", cell.value);
  attributes += title_attribute(cell.title);
  const char* tag = names ? "th" : "td";
  return fmt::format("<{0}{1}>{2}{3}{4}</{0}>", tag, attributes, typeset(cell.text), small_html(cell.note),
                     names ? small_html(row.note) : "");
}

std::string message_html(const Table& table, const Row& row) {
  const Cell& name = row.cells[table.name_column];
  std::string before;
  for (std::size_t c = 0; c < table.name_column; ++c) before += "<td></td>";
  return fmt::format("{}<th scope=\"row\">{}</th><td class=\"message\" colspan=\"{}\">{}</td>", before,
                     escape_html(name.text), table.columns.size() - 1 - table.name_column, escape_html(row.message));
}

std::string row_html(const Table& table, const Row& row) {
  std::string cells;
  if (!row.message.empty())
    cells = message_html(table, row);
  else
    for (std::size_t c = 0; c < table.columns.size(); ++c) cells += cell_html(table, row, c);
  return "<tr>" + cells + "</tr>\n";
}

}  // namespace

Cell number_cell(double value, std::string text, std::string note, bool strong) {
  return {std::move(text), value, std::move(note), strong};
}

std::vector<int> text_widths(const Table& table) {
  std::vector<int> widths;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const Column& column = table.columns[c];
    int width = column.width > 0 ? column.width : length_of(column.label);
    if (column.width == 0)
      for (const Row& row : table.rows)
        if (row.message.empty() || c == table.name_column) width = std::max(width, length_of(text_of(row.cells[c])));
    widths.push_back(width);
  }
  return widths;
}

std::string heading_text(const Table& table, const std::vector<int>& widths) {
  return line_of(table, widths, [&](std::size_t c) { return table.columns[c].label; });
}

std::string row_text(const Table& table, const Row& row, const std::vector<int>& widths) {
  const std::string indent(start_of(table, widths, table.name_column), ' ');
  if (!row.message.empty())
    return indent + pad(row.cells[table.name_column].text, widths[table.name_column], false) + " " + row.message + "\n";
  std::string text = line_of(table, widths, [&](std::size_t c) { return text_of(row.cells[c]); });
  if (!row.note.empty()) text += indent + row.note + "\n";
  return text;
}

std::string to_text(const Table& table) {
  const std::vector<int> widths = text_widths(table);
  std::string text = table.caption.empty() ? "" : table.caption + "\n";
  text += heading_text(table, widths);
  for (const Row& row : table.rows) text += row_text(table, row, widths);
  return text;
}

std::string to_html(const Table& table) {
  std::string head, body;
  for (const Column& column : table.columns) head += heading_html(column);
  for (const Row& row : table.rows) body += row_html(table, row);
  // Wide tables scroll on their own, by keyboard too.
  return fmt::format(
      "<div class=\"table\" role=\"region\" tabindex=\"0\" aria-labelledby=\"{0}-caption\">\n<table id=\"{0}\">\n"
      "<caption id=\"{0}-caption\">{1}</caption>\n<thead><tr>{2}</tr></thead>\n<tbody>\n{3}</tbody>\n</table>\n</div>\n",
      escape_html(table.key), escape_html(table.caption), head, body);
}

nlohmann::ordered_json to_json(const Table& table) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const Row& row : table.rows) {
    nlohmann::ordered_json json = nlohmann::ordered_json::object();
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      if (!row.message.empty() && c != table.name_column) continue;
      const Cell& cell = row.cells[c];
      nlohmann::ordered_json value = cell.text;
      if (table.columns[c].numeric) value = is_number(cell.value) ? nlohmann::ordered_json(cell.value) : nullptr;
      json[table.columns[c].key] = std::move(value);
    }
    if (!row.note.empty()) json["note"] = row.note;
    if (!row.message.empty()) json["message"] = row.message;
    rows.push_back(std::move(json));
  }
  return rows;
}

}  // namespace lumigrove
