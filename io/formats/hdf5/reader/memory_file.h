// A file that has no name and lies in memory. What was never written takes none.
#pragma once

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <span>
#include <string>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"

namespace tagrid {

/// All functions throw WorldError.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("plain", MFD_CLOEXEC)) {
    if (descriptor_ < 0) throw world_error("cannot make", "a file in memory", errno);
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  /// A path under which this process, and no other, can open it.
  std::string path() const { return fmt::format("/proc/self/fd/{}", descriptor_); }
  std::uint64_t size() const { return FileSource(path()).size(); }
  /// Bytes of memory that it takes.
  std::uint64_t memory() const {
    constexpr std::uint64_t stat_block = 512;
    struct stat status = {};
    if (fstat(descriptor_, &status) != 0) throw world_error("cannot look at", "a file in memory", errno);
    return static_cast<std::uint64_t>(status.st_blocks) * stat_block;
  }
  /// REQUIRES: begin <= end <= size().
  std::string bytes(std::uint64_t begin, std::uint64_t end) const {
    std::string bytes(end - begin, '\0');
    FileSource(path()).read_at(begin, std::as_writable_bytes(std::span(bytes)));
    return bytes;
  }

 private:
  int descriptor_ = -1;
};

}  // namespace tagrid
