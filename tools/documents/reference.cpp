// The reference of commands and options, as Markdown.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "io/text/text.h"
#include "tools/commands/commands.h"
#include "tools/documents/documents.h"

namespace tagrid {
namespace {

constexpr const char* beginning =
    "# Commands and options\n\n"
    "Every command and every option has a heading, so that it can be linked. The program's help and "
    "`docs/options.in` are\n"
    "the source of this page: do not edit it. The [manual](manual.md) explains the commands by task.\n\n";

/// What GitHub and others make of a heading.
std::string anchor(const std::string& title) {
  std::string result = lower_case(title);
  std::erase_if(result, [](char c) { return c == ',' || c == '.'; });
  std::ranges::replace(result, ' ', '-');
  return result;
}

/// A link to the heading of this name.
std::string link(const std::string& shown, const std::string& title) {
  return fmt::format("[{}](#{})", shown, anchor(title));
}

/// Breaks lines so that none is wider than 120 columns. Ends with a line break.
std::string wrapped(std::string_view text) {
  std::string result;
  if (text.ends_with('\n')) text.remove_suffix(1);
  for (const std::string_view line : split(text, '\n')) {
    const bool continues = line.starts_with("  ");
    const std::string indent(continues || line.starts_with("- ") ? 2 : 0, ' ');
    std::string current(continues ? 2 : 0, ' ');
    bool begins = true;
    for (const std::string_view word : words_of(line)) {
      if (!begins && current.size() + 1 + word.size() > 120) {
        result += current + "\n";
        current = indent;
        begins = true;
      }
      current += (begins ? "" : " ") + std::string(word);
      begins = false;
    }
    result += current + "\n";
  }
  return result;
}

/// The options of a command by their groups, as links.
std::string links_to_options(const Command& command) {
  std::vector<std::string> groups;
  for (const CommandOption& option : command.options)
    if (std::ranges::find(groups, option.group) == groups.end()) groups.push_back(option.group);
  std::string result;
  for (const std::string& group : groups) {
    std::vector<std::string> links;
    for (const CommandOption& option : command.options)
      if (option.group == group) links.push_back(link("`" + option.name() + "`", option.name()));
    result += fmt::format("- {}: {}\n", group, fmt::join(links, ", "));
  }
  return result;
}

std::string section_of(const Command& command, const CommandText& text) {
  std::string result = fmt::format("### {}\n\n{}.\n\n", command.name, command.help);
  for (const std::string& form : text.forms) result += fmt::format("- `{}`\n", form);
  result += "\n";
  if (!text.text.empty()) result += text.text + "\n\n";
  for (const Example& example : examples_of(command.name))
    result += fmt::format("{}:\n\n```\n{}\n```\n\n", example.wish, example.line);
  return result + wrapped(links_to_options(command)) + "\n";
}

std::string section_of(const OptionText& option, const std::vector<Command>& commands) {
  std::string forms;
  for (const std::string& form : forms_of(option.name, commands))
    forms += (forms.empty() ? "`" : ", `") + form + "`";
  std::string result = fmt::format("### {}\n\n{}\n\n", option.name, forms);
  result += wrapped(help_of(option.name, commands)) + "\n";
  return result + (option.text.empty() ? "" : option.text + "\n\n");
}

}  // namespace

std::string reference(const Texts& texts, const std::vector<Command>& commands) {
  std::vector<std::string> to_commands, to_sections;
  for (const Command& command : commands)
    if (!command.name.empty()) to_commands.push_back(link(command.name, command.name));
  for (const Section& section : texts.sections) to_sections.push_back(link(section.title, section.title));
  std::string page = beginning;
  page += wrapped(fmt::format("- Commands: {}\n- Options: {}", fmt::join(to_commands, ", "),
                              fmt::join(to_sections, ", ")));
  page += "\n## Commands\n\n";
  for (const Command& command : commands)
    if (!command.name.empty()) page += section_of(command, texts.commands.at(command.name));
  for (const Section& section : texts.sections) {
    page += fmt::format("## {}\n\n", section.title);
    if (!section.text.empty()) page += section.text + "\n\n";
    for (const OptionText& option : section.options) page += section_of(option, commands);
  }
  page.pop_back();
  return page;
}

}  // namespace tagrid
