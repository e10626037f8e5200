#include "io/volume/rows_of_slices.h"

#include <algorithm>
#include <cassert>

namespace tagrid {
namespace {

class RowsOfSlices final : public VolumeSource {
 public:
  RowsOfSlices(SourceFacts facts, std::unique_ptr<VolumeSource> source)
      : VolumeSource(std::move(facts)), source_(std::move(source)), slice_(slice_bytes()) {}

  std::uint64_t bytes_read() const override { return source_->bytes_read(); }
  void stop_when(const std::atomic<bool>& stop) override { source_->stop_when(stop); }

 private:
  void read(std::byte* out, std::int64_t first, std::int64_t count) override {
    const std::size_t size = size_of(info().type);
    while (count > 0) {
      const std::int64_t z = first / slice_samples(), skipped = first % slice_samples();
      const std::int64_t part = std::min(count, slice_samples() - skipped);
      if (source_->next_sample() != z * slice_samples()) source_->seek_slice(z);
      if (part == slice_samples()) {
        source_->read_slices(out, 1);
      } else {
        source_->read_slices(slice_.data(), 1);
        std::copy_n(slice_.data() + static_cast<std::size_t>(skipped) * size,
                    static_cast<std::size_t>(part) * size, out);
      }
      out += static_cast<std::size_t>(part) * size;
      first += part;
      count -= part;
    }
  }
  void seek(std::int64_t z) override { source_->seek_slice(z); }
  void end() override { source_->finish(); }

  std::unique_ptr<VolumeSource> source_;
  std::vector<std::byte> slice_;
};

}  // namespace

std::unique_ptr<VolumeSource> rows_of_slices(std::unique_ptr<VolumeSource> source) {
  assert(source->traits().again);
  SourceFacts facts = source->facts();
  facts.traits = {.again = true,
                  .any_rows = true,
                  .whole_slices = false,
                  .memory = facts.traits.memory + source->slice_bytes()};
  return std::make_unique<RowsOfSlices>(std::move(facts), std::move(source));
}

}  // namespace tagrid
