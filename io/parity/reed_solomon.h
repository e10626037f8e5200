// A Reed-Solomon code over GF(2^8): parity blocks from which lost blocks of a stripe are computed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace tagrid {

/// Data and parity blocks that a stripe has at most.
inline constexpr int largest_stripe = 255;

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

}  // namespace tagrid
