#include "method_spec.h"

#include <fmt/format.h>

#include <set>

#include "frame/value_text.h"

namespace lumigrove {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t end; (end = text.find(separator, begin)) != std::string::npos; begin = end + 1)
    parts.push_back(text.substr(begin, end - begin));
  parts.push_back(text.substr(begin));
  return parts;
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

void set_once(const std::string& option, const std::string& text, bool given) {
  if (given) throw Error(fmt::format("{} gives the same kind of budget twice: '{}'", option, text));
}

void parse_one_budget(const std::string& option, const std::string& text, BudgetSpec& budget) {
  constexpr Range kSeconds{0, 1e6, true}, kSamples{1, 1e6};
  const auto number = [&](std::size_t unit) { return text.substr(0, text.size() - unit); };
  if (ends_with(text, "spp")) {
    set_once(option, text, budget.spp > 0);
    budget.spp = static_cast<int>(parse_integer(option, number(3), kSamples));
  } else if (ends_with(text, "min")) {
    set_once(option, text, budget.seconds > 0);
    budget.seconds = 60 * parse_double(option, number(3), kSeconds);
  } else if (ends_with(text, "s")) {
    set_once(option, text, budget.seconds > 0);
    budget.seconds = parse_double(option, number(1), kSeconds);
  } else {
    throw Error(fmt::format("{} is '{}', but must be a time or a number of samples: 10s, 2min, 64spp, or 10s,64spp", option,
                            text));
  }
}

}  // namespace

MethodSpec parse_method(const std::string& text) {
  const std::vector<std::string> parts = split(text, ':');
  if (parts.front().empty())
    throw Error(fmt::format("'{}' names no method; write them as tree,rtslc or tree:direct.spp=4", text));
  MethodSpec spec{text, parts.front(), {}};
  if (const std::size_t equals = spec.preset.find('='); equals != std::string::npos) {
    spec.name = spec.preset.substr(0, equals);
    spec.preset = spec.preset.substr(equals + 1);
    if (spec.name.empty() || spec.preset.empty())
      throw Error(fmt::format("method '{}': a name of its own is written NAME=METHOD", text));
  }
  for (std::size_t i = 1; i < parts.size(); ++i) {
    const std::size_t equals = parts[i].find('=');
    if (equals == std::string::npos)
      throw Error(fmt::format("method '{}': '{}' is not of the form key=value", text, parts[i]));
    spec.values.emplace_back(parts[i].substr(0, equals), parts[i].substr(equals + 1));
  }
  return spec;
}

std::vector<MethodSpec> parse_methods(const std::vector<std::string>& texts) {
  std::vector<MethodSpec> specs;
  std::set<std::string> names;
  for (const std::string& text : texts)
    for (const std::string& part : split(text, ',')) {
      specs.push_back(parse_method(part));
      if (!names.insert(specs.back().name).second)
        throw Error(fmt::format("method '{}' is named twice", specs.back().name));
    }
  return specs;
}

BudgetSpec parse_budget(const std::string& option, const std::vector<std::string>& texts) {
  BudgetSpec budget;
  for (const std::string& text : texts)
    for (const std::string& part : split(text, ',')) parse_one_budget(option, part, budget);
  return budget;
}

}  // namespace lumigrove
