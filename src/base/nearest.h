// The candidate that a mistyped name most likely meant, for error messages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lumigrove {

// Fewest insertions, deletions, substitutions and swaps of neighbours that turn `a` into `b`.
int edit_distance(std::string_view a, std::string_view b);

// The candidate nearest to `name`; the first of equals, empty when there are no candidates. Case and the
// difference between '-' and '_' do not count, and a last dotted part alone stands for the whole name
// ("max_bounces" means "indirect.max_bounces").
std::string nearest(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace lumigrove
