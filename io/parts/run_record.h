// What a run that can be continued was asked for, and what it reads: beside its parts, so that they are not
// completed with those of another run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/files/errors.h"
#include "stages/volume/status.h"

namespace tagrid {

/// Which file, and whether it is still the same: cheap to find out, however large the file is.
struct FileIdentity {
  std::string path;  ///< absolute, without symbolic links
  std::uint64_t size = 0, inode = 0;
  std::int64_t modified = 0, modified_ns = 0;  ///< the time of its content
  std::int64_t changed = 0, changed_ns = 0;    ///< the time of its status: nobody can set that
  std::uint64_t ends_checksum = 0;             ///< of the first and the last MiB
};

/// Of the file at `path`. Throws WorldError.
FileIdentity identity_of(const std::string& path);

/// What shows that the file is another one now, in words; "" where nothing does.
std::string change_of(const FileIdentity& was, const FileIdentity& now);

struct RunRecord {
  std::string program;  ///< with its version: another one may make other bytes
  /// Everything that decides on the result: names of settings, and their values as text.
  std::vector<std::pair<std::string, std::string>> settings;
  std::vector<FileIdentity> inputs;
  std::vector<std::byte> header;  ///< of the .tag file
  /// Which file the result is, before and after it gets its name: inode and size. 0 until it is complete.
  std::uint64_t result_inode = 0, result_size = 0;
};

/// The record as bytes; the last eight are its checksum, which the parts of the run bear.
std::vector<std::byte> serialize_record(const RunRecord& record);
Status parse_record(std::span<const std::byte> bytes, RunRecord& record);
std::uint64_t run_id(std::span<const std::byte> record_bytes);

/// The first thing in which what two runs are asked for differs; without text where they are the same.
Sentence difference_of(const RunRecord& was, const RunRecord& now);

}  // namespace tagrid
