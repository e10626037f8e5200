// Where the blocks, the parity and its description lie. docs/dev/format.md specifies every byte.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/file_bytes.h"

namespace tagrid {

/// Parity as a share of the protected bytes, in thousandths of a per cent: 5000 is 5 %.
using ParityShare = std::uint32_t;
inline constexpr ParityShare least_share = 100, whole_share = 100'000;

/// A share as text: "5 %".
std::string text_of_share(ParityShare share);

/// Data and parity blocks that a stripe has at most: the elements of GF(2^8) but one.
inline constexpr int largest_stripe = 255;

/// Bytes of a description without a payload: the head and the foot of the parity.
inline constexpr std::size_t parity_head_size = 48;

/// The numbers in every description, from which all places follow.
///
/// The protected bytes are cut into `blocks()` blocks. Data and parity blocks are numbered in one sequence,
/// and block u belongs to stripe u mod `stripes`. So a burst of `stripes` blocks hits each stripe once.
struct ParityLayout {
  std::uint64_t file_size = 0;  ///< F: bytes that are protected
  std::uint64_t id = 0;         ///< checksum of the table
  std::uint32_t stripes = 0;
  std::uint8_t log2_block = 0;
  std::uint8_t parity = 0;  ///< parity blocks of a stripe
  ParityShare share = 0;    ///< what was asked for; the parity may be more

  bool operator==(const ParityLayout&) const = default;

  /// The layout for a file; `id` is 0. Throws UsageError if a file is too large. REQUIRES: file_size > 0,
  /// least_share <= share <= whole_share.
  static ParityLayout of(std::uint64_t file_size, ParityShare share);
  /// True if the numbers are possible. All others may only be asked for if they are.
  bool is_valid() const;

  std::uint64_t block_size() const { return std::uint64_t{1} << log2_block; }
  /// Data blocks; the last one is filled up with zeros.
  std::uint64_t blocks() const { return (file_size + block_size() - 1) >> log2_block; }
  /// Data blocks of a stripe. Stripes that have one fewer count a block of zeros.
  int data() const { return static_cast<int>((blocks() + stripes - 1) / stripes); }
  std::uint64_t parity_blocks() const { return std::uint64_t{stripes} * parity; }
  /// Data and parity blocks, each with a checksum in the table.
  std::uint64_t sequence() const { return blocks() + parity_blocks(); }

  /// Bytes of the table in a page.
  std::uint64_t payload() const { return block_size() - parity_head_size; }
  /// Pages of the table, then of the pages with its parity.
  std::uint64_t pages() const { return (8 * sequence() + payload() - 1) / payload(); }
  /// Pages of the table form groups: page p belongs to group p mod groups().
  std::uint64_t groups() const { return (pages() + 126) / 127; }
  int pages_of_group() const { return static_cast<int>((pages() + groups() - 1) / groups()); }
  int parity_of_group() const { return std::max<int>(pages_of_group(), parity); }
  std::uint64_t all_pages() const {
    return pages() + groups() * static_cast<std::uint64_t>(parity_of_group());
  }

  /// Where things lie, if the parity's head lies at `base`: F in the file itself, 0 in a file beside it.
  std::uint64_t first_unit(std::uint64_t base) const {
    return (base + parity_head_size + block_size() - 1) >> log2_block << log2_block;
  }
  std::uint64_t place_of_page(std::uint64_t base, std::uint64_t page) const {
    return first_unit(base) + ((page < pages() ? page : page + parity_blocks()) << log2_block);
  }
  std::uint64_t place_of_parity(std::uint64_t base, std::uint64_t number) const {
    return first_unit(base) + ((pages() + number) << log2_block);
  }
  std::uint64_t foot(std::uint64_t base) const {
    return first_unit(base) + ((all_pages() + parity_blocks()) << log2_block);
  }
  std::uint64_t end(std::uint64_t base) const { return foot(base) + parity_head_size; }

  /// Any single burst of at most so many bytes is repaired.
  std::uint64_t burst() const { return (parity_blocks() - 1) << log2_block; }
};

/// Numbers of descriptions that are no pages.
inline constexpr std::uint32_t head_number = 0xFFFFFFFE, foot_number = 0xFFFFFFFF;

/// A description: head, foot or page, which differ in the payload.
std::vector<std::byte> serialize_description(const ParityLayout& layout, std::uint32_t number,
                                             std::span<const std::byte> payload);

struct ParityDescription {
  ParityLayout layout;
  std::uint32_t number = 0;

  /// Where it lies, and its bytes.
  std::uint64_t place(std::uint64_t base) const;
  std::uint64_t size() const { return number < layout.all_pages() ? layout.block_size() : parity_head_size; }
};

/// What every description begins with.
inline constexpr std::string_view parity_magic = "TAG PAR\n";

/// What a description that begins with these bytes says, if its numbers are possible. Its checksum is not
/// checked.
std::optional<ParityDescription> claimed_description(std::span<const std::byte> bytes);
/// Reads a description that begins with these bytes; its payload follows the first 40. Nothing if they are
/// none.
std::optional<ParityDescription> parse_description(std::span<const std::byte> bytes);

/// The parity at the end of a file of `size` bytes, of which these are the last; nothing if there is no foot.
std::optional<ParityLayout> parity_at_end(std::uint64_t size, std::span<const std::byte> last);
/// The same for a file that can be read.
std::optional<ParityLayout> parity_at_end(const ByteSource& file);

/// The first `size` bytes of a file: that without its parity.
std::shared_ptr<const ByteSource> beginning_of(std::shared_ptr<const ByteSource> source, std::uint64_t size);

/// The parity whose head follows at `position`, the end of the protected bytes; nothing if `head` is none.
std::optional<ParityLayout> parity_that_follows(std::span<const std::byte> head, std::uint64_t position);

}  // namespace tagrid
