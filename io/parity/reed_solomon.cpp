#include "io/parity/reed_solomon.h"

#include <isa-l/erasure_code.h>

#include <algorithm>
#include <cassert>
#include <stdexcept>

#include "io/bytes/memory_size.h"

namespace tagrid {
namespace {

constexpr std::size_t bytes_of_table = 32;  // of one coefficient, in ISA-L

std::size_t in_size(int n) { return static_cast<std::size_t>(n); }

unsigned char* bytes_of(std::span<std::byte* const> blocks, int i) {
  return reinterpret_cast<unsigned char*>(blocks[in_size(i)]);
}

/// Of each block at a time: so the results stay in the fastest cache while all blocks are added to them.
constexpr std::size_t piece = 2048;

/// Writes combinations of `from` to `to`. Block by block: that reads its coefficients once a piece, where
/// ec_encode_data() reads them for every vector. ISA-L takes pointers to bytes that it does not change.
void combine(const std::vector<unsigned char>& tables, const std::vector<unsigned char*>& from,
             const std::vector<unsigned char*>& to, std::size_t size) {
  const int columns = static_cast<int>(from.size()), rows = static_cast<int>(to.size());
  std::vector<unsigned char*> sums = to;
  for (std::size_t begin = 0; begin < size; begin += piece) {
    const std::size_t count = std::min(piece, size - begin);
    for (std::size_t i = 0; i < to.size(); ++i) {
      sums[i] = to[i] + begin;
      std::fill_n(sums[i], count, static_cast<unsigned char>(0));
    }
    for (int column = 0; column < columns; ++column)
      ec_encode_data_update(static_cast<int>(count), columns, rows, column,
                            const_cast<unsigned char*>(tables.data()), from[in_size(column)] + begin,
                            sums.data());
  }
}

std::vector<unsigned char> tables_of(std::vector<unsigned char> rows, int columns) {
  const int count = static_cast<int>(rows.size()) / columns;
  std::vector<unsigned char> tables(rows.size() * bytes_of_table);
  ec_init_tables(columns, count, rows.data(), tables.data());
  return tables;
}

}  // namespace

ReedSolomon::ReedSolomon(int data, int parity) : data_(data), parity_(parity) {
  assert(data >= 1 && parity >= 1 && data + parity <= largest_stripe);
  matrix_.resize(in_size(data + parity) * in_size(data));
  gf_gen_cauchy1_matrix(matrix_.data(), data + parity, data);
  tables_ = tables_of({matrix_.begin() + data * data, matrix_.end()}, data);
}

void ReedSolomon::encode(std::span<std::byte* const> blocks, std::size_t size) const {
  std::vector<unsigned char*> from, to;
  for (int i = 0; i < data_ + parity_; ++i) (i < data_ ? from : to).push_back(bytes_of(blocks, i));
  combine(tables_, from, to, size);
}

void ReedSolomon::restore(std::span<std::byte* const> blocks, std::span<const int> lost,
                          std::size_t size) const {
  assert(static_cast<int>(lost.size()) <= parity_);
  const auto middle = std::ranges::lower_bound(lost, data_);
  restore_data(blocks, {lost.begin(), middle}, lost, size);
  // All data is there again.
  std::vector<unsigned char*> from, to;
  std::vector<unsigned char> rows;
  for (int i = 0; i < data_; ++i) from.push_back(bytes_of(blocks, i));
  for (const int block : std::span(middle, lost.end())) {
    to.push_back(bytes_of(blocks, block));
    rows.insert(rows.end(), row(block), row(block) + data_);
  }
  if (!to.empty()) combine(tables_of(std::move(rows), data_), from, to, size);
}

void ReedSolomon::restore_data(std::span<std::byte* const> blocks, std::span<const int> lost,
                               std::span<const int> all_lost, std::size_t size) const {
  if (lost.empty()) return;
  // As many parity blocks as data blocks are lost. Their columns of lost blocks are a square, whose inverse
  // gives these from the rest: much smaller than the inverse of a matrix of all blocks.
  std::vector<int> used;
  for (int i = data_; used.size() < lost.size(); ++i)
    if (!std::ranges::binary_search(all_lost, i)) used.push_back(i);
  std::vector<unsigned char> square, inverse(lost.size() * lost.size());
  for (const int block : used)
    for (const int column : lost) square.push_back(row(block)[column]);
  if (gf_invert_matrix(square.data(), inverse.data(), static_cast<int>(lost.size())) != 0)
    throw std::logic_error("a part of the matrix of parity is singular");
  std::vector<unsigned char*> from, to;
  std::vector<int> there;
  for (int i = 0; i < data_; ++i)
    if (!std::ranges::binary_search(lost, i)) there.push_back(i);
  for (const int block : there) from.push_back(bytes_of(blocks, block));
  for (const int block : used) from.push_back(bytes_of(blocks, block));
  std::vector<unsigned char> rows;
  for (std::size_t i = 0; i < lost.size(); ++i) {
    to.push_back(bytes_of(blocks, lost[i]));
    const unsigned char* factors = inverse.data() + i * lost.size();
    for (const int column : there) {
      unsigned char sum = 0;
      for (std::size_t j = 0; j < used.size(); ++j) sum ^= gf_mul(factors[j], row(used[j])[column]);
      rows.push_back(sum);
    }
    rows.insert(rows.end(), factors, factors + used.size());
  }
  combine(tables_of(std::move(rows), data_), from, to, size);
}

StripeBand::StripeBand(const ParityLayout& layout, std::uint64_t memory) : layout_(layout) {
  const std::uint64_t stripe = static_cast<std::uint64_t>(rows()) * layout.block_size();
  most_ = std::clamp<std::uint64_t>(memory / stripe, 1, layout.stripes);
  buffer_.resize(memory_size(most_ * stripe));
  for (int row = 0; row < rows(); ++row) row_starts_.push_back(row_of(row));
}

bool StripeBand::next() {
  first_ += count_;
  count_ = std::min<std::uint64_t>(most_, layout_.stripes - first_);
  return count_ > 0;
}

std::optional<std::uint64_t> StripeBand::number(int row, std::uint64_t i) const {
  const std::uint64_t stripe = first_ + i, stripes = layout_.stripes;
  if (row < layout_.data()) {
    const std::uint64_t block = static_cast<std::uint64_t>(row) * stripes + stripe;
    return block < layout_.blocks() ? std::optional(block) : std::nullopt;
  }
  return layout_.blocks() + static_cast<std::uint64_t>(row - layout_.data()) * stripes + phase(stripe);
}

std::optional<BlockRun> StripeBand::run_at(int row, std::uint64_t i) {
  const auto from = number(row, i);
  if (!from) return std::nullopt;
  // A run ends with the band, with the file, and where a row of parity begins again.
  std::uint64_t end = i + 1;
  while (end < count_ && number(row, end) == *from + (end - i)) ++end;
  const bool parity = row >= layout_.data();
  return BlockRun{parity,
                  *from - (parity ? layout_.blocks() : 0),
                  {block(row, i).data(), (end - i) * layout_.block_size()}};
}

void StripeBand::fill_up() {
  const int last = layout_.data() - 1;
  for (std::uint64_t i = 0; i < count_; ++i)
    if (!number(last, i)) std::ranges::fill(block(last, i), std::byte{0});
}

}  // namespace tagrid
