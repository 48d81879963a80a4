#include "frame/settings_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <fstream>
#include <sstream>
#include <string_view>

namespace lumigrove {
namespace {

[[noreturn]] void refuse(const std::string& source, const toml::node& node, const std::string& key,
                         const std::string& what) {
  throw Error(fmt::format("{}:{}: {} {}", source, node.source().begin.line, key, what));
}

std::string scalar_text(const toml::node& node, const std::string& key, const std::string& source) {
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* integer = node.as_integer()) return std::to_string(integer->get());
  if (const auto* real = node.as_floating_point()) return fmt::format("{}", real->get());
  if (const auto* flag = node.as_boolean()) return flag->get() ? "true" : "false";
  refuse(source, node, key, "is neither a number, a text, true, false nor a list of numbers");
}

std::string list_text(const toml::array& array, const std::string& key, const std::string& source) {
  std::string text;
  for (const toml::node& element : array) {
    if (!text.empty()) text += ',';
    text += scalar_text(element, key, source);
  }
  return text;
}

// Depth is bounded by the parser, which refuses deeply nested text.
void flatten(const toml::table& table, const std::string& prefix, const std::string& source,
             SettingValues& values) {
  for (const auto& [name, node] : table) {
    const std::string key = prefix + std::string(name.str());
    if (const auto* inner = node.as_table())
      flatten(*inner, key + ".", source, values);
    else if (const auto* array = node.as_array())
      values.emplace_back(key, list_text(*array, key, source));
    else
      values.emplace_back(key, scalar_text(node, key, source));
  }
}

// A TOML basic string: quotes, backslashes and control characters are escaped.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      result.append(1, '\\').append(1, c);
    else if (byte < 0x20 || byte == 0x7f)
      result += fmt::format("\\u{:04X}", byte);
    else
      result += c;
  }
  return result + '"';
}

std::string toml_value(const SettingInfo& info, const std::string& value) {
  const bool list = info.type == "vec3" || info.type == "int4";
  const bool bare = info.type == "int" || info.type == "float" || info.type == "bool";
  if (value != "none" && list) return fmt::format("[{}]", value);
  if (value != "none" && bare) return value;
  return quoted(value);
}

}  // namespace

SettingValues parse_settings(const std::string& toml_text, const std::string& source) {
  SettingValues values;
  try {
    flatten(toml::parse(toml_text, source), "", source, values);
  } catch (const toml::parse_error& error) {
    throw Error(fmt::format("{}:{}: {}", source, error.source().begin.line, error.description()));
  }
  return values;
}

SettingValues read_settings_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  if (!stream || std::filesystem::is_directory(file) || !(text << stream.rdbuf()))
    throw Error(fmt::format("cannot read settings file '{}'", file.string()));
  return parse_settings(text.str(), file.string());
}

void apply_settings(Settings& settings, const SettingValues& values, const std::string& source) {
  try {
    for (const auto& [key, value] : values)
      if (key == "preset") set_value(settings, key, value);
    for (const auto& [key, value] : values)
      if (key != "preset") set_value(settings, key, value);
  } catch (const Error& error) {
    throw Error(fmt::format("{}: {}", source, error.what()));
  }
}

std::string to_toml(const Settings& settings) {
  const Settings row = make_preset(settings.preset);
  std::string text;
  for (const SettingInfo& info : settings_table()) {
    const std::string value = get_value(settings, info.key);
    if (info.key == "preset" || value != get_value(row, info.key))
      text += fmt::format("{} = {}\n", info.key, toml_value(info, value));
  }
  return text;
}

}  // namespace lumigrove
