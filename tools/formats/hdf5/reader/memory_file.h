// A file that has no name and lies in memory. What was never written takes none.
#pragma once

#include <cstdint>
#include <string>

namespace tagrid {

class MemoryFile {
 public:
  /// Throws WorldError.
  MemoryFile();
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  /// A path under which this process, and no other, can open it.
  std::string path() const;
  std::uint64_t size() const;
  /// Bytes of memory that it takes.
  std::uint64_t memory() const;
  /// REQUIRES: begin <= end <= size(). Throws WorldError.
  std::string bytes(std::uint64_t begin, std::uint64_t end) const;

 private:
  int descriptor_ = -1;
};

}  // namespace tagrid
