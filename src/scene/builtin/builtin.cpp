#include "scene/builtin/builtin.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace lumigrove {
namespace builtin {
namespace {

const std::vector<Definition>& definitions() {
  static const std::vector<Definition> all = {night_city(),  cornell_lights(), towers(),   colonnade(),
                                              living_room(), single(),         fireflies()};
  return all;
}

template <class Items>
std::string names_of(const Items& items) {
  std::string names;
  for (const auto& item : items) names += (names.empty() ? "" : ", ") + item.name;
  return names;
}

std::string_view scene_part(std::string_view name) { return name.substr(0, name.find('?')); }
std::string_view query_part(std::string_view name) {
  const std::size_t mark = name.find('?');
  return mark == name.npos ? std::string_view() : name.substr(mark + 1);
}

const Definition* find_definition(std::string_view name) {
  for (const Definition& definition : definitions())
    if (definition.name == scene_part(name)) return &definition;
  return nullptr;
}

double parse_number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? value : std::nan("");
}

std::string number_text(double value) {
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed);
  return std::string(buffer, result.ptr);
}

// What a value must be; empty when `value` is just that.
std::string complaint(const ParameterSpec& spec, std::string_view value) {
  if (!spec.choices.empty()) {
    std::string list;
    for (const std::string& choice : spec.choices) {
      if (choice == value) return "";
      list += (list.empty() ? "" : ", ") + choice;
    }
    return "one of " + list;
  }
  const double number = parse_number(value);
  const bool fits = number >= spec.lo && number <= spec.hi && (spec.real || number == std::floor(number));
  return fits ? ""
              : (spec.real ? "a number from " : "a whole number from ") + number_text(spec.lo) + " to " +
                    number_text(spec.hi);
}

}  // namespace

Parameters::Parameters(std::string_view scene, const std::vector<ParameterSpec>& specs,
                       std::string_view query) {
  const std::string where = "Built-in scene '" + std::string(scene) + "': ";
  while (!query.empty()) {
    const std::string_view item = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), item.size() + 1));
    const std::size_t equals = item.find('=');
    const std::string key(item.substr(0, equals));
    const auto spec =
        std::find_if(specs.begin(), specs.end(), [&](const ParameterSpec& s) { return s.name == key; });
    if (spec == specs.end())
      throw Error(where + "no parameter '" + key + "'; it has " + names_of(specs) + " (as in " +
                  std::string(scene) + "?" + specs.front().name + "=" + specs.front().default_value + ").");
    const std::string value(equals == item.npos ? std::string_view() : item.substr(equals + 1));
    const std::string wanted = complaint(*spec, value);
    if (!wanted.empty())
      throw Error(where + "parameter '" + key + "' is '" + value + "' but must be " + wanted + ".");
    if (!values_.emplace(key, value).second) throw Error(where + "parameter '" + key + "' is given twice.");
  }
  for (const ParameterSpec& spec : specs) values_.emplace(spec.name, spec.default_value);
}

const std::string& Parameters::text(std::string_view name) const { return values_.find(name)->second; }
int Parameters::integer(std::string_view name) const { return static_cast<int>(parse_number(text(name))); }
float Parameters::real(std::string_view name) const { return static_cast<float>(parse_number(text(name))); }

}  // namespace builtin

const std::vector<BuiltinScene>& builtin_scenes() {
  static const std::vector<BuiltinScene> all = [] {
    std::vector<BuiltinScene> list;
    for (const builtin::Definition& definition : builtin::definitions()) {
      BuiltinScene& scene =
          list.emplace_back(BuiltinScene{definition.name, definition.description, {}, definition.animated});
      for (const builtin::ParameterSpec& p : definition.parameters)
        scene.parameters.push_back({p.name, p.default_value, p.description});
    }
    return list;
  }();
  return all;
}

bool is_builtin_scene(std::string_view name_with_parameters) {
  return builtin::find_definition(name_with_parameters) != nullptr;
}

Scene make_builtin_scene(const std::string& name_with_parameters) {
  const builtin::Definition* definition = builtin::find_definition(name_with_parameters);
  if (definition == nullptr)
    throw Error("No built-in scene '" + std::string(builtin::scene_part(name_with_parameters)) +
                "'; there are " + builtin::names_of(builtin::definitions()) + ".");
  const builtin::Parameters parameters(definition->name, definition->parameters,
                                       builtin::query_part(name_with_parameters));
  Scene scene = definition->make(parameters);
  scene.name = name_with_parameters;
  validate(scene);
  return scene;
}

}  // namespace lumigrove
