#include "pipeline/decode/row_output.h"

namespace tagrid {

RowOutput::RowOutput(VolumeSink& sink, const std::string& spool_folder, const std::string& name)
    : sink_(sink) {
  if (!spool_folder.empty()) spool_.emplace(SpoolFile::in(spool_folder, name));
}

void RowOutput::write(const DecodedRows& rows) {
  if (spool_) return through_spool(rows, *spool_);
  rows.for_each_part(
      [&](std::int64_t first, std::span<const std::byte> samples) { sink_.write_samples(first, samples); });
}

void RowOutput::through_spool(const DecodedRows& rows, SpoolFile& spool) {
  const VolumeInfo& info = sink_.info();
  const Box volume = Box::of_size(info.dims);
  const std::size_t size = size_of(info.type);
  const std::int64_t layer_start = volume.offset({0, 0, rows.box().low.z});
  rows.for_each_part([&](std::int64_t first, std::span<const std::byte> samples) {
    spool.write_at(static_cast<std::uint64_t>(first - layer_start) * size, samples);
  });
  if (rows.box().high.y < volume.high.y) return;
  spool.read_back([&](std::span<std::byte> part) { sink_.write_slices(part); });
  spool.clear();
}

}  // namespace tagrid
