// The command line as a table, read from the parser that the program uses: what documents say of it.
#pragma once

#include <string>
#include <vector>

namespace tagrid {

/// What completes a value: any of `words`, the names of files, or nothing.
struct Completion {
  enum class Kind { nothing, words, files, directories, tag_files } kind = Kind::nothing;
  std::vector<std::string> words = {};
};

/// An option of one command.
struct CommandOption {
  std::vector<std::string> names;  ///< {"-T", "--threads"}
  std::string value;               ///< "N"; "" for a flag
  std::string help, group;
  bool is_required = false;
  bool is_repeatable = false;              ///< Each time counts, not only the last.
  std::vector<std::string> excluded = {};  ///< names of options that cannot be combined with it
  Completion completion;

  const std::string& name() const { return names.back(); }
};

struct Command {
  std::string name;  ///< "" for the program itself
  std::string help;
  Completion input;
  bool has_input = false, has_several_inputs = false;
  std::vector<CommandOption> options;
};

/// The program itself, and then its commands in the order of the help.
std::vector<Command> command_line_table();

}  // namespace tagrid
