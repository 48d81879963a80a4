#include "tool.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <new>
#include <string_view>

#include "base/nearest.h"
#include "commands.h"
#include "frame/receipt.h"
#include "shell.h"

namespace lumigrove {
namespace {

constexpr int kFailed = 1, kWrongUsage = 2;

int fail(int status, const std::string& sentence) {
  std::fflush(stdout);
  fmt::print(stderr, "lumigrove: error: {}\n", sentence);
  return status;
}

// The innermost command that was named.
const CLI::App* parsed_command(const CLI::App* app) {
  while (!app->get_subcommands().empty()) app = app->get_subcommands().front();
  return app;
}

// Names of all subcommands or of all options of `command`.
std::vector<std::string> words_of(const CLI::App& command, std::string_view kind) {
  std::vector<std::string> words;
  if (kind == "command") {
    for (const CLI::App* sub : command.get_subcommands({})) words.push_back(sub->get_name());
    return words;
  }
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
    for (const std::string& name : option->get_snames()) words.push_back("-" + name);
  }
  return words;
}

std::string full_name(const CLI::App* command) {
  const CLI::App* parent = command->get_parent();
  return parent ? full_name(parent) + ' ' + command->get_name() : command->get_name();
}

// What to say about words that no option or command took.
std::string unexpected_sentence(const CLI::App& command, const std::vector<std::string>& words) {
  const auto option =
      std::find_if(words.begin(), words.end(), [](const auto& w) { return w.starts_with('-'); });
  const std::string word = option != words.end() ? *option : words.front();
  const bool takes_commands = !command.get_subcommands({}).empty();
  if (option == words.end() && !takes_commands) return fmt::format("'{}' is not expected here", word);
  const char* kind = option != words.end() ? "option" : "command";
  const std::string name = word.substr(0, word.find('='));
  return fmt::format("unknown {} '{}'; the nearest one is '{}'", kind, word,
                     nearest(name, words_of(command, kind)));
}

// CLI11's own words, but for an option with too few values.
std::string usage_sentence(const CLI::App& command, const CLI::ParseError& error) {
  const std::string words = error.what();
  if (!dynamic_cast<const CLI::ArgumentMismatch*>(&error)) return words;
  const CLI::Option* option = command.get_option_no_throw(words.substr(0, words.find(':')));
  return option ? fmt::format("{} must be followed by {}", option->get_name(), option->get_type_name())
                : words;
}

int report_usage(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
  const CLI::App* command = parsed_command(&app);
  const std::vector<std::string> unexpected = app.remaining(true);
  const bool misspelt = !unexpected.empty() && (dynamic_cast<const CLI::ExtrasError*>(&error) ||
                                                dynamic_cast<const CLI::RequiredError*>(&error));
  const std::string sentence =
      misspelt ? unexpected_sentence(*command, unexpected) : usage_sentence(*command, error);
  return fail(kWrongUsage, fmt::format("{} (see `{} --help`)", sentence, full_name(command)));
}

// As one line that a shell takes apart in the same way.
std::string command_line(int argc, char** argv) {
  std::string line = "lumigrove";
  for (int i = 1; i < argc; ++i) line += fmt::format(" {}", shell_quoted(argv[i]));
  return line;
}

void add_commands(CLI::App& app, const std::string& line) {
  app.set_version_flag("--version", "lumigrove " + version_text());
  app.require_subcommand(1);
  app.get_formatter()->column_width(34);
  add_render_command(app);
  add_rerun_command(app);
  add_compare_command(app, line);
  add_tree_command(app);
  add_audit_command(app);
  add_scene_command(app);
  add_list_command(app);
}

int parse_and_run(int argc, char** argv) {
  CLI::App app("Renders scenes lit by very many lights.", "lumigrove");
  add_commands(app, command_line(argc, argv));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return report_usage(app, error);
  } catch (const ExitCode& code) {
    return code.status;
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout))
    throw Error(fmt::format("standard output cannot be written: {}", std::strerror(errno)));
  return 0;
}

}  // namespace

int run_tool(int argc, char** argv) {
  try {
    return parse_and_run(argc, argv);
  } catch (const Error& error) {
    return fail(kFailed, error.what());
  } catch (const std::bad_alloc&) {
    return fail(kFailed, "out of memory");
  } catch (const std::exception& error) {
    return fail(kFailed, fmt::format("internal failure: {}", error.what()));
  } catch (...) {
    return fail(kFailed, "internal failure of unknown kind");
  }
}

}  // namespace lumigrove
