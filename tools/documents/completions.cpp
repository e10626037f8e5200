// The completions of bash and zsh.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <regex>

#include "tools/documents/documents.h"

namespace tagrid {
namespace {

using Kind = Completion::Kind;

std::string names_of(const std::vector<Command>& commands) {
  std::vector<std::string> names;
  for (const Command& command : commands)
    if (!command.name.empty()) names.push_back(command.name);
  return fmt::format("{}", fmt::join(names, " "));
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
    [[ $word != -* ]] && command=$word && break
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
  return fmt::format("_tagrid_{}() {{\n  _arguments -s{}\n}}\n\n", command.name, arguments);
}

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
    const std::string line = fmt::format("    {}) echo '{}' ;;\n", command.name.empty() ? "*" : command.name,
                                         fmt::join(names, " "));
    (command.name.empty() ? of_the_program : options) += line;
    if (command.has_input) commands_by_input[in_bash(command.input)].push_back(command.name);
  }
  for (const auto& [completion, names] : commands_by_input)
    inputs += fmt::format("    {}) echo '{}' ;;\n", fmt::join(names, " | "), completion);
  for (const auto& [completion, patterns] : patterns_by_completion(commands))
    values += fmt::format("    {}) echo '{}' ;;\n", fmt::join(patterns, " | "), completion);
  return fmt::format(fmt::runtime(bash_frame), fmt::arg("commands", names_of(commands)),
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
    described += fmt::format("    {}\n", single_quoted(command.name + ":" + escaped(command.help, ":")));
  }
  return fmt::format(fmt::runtime(zsh_frame), fmt::arg("functions", functions),
                     fmt::arg("commands", names_of(commands)), fmt::arg("described", described),
                     fmt::arg("options", options));
}

}  // namespace tagrid
