// Where programs that read and write formats are.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tagrid {

/// A program that reads or writes a format, by the name of the format.
struct FoundProgram {
  std::string name, path;

  bool operator==(const FoundProgram&) const = default;
};

/// The directories in which programs are sought, in this order: those of the environment variable
/// TAGRID_READER_PATH (absolute ones only), the directory of this program, and ../libexec/tagrid from there.
std::vector<std::string> program_folders();

/// The path of the program that reads the format of this name: "tagrid-read-NAME" in the first directory
/// that has it. Returns nothing without one, or if `name` has characters other than a-z, 0-9 and '-'. Throws
/// WorldError for a program that any user can change.
std::optional<std::string> find_reader(std::string_view name);

/// The same for the program that writes the format: "tagrid-write-NAME".
std::optional<std::string> find_writer(std::string_view name);

/// The package that brings the program for a format, such as "hdf5".
std::string_view package_of_program(std::string_view name);

/// What to say of a program for the format `name` that no directory has: where it was sought, and how to get it.
std::string about_missing_program(std::string_view name);

/// Finds the program that writes the output at `path`, and throws WorldError if it is not installed. The
/// message names `format`, which the program writes.
std::string writer_for(const std::string& path, std::string_view format, std::string_view name);

/// All readers, and all writers, sorted by their names.
std::vector<FoundProgram> all_readers();
std::vector<FoundProgram> all_writers();

}  // namespace tagrid
