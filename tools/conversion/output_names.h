// The names of convert's outputs: paths below one folder, which they never leave.
#pragma once

#include <map>
#include <string>
#include <utility>

namespace tagrid {

/// The output that output=NAME asks for: a path below the folder of the outputs, without "." and empty steps,
/// and with .tag at its end. Throws UsageError if the name is absolute, has a "..", names a folder, or goes
/// through a folder with the name of a file of records.
std::string output_called(const std::string& name);

/// The output that mirrors the folders of `listed`, a path as the list has it: 2019/knee.nhdr becomes
/// 2019/knee.tag. Throws UsageError if the path is absolute or has a "..".
std::string output_mirroring(const std::string& listed);

/// The outputs of a list so far, of which no two may be the same file, and none may be a folder of another.
class TakenOutputs {
 public:
  /// `advice` ends every message.
  explicit TakenOutputs(std::string advice) : advice_(std::move(advice)) {}

  /// Throws UsageError that names the earlier line if `output` and an earlier one cannot both be.
  void take(const std::string& output, std::size_t line);

 private:
  std::string advice_;
  std::map<std::string, std::size_t> files_, folders_;  ///< and their first lines
};

/// Throws UsageError if a folder of `output` below `root` is a symbolic link or is no folder: outputs would
/// leave `root`, or have a second name there. A folder may be missing.
void require_own_folders(const std::string& root, const std::string& output);

/// Makes those folders of `output` below `root` that are missing. They are on the disk when it returns.
/// Throws what require_own_folders() does, and WorldError.
void make_own_folders(const std::string& root, const std::string& output);

}  // namespace tagrid
