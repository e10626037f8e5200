// A file that has no name and lies in memory. What was never written takes none.
#pragma once

#include <cerrno>
#include <cstdint>
#include <span>
#include <string>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/system/files.h"
#include "io/system/this_process.h"

namespace tagrid {

/// All functions throw WorldError.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(open_memory_file()) {
    if (descriptor_ < 0) throw world_error("cannot make", "a file in memory", errno);
  }

  /// A path under which this process, and no other, can open it.
  std::string path() const { return path_of_open_file(descriptor_); }
  std::uint64_t size() const { return FileSource(path()).size(); }
  /// Bytes of memory that it takes.
  std::uint64_t memory() const {
    FileStatus status;
    if (!files().status(descriptor_, status)) throw world_error("cannot look at", "a file in memory", errno);
    return status.stored;
  }
  /// REQUIRES: begin <= end <= size().
  std::string bytes(std::uint64_t begin, std::uint64_t end) const {
    std::string bytes(end - begin, '\0');
    FileSource(path()).read_at(begin, std::as_writable_bytes(std::span(bytes)));
    return bytes;
  }

 private:
  Descriptor descriptor_;
};

}  // namespace tagrid
