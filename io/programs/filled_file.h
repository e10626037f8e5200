// An output that a program fills.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "io/files/output_file.h"

namespace tagrid {

/// Gives a program the temporary file of an output to fill. Pipes and devices get a copy of what it wrote.
class FilledFile {
 public:
  /// `file` must outlive the object; nothing has been written to it. `path`: its own. What is for a pipe or a
  /// device waits in a temporary file in the folder `spool`, or in that for temporary files.
  FilledFile(OutputFile& file, const std::string& path, const std::optional<std::string>& spool = {});
  ~FilledFile();
  FilledFile(const FilledFile&) = delete;
  FilledFile& operator=(const FilledFile&) = delete;

  /// An empty file, for the program.
  const std::string& path() const { return path_; }
  /// For messages: the name of the output, and the directory in which it waits, which may be full.
  const std::string& name() const { return name_; }
  /// To be called once, when the program has ended. Throws WorldError if it removed or replaced the file.
  /// Returns the bytes of the entire output.
  std::uint64_t complete();

 private:
  class Waiting;

  OutputFile& file_;
  std::unique_ptr<Waiting> waiting_;
  std::string path_, name_;
  FileStatus filled_;  ///< that of the file that the program fills, at its beginning
};

}  // namespace tagrid
