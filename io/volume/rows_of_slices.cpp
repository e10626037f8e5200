#include <algorithm>
#include <cassert>
#include <map>
#include <utility>
#include <vector>

#include "io/volume/volume_source.h"

namespace tagrid {
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
