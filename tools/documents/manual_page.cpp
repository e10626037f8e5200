// The manual page: the frame in docs/tagrid.1.in, with the program's help and docs/options.in at its marks.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <stdexcept>

#include "tools/commands/commands.h"
#include "tools/documents/documents.h"
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

}  // namespace tagrid
