// A source of the samples 0, 1, 2 ... that obeys its traits and records what is read.
#pragma once

#include <cstring>
#include <utility>
#include <vector>

#include "io/errors/errors.h"
#include "io/metadata/text.h"
#include "io/volume/volume_source.h"

namespace tagrid {

class VolumeInMemory : public VolumeSource {
 public:
  VolumeInMemory(const Index3& dims, const SourceTraits& traits)
      : VolumeSource({.info = {dims, SampleType::int16, parse_metadata("content: numbers\n")},
                      .files = {"header", "numbers"},
                      .traits = traits,
                      .holds_other_bytes = true,
                      .headerless = true}) {}

  std::uint64_t bytes_read() const override { return 77; }
  /// The slices that were sought, and the first sample and the number of samples of each read.
  const std::vector<std::int64_t>& seeks() const { return seeks_; }
  const std::vector<std::pair<std::int64_t, std::int64_t>>& reads() const { return reads_; }
  bool finished() const { return finished_; }
  bool goes_on = false;  ///< Something follows the last sample.

 private:
  void read(std::byte* out, std::int64_t first, std::int64_t count) override {
    reads_.emplace_back(first, count);
    for (std::int64_t i = 0; i < count; ++i) {
      const auto sample = static_cast<std::int16_t>(first + i);
      std::memcpy(out + 2 * i, &sample, 2);
    }
  }
  void seek(std::int64_t z) override { seeks_.push_back(z); }
  void end() override {
    if (goes_on) throw BrokenInput("more are present");
    finished_ = true;
  }

  std::vector<std::int64_t> seeks_;
  std::vector<std::pair<std::int64_t, std::int64_t>> reads_;
  bool finished_ = false;
};

/// The samples 0, 1, 2 ... as read from the rows of `source`.
inline std::vector<std::int16_t> rows_of(VolumeSource& source, const Box& rows) {
  std::vector<std::int16_t> samples(static_cast<std::size_t>(rows.count()));
  source.read_rows(reinterpret_cast<std::byte*>(samples.data()), rows);
  return samples;
}
inline std::vector<std::int16_t> numbers_in(const Index3& dims, const Box& rows) {
  std::vector<std::int16_t> samples;
  for (std::int64_t i = 0; i < rows.count(); ++i)
    samples.push_back(static_cast<std::int16_t>(Box::of_size(dims).offset(rows.low) + i));
  return samples;
}

}  // namespace tagrid
