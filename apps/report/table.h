// Tables: described once, shown on a terminal, in a page and as JSON.
#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace lumigrove {

struct Column {
  std::string key;    // in JSON
  std::string label;  // its heading
  std::string title;  // what it is, in full
  bool numeric = false;         // to the right; sorted by value instead of by text
  bool lower_is_better = true;  // of numbers; the order that is sorted into first
  int width = 0;                // on a terminal, in characters; 0: as wide as its widest cell
  bool on_terminal = true;
};

struct Cell {
  std::string text;
  double value = std::numeric_limits<double>::quiet_NaN();  // of a numeric column; NaN is sorted last
  std::string note = {};   // smaller, beside the text on a terminal and below it in a page
  bool strong = false;     // among the best of its column
  std::string title = {};  // a longer explanation
};
Cell number_cell(double value, std::string text, std::string note = {}, bool strong = false);

struct Row {
  std::vector<Cell> cells;  // of every column
  std::string note = {};    // a line of its own on a terminal, below the row's name in a page
  std::string message = {};  // stands instead of all cells but the row's name; such rows are sorted last
};

struct Table {
  std::string key;  // unique in a page
  std::string caption;
  std::vector<Column> columns;
  std::size_t name_column = 0;  // whose cells name their rows
  std::vector<Row> rows = {};
};

// Widths of all columns, from their rows where they are not fixed.
std::vector<int> text_widths(const Table& table);

// Lines of a terminal. A table whose widths are all fixed can be printed row by row.
std::string heading_text(const Table& table, const std::vector<int>& widths);
std::string row_text(const Table& table, const Row& row, const std::vector<int>& widths);
std::string to_text(const Table& table);

// <table> whose headings are buttons; report.js sorts by them.
std::string to_html(const Table& table);

// A list of objects: value, or text, by column key; null where a value is not a number.
nlohmann::ordered_json to_json(const Table& table);

}  // namespace lumigrove
