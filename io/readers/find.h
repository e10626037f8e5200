// Where reader programs are.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// A program that reads a format, by the name of the format.
struct ReaderProgram {
  std::string name, path;

  bool operator==(const ReaderProgram&) const = default;
};

/// The folders in which readers are sought, in this order: those of the environment variable TAGRID_READER_PATH
/// (absolute ones only), the folder of this program, and ../libexec/tagrid from there.
std::vector<std::string> reader_folders();

/// The path of the program that reads the format of this name: "tagrid-read-NAME" in the first folder that has it.
/// Nothing if there is none, or if `name` has characters other than a-z, 0-9 and '-'. Throws WorldError for a program
/// that any user can change.
std::optional<std::string> find_reader(std::string_view name);

/// All readers, sorted by their names.
std::vector<ReaderProgram> all_readers();

}  // namespace tagrid
