#include "pipeline/overview/sums.h"

#include <algorithm>

#include "pipeline/threads/node_times.h"
#include "pipeline/threads/threads.h"

namespace tagrid {
namespace {

SumsLayout first_layout(const CodingParameters& parameters) {
  return layout_of_sums(parameters.dims, parameters.type, block_edge);
}

// The samples of blocks, within the volume.
Box samples_of(const Box& blocks, const CodingParameters& parameters) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low[axis] = blocks.low[axis] * block_edge;
    box.high[axis] = (blocks.high[axis] + 1) * block_edge - 1;
  }
  return intersection(box, Box::of_size(parameters.dims));
}

}  // namespace

// Closed boxes begin at most one sample before a block, and end at most one after it: so the blocks between
// the low faces of two bricks lie in the closed box between them.
Box blocks_of_rows(const CodingParameters& parameters, const BrickRows& rows) {
  const BrickGrid bricks = parameters.bricks();
  const Box first = bricks.domain.samples_at(bricks.closed_box({0, rows.y_low, rows.z_low})),
            last = bricks.domain.samples_at(bricks.closed_box({0, rows.y_end - 1, rows.z_end - 1}));
  Box blocks = Box::of_size(first_layout(parameters).blocks);
  blocks.low.y = blocks_along(first.low.y);
  blocks.low.z = blocks_along(first.low.z);
  if (rows.y_end < bricks.bricks(1)) blocks.high.y = blocks_along(last.high.y) - 1;
  if (rows.z_end < bricks.bricks(2)) blocks.high.z = blocks_along(last.high.z) - 1;
  return blocks;
}

StripSums::StripSums(const CodingParameters& parameters, const BrickRows& rows, SumsSink& out)
    : parameters_(parameters),
      blocks_(blocks_of_rows(parameters, rows)),
      samples_(samples_of(blocks_, parameters)),
      sums_(first_layout(parameters), parameters.dims.x, samples_.size().y),
      out_(out) {}

void StripSums::add_slice(const Box& rows, const std::byte* samples) {
  const std::int64_t z = rows.low.z;
  if (z < samples_.low.z || z > samples_.high.z) return;
  const auto row = static_cast<std::size_t>(parameters_.dims.x) * size_of(parameters_.type);
  const std::byte* const first = samples + static_cast<std::size_t>(samples_.low.y - rows.low.y) * row;
  share_rows(samples_.size().y, row, block_edge, [&](std::int64_t y, std::int64_t count) {
    const TimeOfNode time(Node::sum_blocks);
    sums_.add_rows(first, y, y + count);
  });
  if (z % block_edge != block_edge - 1 && z != samples_.high.z) return;
  sums_.take(taken_);
  out_.write(z / block_edge, blocks_.low.y, taken_);
}

SumsFile::SumsFile(const SumsLayout& layout, const std::string& spool, const std::string& output)
    : layout_(layout), file_(SpoolFile::in(spool, output)) {}

std::uint64_t SumsFile::position(std::int64_t z, std::int64_t y) const {
  return static_cast<std::uint64_t>(z * layout_.blocks.y + y) * layout_.row_bytes();
}

void SumsFile::write(std::int64_t z, std::int64_t y, std::span<const std::byte> rows) {
  file_.write_at(position(z, y), rows);
}

void SumsFile::read(std::int64_t z, std::int64_t y, std::int64_t count, std::vector<std::byte>& rows) {
  rows.resize(static_cast<std::size_t>(count) * layout_.row_bytes());
  file_.read_at(position(z, y), rows);
}

SumsFile coarser(SumsFile& sums, const Index3& dims, const std::string& spool, const std::string& output) {
  const SumsLayout& fine = sums.layout();
  const SumsLayout layout = layout_of_sums(dims, fine.type, fine.factor * block_edge);
  SumsFile result(layout, spool, output);
  std::vector<std::byte> rows;
  // A row of blocks at a time, which takes four slices of four rows.
  for (std::int64_t z = 0; z < layout.blocks.z; ++z)
    for (std::int64_t y = 0; y < layout.blocks.y; ++y) {
      const std::int64_t first = y * block_edge, count = std::min(block_edge, fine.blocks.y - first);
      SlabSums slab(layout, fine.blocks.x, count);
      for (std::int64_t s = z * block_edge; s < std::min((z + 1) * block_edge, fine.blocks.z); ++s) {
        sums.read(s, first, count, rows);
        slab.add_slice(rows.data());
      }
      slab.take(rows);
      result.write(z, y, rows);
    }
  return result;
}

}  // namespace tagrid
