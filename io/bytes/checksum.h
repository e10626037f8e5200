// XXH3, 64 bits, and 128 bits for names.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

struct XXH3_state_s;

namespace tagrid {

/// Checksum of the concatenation of `parts`.
std::uint64_t checksum_of(std::initializer_list<std::span<const std::byte>> parts);

/// The checksum of 128 bits of a text: its higher and its lower half.
std::pair<std::uint64_t, std::uint64_t> wide_checksum_of(std::string_view text);

/// The checksum of bytes that arrive part by part.
class RunningChecksum {
 public:
  RunningChecksum();

  void add(std::span<const std::byte> bytes);
  /// The checksum of all bytes added so far.
  std::uint64_t value() const;

 private:
  std::unique_ptr<XXH3_state_s, void (*)(XXH3_state_s*)> state_;
};

/// The checksum that follows a block in a .tag file. It combines the checksum before it with the block's own,
/// which does not depend on what precedes the block: blocks can be made in any order.
std::uint64_t chained_checksum(std::uint64_t own, std::uint64_t before);

/// True if the checksum in a file is the expected one. With TAGRID_NO_CHECKSUMS it is always true: for
/// fuzzing, which could not guess one. Only test programs are compiled so; see tests/CMakeLists.txt.
bool checksums_agree(std::uint64_t in_file, std::uint64_t computed);

}  // namespace tagrid
