// A Reed-Solomon code over GF(2^8): parity blocks from which lost blocks of a stripe are computed.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "io/parity/layout.h"

namespace tagrid {

/// Makes the parity blocks of stripes with `data` data blocks and `parity` parity blocks. The matrix is that
/// of Cauchy, 1 / (row xor column), whose square parts are all invertible: any `parity` lost blocks come
/// back.
class ReedSolomon {
 public:
  /// REQUIRES: data >= 1, parity >= 1, data + parity <= largest_stripe.
  ReedSolomon(int data, int parity);

  /// Computes the parity blocks. `blocks` points to the data blocks, then to the parity blocks, which are
  /// written; all have `size` bytes.
  void encode(std::span<std::byte* const> blocks, std::size_t size) const;

  /// Computes lost blocks, data or parity, from the others, which are not changed. REQUIRES: `lost` are
  /// numbers of blocks in increasing order, at most `parity` of them.
  void restore(std::span<std::byte* const> blocks, std::span<const int> lost, std::size_t size) const;

 private:
  /// The same for data blocks alone. `all_lost` are the parity blocks that are lost, too.
  void restore_data(std::span<std::byte* const> blocks, std::span<const int> lost,
                    std::span<const int> all_lost, std::size_t size) const;
  const unsigned char* row(int block) const { return matrix_.data() + block * data_; }

  int data_, parity_;
  std::vector<unsigned char> matrix_;  ///< (data + parity) x data: the identity, then the rows of the parity
  std::vector<unsigned char> tables_;  ///< ISA-L's form of the rows of the parity
};

// Some neighbouring stripes in memory.

/// Blocks that follow each other in the file or in its parity, and in memory.
struct BlockRun {
  bool is_parity = false;
  std::uint64_t first = 0;     ///< number of the first block of the file, or of the parity
  std::span<std::byte> bytes;  ///< complete blocks
};

/// The blocks of stripes `first` to `first + count` - 1: row after row, first data, then parity, and in a row
/// stripe after stripe. A row of data is one run in the file: long reads, although stripes are interleaved.
class StripeBand {
 public:
  /// As many stripes at once as fit into `memory`, but at least one.
  StripeBand(const ParityLayout& layout, std::uint64_t memory);

  /// Moves to the next stripes: at first, to the first ones. Returns false after the last one.
  bool next();

  std::uint64_t first() const { return first_; }
  std::uint64_t count() const { return count_; }
  int rows() const { return layout_.data() + layout_.parity; }

  /// Block of a row of stripe first() + i.
  std::span<std::byte> block(int row, std::uint64_t i) {
    return {row_of(row) + i * layout_.block_size(), layout_.block_size()};
  }
  /// The beginnings of the rows. One code is that of all stripes, so rows are coded as if they were blocks.
  const std::vector<std::byte*>& row_starts() const { return row_starts_; }
  std::uint64_t row_bytes() const { return count_ * layout_.block_size(); }

  /// Number of that block in the sequence of data and parity blocks; nothing for a block of zeros that fills
  /// a stripe up.
  std::optional<std::uint64_t> number(int row, std::uint64_t i) const;

  /// Calls use(BlockRun) for the runs of the rows of data, or of parity.
  template <class Use>
  void for_each_run(bool parity, Use use) {
    for (int row = parity ? layout_.data() : 0; row < (parity ? rows() : layout_.data()); ++row)
      for (std::uint64_t i = 0; i < count_;) {
        const auto run = run_at(row, i);
        if (!run) break;
        use(*run);
        i += run->bytes.size() / layout_.block_size();
      }
  }
  /// Makes the blocks zero that fill stripes up.
  void fill_up();

 private:
  /// The run that begins with a block; nothing where blocks of zeros fill a stripe up.
  std::optional<BlockRun> run_at(int row, std::uint64_t i);
  std::byte* row_of(int row) {
    return buffer_.data() + static_cast<std::uint64_t>(row) * most_ * layout_.block_size();
  }
  /// Place of a stripe in a row of parity, which continues the sequence of data blocks.
  std::uint64_t phase(std::uint64_t stripe) const {
    return (stripe + layout_.stripes - layout_.blocks() % layout_.stripes) % layout_.stripes;
  }

  ParityLayout layout_;
  std::uint64_t most_ = 1, first_ = 0, count_ = 0;
  std::vector<std::byte> buffer_;
  std::vector<std::byte*> row_starts_;
};

}  // namespace tagrid
