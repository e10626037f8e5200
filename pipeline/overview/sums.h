// Sums of blocks while a volume is encoded: from the slices that are read, to a temporary file, from which the
// overviews are encoded after the last brick.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "io/files/spool_file.h"
#include "stages/grid/brick_grid.h"
#include "stages/overview/block_sums.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// Numbers of blocks of 4 samples along each axis.
Box blocks_of_rows(const CodingParameters& parameters, const BrickRows& rows);

/// Takes sums of blocks.
class SumsSink {
 public:
  virtual ~SumsSink() = default;
  /// Takes rows of blocks of slice `z` of blocks, from row `y` on: complete along x, as stored.
  virtual void write(std::int64_t z, std::int64_t y, std::span<const std::byte> rows) = 0;
};

/// The sums of the blocks of 4 samples that belong to a stretch of rows of bricks. Every block belongs to one
/// stretch, however rows are cut: that one whose bricks' closed boxes hold all of its samples.
class StripSums {
 public:
  StripSums(const CodingParameters& parameters, const BrickRows& rows, SumsSink& out);

  /// Adds the rows of a slice. Slices come in the order of z, from the first one that a block of the stretch
  /// needs or before, to the last one or after. REQUIRES: `rows` hold the rows of the stretch's blocks.
  void add_slice(const Box& rows, const std::byte* samples);

 private:
  const CodingParameters& parameters_;
  Box blocks_;
  Box samples_;
  SlabSums sums_;
  std::vector<std::byte> taken_;
  SumsSink& out_;
};

/// The sums of all blocks of a level, in a temporary file.
class SumsFile : public SumsSink {
 public:
  /// In the directory `spool`; messages name `output`.
  SumsFile(const SumsLayout& layout, const std::string& spool, const std::string& output);

  const SumsLayout& layout() const { return layout_; }
  void write(std::int64_t z, std::int64_t y, std::span<const std::byte> rows) override;
  /// Reads `count` rows, from row y of slice z on.
  void read(std::int64_t z, std::int64_t y, std::int64_t count, std::vector<std::byte>& rows);

 private:
  std::uint64_t position(std::int64_t z, std::int64_t y) const;

  SumsLayout layout_;
  SpoolFile file_;
};

/// The sums of the next level: of blocks with 4 times the edge.
SumsFile coarser(SumsFile& sums, const Index3& dims, const std::string& spool, const std::string& output);

}  // namespace tagrid
