#include "pipeline/overview/means_source.h"

#include <cassert>
#include <span>

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
  CodingParameters whole;
  whole.dims = dims;
  whole.type = volume.info().type;
  SumsFile sums(layout_of_sums(dims, whole.type, block_edge), spool, output);
  StripSums strip(
      whole, BrickRows::all(whole.bricks()),
      [&](std::int64_t z, std::int64_t y, std::span<const std::byte> rows) { sums.write(z, y, rows); });
  std::vector<std::byte> slice(volume.slice_bytes());
  for (std::int64_t z = 0; z < dims.z; ++z) {
    volume.read_slices(slice.data(), 1);
    strip.add_slice({{0, 0, z}, {dims.x - 1, dims.y - 1, z}}, slice.data());
  }
  return sums;
}

}  // namespace tagrid
