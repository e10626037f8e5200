#include "io/volume/volume_source.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>

#include "io/bytes/checksum.h"

namespace tagrid {

std::vector<std::string> all_warnings(const SourceFacts& facts) {
  std::vector<std::string> all = facts.warnings;
  all.insert(all.end(), facts.not_understood.begin(), facts.not_understood.end());
  if (!facts.scale_doubt.empty()) all.push_back(facts.scale_doubt);
  return all;
}

std::string why_not_understood(const SourceFacts& facts) {
  return facts.not_understood.empty() ? facts.scale_doubt : facts.not_understood.front();
}

void VolumeSource::read_samples(std::byte* out, std::int64_t count) {
  assert(count >= 0 && next_sample_ + count <= Box::of_size(info().dims).count());
  // More would be written than there is room for.
  if (traits().whole_slices && (next_sample_ % slice_samples() != 0 || count % slice_samples() != 0))
    throw std::logic_error("rows of a slice are requested, but the volume is read in whole slices");
  read(out, next_sample_, count);
  next_sample_ += count;
}

void VolumeSource::read_rows(std::byte* out, const Box& rows) {
  const Box volume = Box::of_size(info().dims);
  assert(volume.contains(rows) && rows.size().x == info().dims.x && rows.size().z == 1);
  assert(traits().any_rows || volume.offset(rows.low) == next_sample_);
  if (traits().any_rows) next_sample_ = volume.offset(rows.low);
  read_samples(out, rows.count());
}

void VolumeSource::read_from(std::byte* out, std::int64_t first, std::int64_t count) {
  assert(traits().any_rows || first == next_sample_);
  if (traits().any_rows) next_sample_ = first;
  read_samples(out, count);
}

void VolumeSource::seek_slice(std::int64_t z) {
  assert(traits().again && z >= 0 && z <= info().dims.z);
  seek(z);
  next_sample_ = z * slice_samples();
}

void VolumeSource::finish() {
  assert(next_sample_ == Box::of_size(info().dims).count());
  end();
}

void read_to_end(VolumeSource& source, const std::function<void(std::span<std::byte> samples)>& use) {
  constexpr std::size_t at_once = std::size_t{1} << 20;
  const std::size_t size = size_of(source.info().type);
  std::int64_t left = Box::of_size(source.info().dims).count() - source.next_sample();
  const std::int64_t most =
      source.traits().whole_slices ? source.slice_samples() : static_cast<std::int64_t>(at_once / size);
  std::vector<std::byte> samples(static_cast<std::size_t>(std::min(most, left)) * size);
  for (; left > 0; left -= std::min(most, left)) {
    const std::int64_t count = std::min(most, left);
    source.read_samples(samples.data(), count);
    use(std::span(samples).first(static_cast<std::size_t>(count) * size));
  }
  source.finish();
}

std::uint64_t checksum_of_samples(VolumeSource& source) {
  RunningChecksum checksum;
  read_to_end(source, [&](std::span<const std::byte> samples) { checksum.add(samples); });
  return checksum.value();
}

}  // namespace tagrid
