// Pages that carry everything inside themselves: they open from a file, and load nothing.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "results.h"
#include "table.h"

namespace lumigrove {

// A page around `body`, which is HTML.
std::string html_page(const std::string& title, const std::string& body);

// A page of one table, below an introduction in plain text. Written atomically; throws Error.
void write_table_page(const std::filesystem::path& file, const std::string& title, const std::string& introduction,
                      const Table& table);

inline constexpr std::size_t kReportBytes = 18'000'000;

// report.html in the folder of the results: tables, curves, pictures. Whatever is missing there is said to be missing.
// Pictures are encoded so that the page has about `most_bytes` at most. Written atomically; throws Error.
void write_report(const Results& results, const std::filesystem::path& folder, std::size_t most_bytes = kReportBytes);

}  // namespace lumigrove
