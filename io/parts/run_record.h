// Settings and input of a run that can be continued, stored beside its parts: another run must not complete
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "stages/sample/status.h"

namespace tagrid {

/// Identifies a file, and shows whether it has changed. Cheap, however large the file is.
struct FileIdentity {
  std::string path;  ///< absolute, without symbolic links
  std::uint64_t size = 0, inode = 0;
  std::int64_t modified = 0, modified_ns = 0;  ///< when its content changed
  std::int64_t changed = 0, changed_ns = 0;    ///< change time (ctime), which a program cannot set
  std::uint64_t ends_checksum = 0;             ///< of the first and the last MiB
};

/// The identity of the file at `path`. Throws WorldError.
FileIdentity identity_of(const std::string& path);

/// Describes how the file has changed; "" if it has not.
std::string change_of(const FileIdentity& was, const FileIdentity& now);

struct RunRecord {
  std::string program;  ///< with its version: another version may write other bytes
  /// All settings that affect the result: their names, and their values as text.
  std::vector<std::pair<std::string, std::string>> settings;
  std::vector<FileIdentity> inputs;
  std::vector<std::byte> header;  ///< of the .tag file
  /// If the largest error follows from the samples: the rule, and how. Else "".
  std::string error_rule, reason_of_bound;
  /// Inode and size of the result, before and after it gets its name; 0 until it is complete.
  std::uint64_t result_inode = 0, result_size = 0;
};

/// The record as bytes. The last eight are its checksum, which is also in the parts of the run.
std::vector<std::byte> serialize_record(const RunRecord& record);
Status parse_record(std::span<const std::byte> bytes, RunRecord& record);
std::uint64_t run_id(std::span<const std::byte> record_bytes);

/// The first difference between the settings or inputs of two runs; without text if there is none.
Sentence difference_of(const RunRecord& was, const RunRecord& now);

}  // namespace tagrid
