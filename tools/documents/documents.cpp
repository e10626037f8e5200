// The manual page: the frame in docs/tagrid.1.in, with the program's help and docs/options.in at its marks.
#include "tools/documents/documents.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <regex>
#include <stdexcept>

#include "io/text/text.h"
#include "tools/commands/commands.h"
#include "tools/documents/roff.h"

namespace tagrid {
namespace {

std::string synopsis(const Texts& texts, const std::vector<Command>& commands) {
  std::string result;
  for (const Command& command : commands)
    if (!command.name.empty())
      for (const std::string& form : texts.commands.at(command.name).forms) result += roff_form(form);
  return result;
}

std::string list_of_commands(const Texts& texts, const std::vector<Command>& commands) {
  std::string result = ".Bl -tag -width phantom\n";
  for (const Command& command : commands)
    if (!command.name.empty())
      result += fmt::format(".It Cm {}\n{}.\n{}", command.name, roff_text(command.help),
                            roff("\n" + texts.commands.at(command.name).text));
  return result + ".El\n";
}

/// "Fl T , Fl -threads Ar N"
std::string entry(const std::string& form) {
  const std::size_t value = form.find(" <");
  std::string names = form.substr(0, value), result = "Fl ";
  names.erase(0, 1);
  if (const std::size_t comma = names.find(", -"); comma != names.npos) names.replace(comma, 3, " , Fl ");
  result += names;
  if (value != form.npos) result += " Ar " + form.substr(value + 2, form.size() - value - 3);
  return result;
}

std::string options(const Texts& texts, const std::vector<Command>& commands) {
  std::string result;
  for (const Section& section : texts.sections) {
    result += fmt::format(".Ss {}\n{}.Bl -tag -width Ds\n", section.title, roff(section.text));
    for (const OptionText& option : section.options) {
      std::string entries;
      for (const std::string& form : forms_of(option.name, commands))
        entries += (entries.empty() ? "" : " | ") + entry(form);
      const std::string help = help_of(option.name, commands);
      const bool is_list = help.find("\n- ") != help.npos || help.starts_with("- ");
      result += fmt::format(".It {}\n{}", entries, roff(help + (is_list ? "\n\n" : "\n") + option.text));
    }
    result += ".El\n";
  }
  return result;
}

std::string examples(const std::vector<Command>& commands) {
  std::string result;
  for (const Command& command : commands)
    if (!command.name.empty())
      for (const Example& example : examples_of(command.name))
        result += fmt::format("{}{}:\n.Dl {}\n", result.empty() ? "" : ".Pp\n", roff_text(example.wish),
                              roff_text(example.line));
  return result;
}

void put(std::string& page, const std::string& mark, const std::string& text) {
  const std::size_t at = page.find("\n" + mark + "\n");
  if (at == page.npos) throw std::runtime_error("the frame of the manual page has no line " + mark);
  page.replace(at + 1, mark.size() + 1, text);
}

}  // namespace

std::string manual_page(const std::string& frame, const Texts& texts, const std::vector<Command>& commands) {
  std::string page = frame;
  put(page, "@SYNOPSIS@", synopsis(texts, commands));
  put(page, "@COMMANDS@", list_of_commands(texts, commands));
  put(page, "@OPTIONS@", options(texts, commands));
  put(page, "@EXAMPLES@", examples(commands));
  return page;
}

// The reference of commands and options, as Markdown.

namespace {

constexpr const char* beginning =
    "# Commands and options\n\n"
    "The [manual](manual.md) has examples. This page is made from the program's help and `docs/options.in`: "
    "do not edit it.\n\n";

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

/// The options of a command by their groups, as links; without those of the section.
std::string links_to_options(const Command& command, const Section& without) {
  std::vector<std::pair<std::string, std::vector<std::string>>> groups;
  for (const CommandOption& option : command.options) {
    const std::string name = option.name();
    if (std::ranges::find(without.options, name, &OptionText::name) != without.options.end()) continue;
    auto group = std::ranges::find(groups, option.group, [](const auto& one) { return one.first; });
    if (group == groups.end()) group = groups.insert(groups.end(), {option.group, {}});
    group->second.push_back(link("`" + name + "`", name));
  }
  std::string result;
  for (const auto& [group, links] : groups)
    result += fmt::format("- {}: {}\n", group, fmt::join(links, ", "));
  return result;
}

std::string section_of(const Command& command, const CommandText& text, const Section& common) {
  std::string result = fmt::format("### {}\n\n{}.\n\n", command.name, command.help);
  for (const std::string& form : text.forms) result += fmt::format("- `{}`\n", form);
  result += "\n";
  if (!text.text.empty()) result += text.text + "\n\n";
  const std::string links = links_to_options(command, common);
  return result + (links.empty() ? "" : wrapped(links) + "\n");
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
    if (!command.name.empty())
      page += section_of(command, texts.commands.at(command.name), texts.sections.front());
  for (const Section& section : texts.sections) {
    page += fmt::format("## {}\n\n", section.title);
    if (!section.text.empty()) page += section.text + "\n\n";
    for (const OptionText& option : section.options) page += section_of(option, commands);
  }
  page.pop_back();
  return page;
}

// The completions of bash and zsh.

namespace {

using Kind = Completion::Kind;

/// "archive" of "archive list"; the name itself for a command that is in no group.
std::string first_word(const std::string& name) { return name.substr(0, name.find(' ')); }

/// The first words of all commands, each once.
std::string names_of(const std::vector<Command>& commands) {
  std::vector<std::string> names;
  for (const Command& command : commands)
    if (!command.name.empty() && (names.empty() || names.back() != first_word(command.name)))
      names.push_back(first_word(command.name));
  return fmt::format("{}", fmt::join(names, " "));
}

/// The groups of commands, each with the second words of its commands and their help.
std::map<std::string, std::vector<std::pair<std::string, std::string>>> groups_of(
    const std::vector<Command>& commands) {
  std::map<std::string, std::vector<std::pair<std::string, std::string>>> groups;
  for (const Command& command : commands)
    if (const std::string group = first_word(command.name); group != command.name)
      groups[group].emplace_back(command.name.substr(group.size() + 1), command.help);
  return groups;
}

/// What the function for bash does with a completion: words, or the word for one of its cases.
std::string in_bash(const Completion& completion) {
  switch (completion.kind) {
    case Kind::words:
      return fmt::format("{}", fmt::join(completion.words, " "));
    case Kind::files:
      return "@files";
    case Kind::directories:
      return "@directories";
    case Kind::tag_files:
      return "@tag_files";
    case Kind::nothing:
      break;
  }
  return "@nothing";
}

/// For each way to complete a value, the patterns of "command option": for any command if all that have the option
/// complete it in this way.
std::map<std::string, std::vector<std::string>> patterns_by_completion(const std::vector<Command>& commands) {
  std::map<std::string, std::map<std::string, std::vector<std::string>>>
      ways;  // of each option: its commands
  for (const Command& command : commands)
    for (const CommandOption& option : command.options)
      for (const std::string& name : option.names)
        ways[name][option.value.empty() ? "" : in_bash(option.completion)].push_back(command.name);
  std::map<std::string, std::vector<std::string>> patterns;
  for (const auto& [name, completions] : ways)
    for (const auto& [completion, of_commands] : completions) {
      if (completion.empty()) continue;
      if (completions.size() == 1)
        patterns[completion].push_back(fmt::format("*' {}'", name));
      else
        for (const std::string& command : of_commands)
          patterns[completion].push_back(fmt::format("'{} {}'", command, name));
    }
  return patterns;
}

constexpr const char* bash_frame =
    R"(# Completion of tagrid for bash; to be installed as bash-completion/completions/tagrid.
# tagrid_documents made this file from the command line of the program.

_tagrid_commands='{commands}'
# Commands of two words.
_tagrid_groups='{groups}'

_tagrid_options() {{
  case $1 in
{options}  esac
}}

# How the value of an option is completed: $1 is "command option". Nothing for an option without a value.
_tagrid_values() {{
  case $1 in
{values}  esac
}}

_tagrid_input() {{
  case $1 in
{inputs}  esac
}}

_tagrid() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} command='' word how=''
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    [[ $word == -* ]] && continue
    command+=${{command:+ }}$word
    [[ " $_tagrid_groups " == *" $command "* ]] || break
  done
  # --option=value comes as three words.
  [[ $current == = ]] && current=''
  [[ $before == = ]] && before=${{COMP_WORDS[COMP_CWORD - 2]}}
  [[ $before == -* ]] && how=$(_tagrid_values "$command $before")
  if [[ -n $how ]]; then
    :
  elif [[ $current == -* ]]; then
    how=$(_tagrid_options "$command")
  elif [[ -z $command || $command == help ]]; then
    how=$_tagrid_commands
  else
    how=$(_tagrid_input "$command")
  fi
  COMPREPLY=()
  case $how in
    @nothing) ;;
    @directories) mapfile -t COMPREPLY < <(compgen -d -- "$current") ;;
    @tag_files) mapfile -t COMPREPLY < <({{ compgen -f -X '!*.tag' -- "$current"; compgen -d -- "$current"; }} | sort -u) ;;
    @files) mapfile -t COMPREPLY < <(compgen -f -- "$current") ;;
    *) mapfile -t COMPREPLY < <(compgen -W "$how" -- "$current") ;;
  esac
  # A .tag file can have any name.
  if [[ $how == @tag_files && ${{#COMPREPLY[@]}} == 0 ]]; then mapfile -t COMPREPLY < <(compgen -f -- "$current"); fi
}}

complete -o filenames -F _tagrid tagrid tagrid-mpi
)";

/// In single quotes, as shells read it.
std::string single_quoted(const std::string& text) {
  return "'" + std::regex_replace(text, std::regex("'"), "'\\''") + "'";
}

std::string escaped(std::string text, const char* characters) {
  for (std::size_t i = 0; (i = text.find_first_of(characters, i)) != text.npos; i += 2)
    text.insert(i, 1, '\\');
  return text;
}

/// The first clause of a help text, in brackets.
std::string in_brief(const std::string& help) {
  std::string brief = help.substr(0, std::min({help.find('\n'), help.find("; "), help.find(" (default")}));
  if (brief.size() > 80)
    brief = brief.substr(0, std::min({brief.find(": "), brief.find(", "), brief.find(" (")}));
  return "[" + escaped(brief, "[]") + "]";
}

std::string in_zsh(const Completion& completion) {
  switch (completion.kind) {
    case Kind::words:
      return fmt::format("({})", fmt::join(completion.words, " "));
    case Kind::files:
      return "_files";
    case Kind::directories:
      return "_files -/";
    case Kind::tag_files:
      return "_files -g \"*.tag(-.)\"";
    case Kind::nothing:
      break;
  }
  return " ";
}

/// An option as an argument of _arguments.
std::string zsh_option(const CommandOption& option) {
  std::string excluded, names;
  if (!option.is_repeatable && option.names.size() + option.excluded.size() > 1)
    excluded = fmt::format("({}{}{})", fmt::join(option.names, " "), option.excluded.empty() ? "" : " ",
                           fmt::join(option.excluded, " "));
  if (option.is_repeatable) excluded = "*";
  for (const std::string& name : option.names) {
    const char* joint = option.value.empty() ? "" : name.starts_with("--") ? "=" : "+";
    names += (names.empty() ? "" : ",") + name + joint;
  }
  std::string rest = in_brief(option.help);
  if (!option.value.empty())
    rest += fmt::format(":{}:{}", escaped(option.value, ":"), in_zsh(option.completion));
  if (option.names.size() == 1) return single_quoted(excluded + names + rest);
  return (excluded.empty() ? "" : single_quoted(excluded)) + "{" + names + "}" + single_quoted(rest);
}

std::string zsh_options(const Command& command) {
  std::string result;
  for (const CommandOption& option : command.options) result += " \\\n    " + zsh_option(option);
  return result;
}

std::string zsh_function(const Command& command) {
  std::string arguments = zsh_options(command);
  if (command.has_input)
    arguments += " \\\n    " + single_quoted((command.has_several_inputs ? "*:input:" : "1:input:") +
                                             in_zsh(command.input));
  std::string name = command.name;
  std::ranges::replace(name, ' ', '_');
  return fmt::format("_tagrid_{}() {{\n  _arguments -s{}\n}}\n\n", name, arguments);
}

/// A command and its help, as an argument of _describe.
std::string zsh_described(const std::string& name, const std::string& help) {
  return fmt::format("    {}\n", single_quoted(name + ":" + escaped(help, ":")));
}

constexpr const char* zsh_group = R"(_tagrid_{group}() {{
  local state line
  local -a commands=(
{described}  )
  _arguments -C '1:command:->command' '*::argument:->argument'
  case $state in
    command) _describe command commands ;;
    argument) (( $+functions[_tagrid_{group}_$line[1]] )) && _tagrid_{group}_$line[1] ;;
  esac
}}

)";

constexpr const char* zsh_frame = R"(#compdef tagrid tagrid-mpi
# Completion of tagrid for zsh; to be installed in a directory of $fpath.
# tagrid_documents made this file from the command line of the program.

{functions}_tagrid_help() {{
  _arguments '1:command:({commands})'
}}

_tagrid() {{
  local state line
  local -a commands=(
{described}  )
  _arguments -C{options} \
    '1:command:->command' '*::argument:->argument'
  case $state in
    command) _describe command commands ;;
    argument) (( $+functions[_tagrid_$line[1]] )) && _tagrid_$line[1] ;;
  esac
}}

_tagrid "$@"
)";

}  // namespace

std::string bash_completion(const std::vector<Command>& commands) {
  std::string options, values, inputs, of_the_program;
  std::map<std::string, std::vector<std::string>> commands_by_input;
  for (const Command& command : commands) {
    std::vector<std::string> names;
    for (const CommandOption& option : command.options)
      names.insert(names.end(), option.names.begin(), option.names.end());
    const std::string line =
        fmt::format("    {}) echo '{}' ;;\n", command.name.empty() ? "*" : single_quoted(command.name),
                    fmt::join(names, " "));
    (command.name.empty() ? of_the_program : options) += line;
    if (command.has_input) commands_by_input[in_bash(command.input)].push_back(single_quoted(command.name));
  }
  std::vector<std::string> groups;
  for (const auto& [group, of_group] : groups_of(commands)) {
    groups.push_back(group);
    std::vector<std::string> words;
    for (const auto& [word, help] : of_group) words.push_back(word);
    inputs += fmt::format("    {}) echo '{}' ;;\n", group, fmt::join(words, " "));
  }
  for (const auto& [completion, names] : commands_by_input)
    inputs += fmt::format("    {}) echo '{}' ;;\n", fmt::join(names, " | "), completion);
  for (const auto& [completion, patterns] : patterns_by_completion(commands))
    values += fmt::format("    {}) echo '{}' ;;\n", fmt::join(patterns, " | "), completion);
  return fmt::format(fmt::runtime(bash_frame), fmt::arg("commands", names_of(commands)),
                     fmt::arg("groups", fmt::format("{}", fmt::join(groups, " "))),
                     fmt::arg("options", options + of_the_program), fmt::arg("values", values),
                     fmt::arg("inputs", inputs + "    *) echo '@nothing' ;;\n"));
}

std::string zsh_completion(const std::vector<Command>& commands) {
  std::string functions, described, options;
  for (const Command& command : commands) {
    if (command.name.empty()) {
      options = zsh_options(command);
      continue;
    }
    functions += zsh_function(command);
    if (first_word(command.name) == command.name) described += zsh_described(command.name, command.help);
  }
  for (const auto& [group, of_group] : groups_of(commands)) {
    std::string of_words, words;
    for (const auto& [word, help] : of_group) {
      of_words += zsh_described(word, help);
      words += (words.empty() ? "" : ", ") + word;
    }
    functions +=
        fmt::format(fmt::runtime(zsh_group), fmt::arg("group", group), fmt::arg("described", of_words));
    described += zsh_described(group, "Archives: " + words);
  }
  return fmt::format(fmt::runtime(zsh_frame), fmt::arg("functions", functions),
                     fmt::arg("commands", names_of(commands)), fmt::arg("described", described),
                     fmt::arg("options", options));
}

}  // namespace tagrid
