#include "pipeline/overview/block_means.h"

#include <algorithm>
#include <cassert>
#include <span>
#include <vector>

#include "io/metadata/region.h"
#include "stages/overview/block_sums.h"

namespace tagrid {
namespace {

SourceFacts facts_of(const VolumeInfo& volume) {
  SourceFacts facts;
  facts.info.dims = layout_of_sums(volume.dims, volume.type, block_edge).blocks;
  facts.info.type = volume.type;
  facts.info.metadata = metadata_of_overview(volume.metadata, block_edge, volume.dims.z);
  facts.traits.again = facts.traits.any_rows = true;
  facts.name = "the means of the volume";
  return facts;
}

}  // namespace

BlockMeans::BlockMeans(VolumeSource& volume)
    : VolumeSource(facts_of(volume.info())),
      volume_(volume),
      layout_(layout_of_sums(volume.info().dims, volume.info().type, block_edge)) {}

void BlockMeans::read(std::byte* out, std::int64_t first, std::int64_t count) {
  const Index3 dims = volume_.info().dims, blocks = layout_.blocks;
  assert(first % blocks.x == 0 && count % blocks.x == 0);
  std::vector<std::byte> samples, sums;
  std::int64_t row = first / blocks.x;
  const std::int64_t end = row + count / blocks.x;
  while (row < end) {
    // All rows of a slice of blocks at once, as a source may have to decode all of a slice for each read.
    const std::int64_t z = row / blocks.y, y = row % blocks.y, rows = std::min(end - row, blocks.y - y);
    Box read = {{0, y * block_edge, 0}, {dims.x - 1, std::min((y + rows) * block_edge, dims.y) - 1, 0}};
    SlabSums slab(layout_, dims.x, read.size().y);
    samples.resize(static_cast<std::size_t>(read.count()) * size_of(layout_.type));
    for (std::int64_t s = z * block_edge; s < std::min((z + 1) * block_edge, dims.z); ++s) {
      read.low.z = read.high.z = s;
      volume_.read_rows(samples.data(), read);
      slab.add_slice(samples.data());
    }
    slab.take(sums);
    for (std::int64_t i = 0; i < rows; ++i) {
      const std::size_t size = layout_.row_bytes();
      means_of_row(layout_, dims, y + i, z, std::span(sums).subspan(static_cast<std::size_t>(i) * size, size),
                   out);
      out += static_cast<std::size_t>(blocks.x) * size_of(layout_.type);
    }
    row += rows;
  }
}

double share_of_level(int factor) {
  double share = 1;
  for (std::int64_t f = block_edge; f < factor; f *= block_edge) share /= 32;
  return share;
}

namespace {

SourceFacts facts_of(const SumsLayout& layout) {
  SourceFacts facts;
  facts.info.dims = layout.blocks;
  facts.info.type = layout.type;
  facts.traits.again = facts.traits.any_rows = true;
  facts.name = "the means of the original";
  return facts;
}

}  // namespace

MeansSource::MeansSource(SumsFile& sums, const Index3& dims)
    : VolumeSource(facts_of(sums.layout())), sums_(sums), dims_(dims) {}

void MeansSource::read(std::byte* out, std::int64_t first, std::int64_t count) {
  const SumsLayout& layout = sums_.layout();
  const std::int64_t width = layout.blocks.x;
  assert(first % width == 0 && count % width == 0);
  for (std::int64_t row = first / width; row < (first + count) / width; ++row) {
    const std::int64_t z = row / layout.blocks.y, y = row % layout.blocks.y;
    sums_.read(z, y, 1, stored_);
    means_of_row(layout, dims_, y, z, stored_, out);
    out += static_cast<std::size_t>(width) * size_of(layout.type);
  }
}

SumsFile sums_of(VolumeSource& volume, const std::string& spool, const std::string& output) {
  const Index3& dims = volume.info().dims;
  const SumsLayout layout = layout_of_sums(dims, volume.info().type, block_edge);
  SumsFile sums(layout, spool, output);
  // Wide slices need not be in memory as a whole, unless they can only be read one after the other.
  constexpr std::uint64_t usual_bytes = std::uint64_t{4} << 20;
  const auto block_rows = static_cast<std::int64_t>(
      usual_bytes / (volume.slice_bytes() / static_cast<std::uint64_t>(dims.y) * block_edge));
  const std::int64_t at_once =
      volume.traits().any_rows ? std::max<std::int64_t>(block_rows, 1) * block_edge : dims.y;
  std::vector<std::byte> samples, stored;
  for (std::int64_t z = 0; z < layout.blocks.z; ++z)
    for (std::int64_t y = 0; y < dims.y; y += at_once) {
      const std::int64_t end = std::min(y + at_once, dims.y);
      SlabSums slab(layout, dims.x, end - y);
      for (std::int64_t slice = z * block_edge; slice < std::min((z + 1) * block_edge, dims.z); ++slice) {
        const Box rows{{0, y, slice}, {dims.x - 1, end - 1, slice}};
        samples.resize(static_cast<std::size_t>(rows.count()) * size_of(layout.type));
        volume.read_rows(samples.data(), rows);
        slab.add_slice(samples.data());
      }
      slab.take(stored);
      sums.write(z, y / block_edge, stored);
    }
  return sums;
}

}  // namespace tagrid
