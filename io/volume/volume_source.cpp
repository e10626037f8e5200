#include "io/volume/volume_source.h"

#include <algorithm>
#include <cassert>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

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

std::uint64_t checksum_of_samples(VolumeSource& source) {
  RunningChecksum checksum;
  read_to_end(source, [&](std::span<const std::byte> samples) { checksum.add(samples); });
  return checksum.value();
}

namespace {

class RowsOfSlices final : public VolumeSource {
 public:
  RowsOfSlices(SourceFacts facts, std::shared_ptr<VolumeSource> source, std::int64_t kept)
      : VolumeSource(std::move(facts)), source_(std::move(source)), kept_(kept), slice_(slice_bytes()) {}

  std::uint64_t bytes_read() const override { return source_->bytes_read(); }
  void stop_when(const std::atomic<bool>& stop) override { source_->stop_when(stop); }

 private:
  using Slice = std::vector<std::byte>;

  void read(std::byte* out, std::int64_t first, std::int64_t count) override {
    const std::size_t size = size_of(info().type);
    while (count > 0) {
      const std::int64_t z = first / slice_samples(), skipped = first % slice_samples();
      const std::int64_t part = std::min(count, slice_samples() - skipped);
      if (part == slice_samples() && kept_ == 0)
        read_slice(z, out);
      else
        std::copy_n(slice_at(z).data() + static_cast<std::size_t>(skipped) * size,
                    static_cast<std::size_t>(part) * size, out);
      out += static_cast<std::size_t>(part) * size;
      first += part;
      count -= part;
    }
  }

  const Slice& slice_at(std::int64_t z) {
    if (z < last_ || z > last_ + 1) stretch_ = z;
    last_ = z;
    if (const auto found = slices_.find(z); found != slices_.end()) return found->second;
    if (std::ssize(slices_) == kept_ && !slices_.empty() && slices_.begin()->first < stretch_) {
      // Its memory is used again.
      auto earliest = slices_.extract(slices_.begin());
      earliest.key() = z;
      read_slice(z, earliest.mapped().data());
      return slices_.insert(std::move(earliest)).position->second;
    }
    if (std::ssize(slices_) < kept_) {
      Slice slice(slice_bytes());
      read_slice(z, slice.data());
      return slices_.emplace(z, std::move(slice)).first->second;
    }
    read_slice(z, slice_.data());
    return slice_;
  }

  void read_slice(std::int64_t z, std::byte* out) {
    if (source_->next_sample() != z * slice_samples()) source_->seek_slice(z);
    source_->read_slices(out, 1);
  }
  void seek(std::int64_t z) override { source_->seek_slice(z); }
  void end() override {
    // The last slice may have been kept.
    if (source_->next_sample() != Box::of_size(info().dims).count()) source_->seek_slice(info().dims.z);
    source_->finish();
  }

  std::shared_ptr<VolumeSource> source_;
  std::int64_t kept_, stretch_ = 0, last_ = 0;
  Slice slice_;
  std::map<std::int64_t, Slice> slices_;  ///< that are kept
};

}  // namespace

std::unique_ptr<VolumeSource> rows_of_slices(std::shared_ptr<VolumeSource> source, std::int64_t kept) {
  assert(source->traits().again);
  SourceFacts facts = source->facts();
  facts.traits = {
      .again = true,
      .any_rows = true,
      .whole_slices = false,
      .memory = facts.traits.memory + (static_cast<std::uint64_t>(kept) + 1) * source->slice_bytes()};
  return std::make_unique<RowsOfSlices>(std::move(facts), std::move(source), kept);
}

}  // namespace tagrid
