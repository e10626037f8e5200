// XXH3, 64 bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>

namespace tagrid {

/// Checksum of the concatenation of `parts`.
std::uint64_t checksum_of(std::initializer_list<std::span<const std::byte>> parts);

/// The checksum of bytes that come one part after the other.
class RunningChecksum {
 public:
  RunningChecksum();
  ~RunningChecksum();
  RunningChecksum(const RunningChecksum&) = delete;
  RunningChecksum& operator=(const RunningChecksum&) = delete;

  void add(std::span<const std::byte> bytes);
  /// Of all that was added so far.
  std::uint64_t value() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The checksum that follows a block in a .tag file: of the block's own (which is known without what precedes
/// it, so that blocks can be made anywhere and in any order) and of the checksum before it in the file.
std::uint64_t chained_checksum(std::uint64_t own, std::uint64_t before);

/// Whether a checksum that a file has is the one that it should have. With TAGRID_NO_CHECKSUMS always: for
/// fuzzing, which could not guess one. Only test programs are compiled so; see tests/CMakeLists.txt.
bool checksums_agree(std::uint64_t in_file, std::uint64_t computed);

}  // namespace tagrid
