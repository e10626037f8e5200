#include "tools/documents/texts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>

namespace tagrid {
namespace {

/// Help as Markdown: options as code, and a list where it has several lines. It ends as a sentence.
std::string as_markdown(const CommandOption& option) {
  static const std::regex special("([*_<`])"), name("(^|[ (])(--?[a-zA-Z][a-z-]*)");
  std::string text = std::regex_replace(option.help, special, "\\$1");
  text = std::regex_replace(text, name, "$1`$2`");
  if (text.find('\n') == text.npos && text.back() != '.') text += '.';
  text = std::regex_replace(text, std::regex("\n"), "\n- ");
  return text + (option.is_required ? " Required." : "");
}

std::string form_of(const CommandOption& option) {
  return fmt::format("{}", fmt::join(option.names, ", ")) +
         (option.value.empty() ? "" : " <" + option.value + ">");
}

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (std::size_t i = 0; i < names.size(); ++i)
    list += fmt::format("{}`{}`", i == 0 ? "" : i + 1 == names.size() ? " and " : ", ", names[i]);
  return list;
}

/// The commands in which an option has the same help and form.
struct Use {
  std::string help, form;
  std::vector<std::string> commands;
};

std::vector<Use> uses_of(const std::string& name, const std::vector<Command>& commands) {
  std::vector<Use> uses;
  for (const Command& command : commands) {
    for (const CommandOption& option : command.options) {
      if (option.name() != name) continue;
      const Use use{as_markdown(option), form_of(option), {}};
      auto same =
          std::ranges::find_if(uses, [&](const Use& u) { return u.help == use.help && u.form == use.form; });
      if (same == uses.end()) same = uses.insert(uses.end(), use);
      same->commands.push_back(command.name.empty() ? "tagrid" : command.name);
    }
  }
  return uses;
}

/// "`encode` and `convert`"; "" for all commands.
std::string with(const std::vector<std::string>& with, const std::vector<Command>& commands) {
  std::vector<std::string> without;
  for (const Command& command : commands)
    if (!command.name.empty() && std::ranges::find(with, command.name) == with.end())
      without.push_back(command.name);
  if (without.empty()) return "";
  return with.size() > without.size() ? fmt::format("All commands except {}", listed(without)) : listed(with);
}

}  // namespace

Texts texts_in(const std::string& content) {
  Texts texts;
  std::string part;
  // Where the next line of text belongs to.
  std::string* text = nullptr;
  CommandText* command = nullptr;
  bool in_code = false;
  int number = 0;
  std::istringstream lines(content);
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.starts_with("# ")) {
      part = line.substr(2);
      text = nullptr;
    } else if (line.starts_with("## ") && part == "Commands") {
      command = &texts.commands[line.substr(3)];
      text = &command->text;
    } else if (line.starts_with("## ")) {
      command = nullptr;
      text = &texts.sections.emplace_back(Section{line.substr(3), "", {}}).text;
    } else if (line.starts_with("### ") && !texts.sections.empty()) {
      text = &texts.sections.back().options.emplace_back(OptionText{line.substr(4), ""}).text;
    } else if (line == "```" && command != nullptr) {
      in_code = !in_code;
    } else if (in_code) {
      command->forms.push_back(line);
    } else if (text != nullptr) {
      *text += line + "\n";
    } else if (!line.empty() && !part.empty()) {
      throw std::runtime_error(fmt::format("line {}: a text that belongs to nothing: {}", number, line));
    }
  }
  const auto trim = [](std::string& t) {
    t.erase(0, t.find_first_not_of('\n'));
    t.erase(t.find_last_not_of('\n') + 1);
  };
  for (auto& [name, of_command] : texts.commands) trim(of_command.text);
  for (Section& section : texts.sections) {
    trim(section.text);
    for (OptionText& option : section.options) trim(option.text);
  }
  return texts;
}

void compare(const Texts& texts, const std::vector<Command>& commands) {
  std::multiset<std::string> described, existing;
  for (const auto& [name, text] : texts.commands) described.insert(name);
  for (const Section& section : texts.sections)
    for (const OptionText& option : section.options) described.insert(option.name);
  for (const Command& command : commands) {
    if (!command.name.empty()) existing.insert(command.name);
    for (const CommandOption& option : command.options)
      if (!existing.contains(option.name())) existing.insert(option.name());
  }
  std::vector<std::string> missing, unknown;
  std::ranges::set_difference(existing, described, std::back_inserter(missing));
  std::ranges::set_difference(described, existing, std::back_inserter(unknown));
  if (!missing.empty() || !unknown.empty())
    throw std::runtime_error(fmt::format("without a heading: {}; not in the program, or twice: {}",
                                         fmt::join(missing, " "), fmt::join(unknown, " ")));
}

std::string help_of(const std::string& option, const std::vector<Command>& commands) {
  const std::vector<Use> uses = uses_of(option, commands);
  const bool has_forms = forms_of(option, commands).size() > 1;
  // Which commands have it is said where they are few: sections and commands tell the rest.
  if (uses.size() == 1) {
    const std::vector<std::string>& of = uses.front().commands;
    return (of.size() == 1 ? with(of, commands) + ":\n" : "") + uses.front().help;
  }
  std::string list;
  for (const Use& use : uses)
    list += fmt::format("{}- {}{}:\n  {}", list.empty() ? "" : "\n", with(use.commands, commands),
                        has_forms ? ", `" + use.form + "`" : "", use.help);
  return list;
}

std::vector<std::string> forms_of(const std::string& option, const std::vector<Command>& commands) {
  std::vector<std::string> forms;
  for (const Use& use : uses_of(option, commands))
    if (std::ranges::find(forms, use.form) == forms.end()) forms.push_back(use.form);
  return forms;
}

}  // namespace tagrid
