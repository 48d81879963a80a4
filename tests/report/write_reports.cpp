// Writes the reports that report_test.py opens: FOLDER/{still,sequence,partial}/report.html.
#include <cstdio>
#include <exception>
#include <filesystem>

#include "page.h"
#include "report_fixtures.h"

int main(int count, char** arguments) {
  using namespace lumigrove;
  namespace fs = std::filesystem;
  if (count != 2) {
    std::fputs("usage: write_reports FOLDER\n", stderr);
    return 2;
  }
  try {
    const auto write = [&](const char* name, Results (*make)(const fs::path&)) {
      const fs::path folder = fs::path(arguments[1]) / name;
      fs::create_directories(folder);
      write_report(make(folder), folder);
    };
    write("still", fixtures::still);
    write("sequence", fixtures::sequence);
    write("partial", fixtures::partial);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "write_reports: %s\n", error.what());
    return 1;
  }
  return 0;
}
