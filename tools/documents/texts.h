// docs/options.in: what documents say of commands and options beyond the program's help.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/documents/command_line_table.h"

namespace tagrid {

struct CommandText {
  std::vector<std::string> forms;  ///< "tagrid info [options] in.tag"
  std::string text;                ///< as Markdown, like all texts
};

struct OptionText {
  std::string name;  ///< "--max-error"
  std::string text;
};

/// A group of options, in the order in which documents have them.
struct Section {
  std::string title, text;
  std::vector<OptionText> options;
};

struct Texts {
  std::map<std::string, CommandText> commands;
  std::vector<Section> sections;
};

/// Parses the content of docs/options.in. Throws std::runtime_error with the line if it cannot be understood.
Texts texts_in(const std::string& content);

/// Throws std::runtime_error that names all commands and options without a text, and all texts of none.
void compare(const Texts& texts, const std::vector<Command>& commands);

/// What the help of all commands says of an option, as Markdown: one sentence, or a list by command.
std::string help_of(const std::string& option, const std::vector<Command>& commands);

/// The option with its value in each of its forms: {"-T, --threads <N>"}.
std::vector<std::string> forms_of(const std::string& option, const std::vector<Command>& commands);

}  // namespace tagrid
