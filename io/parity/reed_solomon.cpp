#include "io/parity/reed_solomon.h"

#include <isa-l/erasure_code.h>

#include <algorithm>
#include <cassert>
#include <stdexcept>

namespace tagrid {
namespace {

constexpr std::size_t bytes_of_table = 32;  // of one coefficient, in ISA-L

std::size_t in_size(int n) { return static_cast<std::size_t>(n); }

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
  for (int i = 0; i < data_ + parity_; ++i)
    (i < data_ ? from : to).push_back(reinterpret_cast<unsigned char*>(blocks[in_size(i)]));
  combine(tables_, from, to, size);
}

void ReedSolomon::restore(std::span<std::byte* const> blocks, std::span<const int> lost,
                          std::size_t size) const {
  assert(static_cast<int>(lost.size()) <= parity_);
  if (lost.empty()) return;
  // `data_` blocks that are there, and the rows of the matrix that made them.
  std::vector<unsigned char*> from, to;
  std::vector<unsigned char> rows;
  for (int i = 0; static_cast<int>(from.size()) < data_; ++i) {
    if (std::ranges::binary_search(lost, i)) continue;
    from.push_back(reinterpret_cast<unsigned char*>(blocks[in_size(i)]));
    rows.insert(rows.end(), matrix_.begin() + i * data_, matrix_.begin() + (i + 1) * data_);
  }
  std::vector<unsigned char> inverse(rows.size());
  if (gf_invert_matrix(rows.data(), inverse.data(), data_) != 0)
    throw std::logic_error("a part of the matrix of parity is singular");
  // The row of a lost block, times the inverse, gives it from the blocks that are there.
  std::vector<unsigned char> combined;
  for (const int block : lost) {
    to.push_back(reinterpret_cast<unsigned char*>(blocks[in_size(block)]));
    const unsigned char* row = matrix_.data() + block * data_;
    if (block < data_) {
      combined.insert(combined.end(), inverse.begin() + block * data_, inverse.begin() + (block + 1) * data_);
      continue;
    }
    for (int column = 0; column < data_; ++column) {
      unsigned char sum = 0;
      for (int i = 0; i < data_; ++i) sum ^= gf_mul(row[i], inverse[in_size(i * data_ + column)]);
      combined.push_back(sum);
    }
  }
  combine(tables_of(std::move(combined), data_), from, to, size);
}

}  // namespace tagrid
