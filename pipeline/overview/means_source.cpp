#include "pipeline/overview/means_source.h"

#include <algorithm>
#include <cassert>
#include <span>

#include "stages/overview/block_sums.h"

namespace tagrid {
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
