#include "tools/documents/command_line_table.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <regex>

#include "io/formats/table/formats.h"
#include "io/text/text.h"
#include "stages/sample/sample_type.h"
#include "tools/commands/commands.h"

namespace tagrid {
namespace {

using Kind = Completion::Kind;

template <class Can>
std::vector<std::string> names_of_formats(Can can) {
  std::vector<std::string> names;
  for (const Format& format : formats())
    if (can(format)) names.emplace_back(format.name);
  return names;
}

std::vector<std::string> names_of_types() {
  std::vector<std::string> names;
  for (const SampleType type : all_sample_types) names.emplace_back(name_of(type));
  return names;
}

/// Values that the help of an option does not list one by one.
const std::map<std::string, std::vector<std::string>>& usual_values() {
  static const std::map<std::string, std::vector<std::string>> values = {
      {"--format", names_of_formats([](const Format& format) { return format.writes.any(); })},
      {"--from", names_of_formats([](const Format& format) { return format.reads.any(); })},
      {"--type", names_of_types()},
      {"--cube", {"4", "8", "16", "32", "64", "128", "256"}},
      {"--overview", {"4", "16", "64", "256", "1024"}},
      {"--overviews", {"none", "auto", "4", "4,16", "4,16,64"}},
      {"--step", {"1", "2", "4", "8", "16", "32"}}};
  return values;
}

Completion completion_of(const std::string& name, const std::string& value) {
  if (value == "FILE" || value == "ORIGINAL") return {Kind::files};
  if (value == "DIR" || value == "ROOT") return {Kind::directories};
  if (const auto usual = usual_values().find(name); usual != usual_values().end())
    return {Kind::words, usual->second};
  if (value.find('|') == value.npos) return {};
  Completion completion;
  static const std::regex word("[a-z0-9]+");
  for (const std::string_view part : split(value, '|'))
    if (std::regex_match(std::string(part), word)) completion.words.emplace_back(part);
  if (!completion.words.empty()) completion.kind = Kind::words;
  return completion;
}

CommandOption option_of(const CLI::Option& option) {
  CommandOption result;
  result.value = option.get_option_text();
  result.help = option.get_description();
  result.group = option.get_group();
  result.is_required = option.get_required();
  for (const std::string& name : option.get_snames()) result.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) result.names.push_back("--" + name);
  const bool keeps_all = option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
  result.is_repeatable = (keeps_all && !result.value.empty()) || result.name() == "--verbose";
  for (const CLI::Option* other : option.get_excludes()) result.excluded.push_back(other->get_name());
  std::ranges::sort(result.excluded);
  result.completion = completion_of(result.name(), result.value);
  return result;
}

Command command_of(const CLI::App& app, const std::string& name) {
  Command command;
  command.name = name;
  command.help = app.get_description();
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) {
      command.options.push_back(option_of(*option));
      continue;
    }
    // Of several, the first one tells how files are completed.
    if (command.has_input) continue;
    command.has_input = true;
    command.has_several_inputs = option->get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
    command.input.kind = option->get_description().starts_with(".tag")        ? Kind::tag_files
                         : option->get_description().starts_with("Directory") ? Kind::directories
                                                                              : Kind::files;
  }
  return command;
}

}  // namespace

std::vector<Command> command_line_table() {
  CLI::App app("", "tagrid");
  const auto commands = add_commands(app, "");
  std::vector<Command> table = {command_of(app, "")};
  for (const auto& [command, action] : commands) {
    const bool is_in_group = command->get_parent() != &app;
    table.push_back(command_of(
        *command, (is_in_group ? command->get_parent()->get_name() + " " : "") + command->get_name()));
  }
  return table;
}

}  // namespace tagrid
