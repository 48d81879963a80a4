#include "base/nearest.h"

#include <algorithm>
#include <cctype>

namespace lumigrove {
namespace {

std::string normalised(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = c == '-' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

std::string last_part(const std::string& key) {
  const std::size_t dot = key.rfind('.');
  return dot == std::string::npos ? key : key.substr(dot + 1);
}

}  // namespace

// Optimal string alignment, three rows of the table at a time.
int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> before(b.size() + 1), previous(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = previous;
    previous = row;
    row[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({previous[j] + 1, row[j - 1] + 1, previous[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

std::string nearest(std::string_view name, const std::vector<std::string>& candidates) {
  // Distances count double so that a whole name wins over an equally distant last part.
  const std::string wanted = normalised(name);
  std::string best;
  int best_cost = 0;
  for (const std::string& candidate : candidates) {
    const std::string whole = normalised(candidate), part = last_part(whole);
    int cost = 2 * edit_distance(wanted, whole);
    if (part != whole) cost = std::min(cost, 2 * edit_distance(wanted, part) + 1);
    if (best.empty() || cost < best_cost) best = candidate, best_cost = cost;
  }
  return best;
}

}  // namespace lumigrove
