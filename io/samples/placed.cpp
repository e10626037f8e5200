#include "io/samples/placed.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <optional>
#include <span>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/byte_source.h"
#include "io/samples/stored_bits.h"

namespace tagrid {
namespace {

class Placed final : public VolumeSource {
 public:
  explicit Placed(SourceFacts facts) : VolumeSource(with_traits(std::move(facts))) {
    std::int64_t slices = 0;
    for (const SliceRun& run : runs()) {
      assert(run.slices > 0 && run.file < files().size());
      ends_.push_back(slices += run.slices);
    }
    assert(slices == info().dims.z);
    check_files();
  }

  std::uint64_t bytes_read() const override { return bytes_read_; }

 private:
  const std::vector<SliceRun>& runs() const { return facts().places; }
  SliceRows rows() const {
    return {static_cast<std::uint64_t>(info().dims.x) * size_of(info().type), info().dims.y};
  }

  static SourceFacts with_traits(SourceFacts facts) {
    std::uint64_t names = 0;
    for (const std::string& file : facts.files) names += sizeof file + file.size();
    facts.traits = {.again = true,
                    .any_rows = true,
                    .whole_slices = false,
                    .memory = names + facts.places.size() * (sizeof(SliceRun) + sizeof(std::int64_t))};
    return facts;
  }

  /// What is wrong with one of the files is found before anything is written.
  void check_files() {
    for (const SliceRun& run : runs()) {
      const FileSource& source = file(run.file);
      const auto end = end_of_run(run, rows());
      if (!end || *end > source.size())
        throw BrokenInput(fmt::format("{}: has {} bytes, but its slices should end at byte {} ({})",
                                      source.name(), source.size(), end ? std::to_string(*end) : "2^64",
                                      described(info().dims, info().type)));
    }
  }

  const FileSource& file(std::size_t number) {
    if (file_ && number_ == number) return *file_;
    file_.reset();  // one open file at a time
    file_.emplace(files()[number]);
    number_ = number;
    return *file_;
  }

  void read(std::byte* out, std::int64_t first, std::int64_t count) override {
    const std::size_t sample = size_of(info().type);
    while (count > 0) {
      const std::int64_t z = first / slice_samples(), in_slice = first % slice_samples();
      const auto at = static_cast<std::size_t>(std::ranges::upper_bound(ends_, z) - ends_.begin());
      const SliceRun& run = runs()[at];
      const bool has_rows = run.row_step != 0, is_gapless = !has_rows && run.step == slice_bytes();
      const std::int64_t y = in_slice / info().dims.x, x = in_slice % info().dims.x;
      const std::int64_t left =
          has_rows ? info().dims.x - x : (is_gapless ? ends_[at] - z : 1) * slice_samples() - in_slice;
      const std::int64_t n = std::min(count, left);
      const std::span<std::byte> bytes(out, static_cast<std::size_t>(n) * sample);
      const auto in_run = static_cast<std::uint64_t>(z - (ends_[at] - run.slices));
      const std::uint64_t place = place_of_row(run, rows(), y) + static_cast<std::uint64_t>(x) * sample;
      file(run.file).read_at(run.offset + in_run * run.step + place, bytes);
      bytes_read_ += bytes.size();
      swap_if_not_native(out, static_cast<std::size_t>(n), sample, run.big_endian);
      apply(run.stored, info().type, out, static_cast<std::size_t>(n));
      out += bytes.size();
      first += n;
      count -= n;
    }
  }
  void seek(std::int64_t z) override {
    if (z == 0) bytes_read_ = 0;
  }
  void end() override {}  // other bytes may follow

  std::vector<std::int64_t> ends_;  // the slice after each run
  std::uint64_t bytes_read_ = 0;
  std::optional<FileSource> file_;
  std::size_t number_ = 0;  // of file_
};

}  // namespace

std::unique_ptr<VolumeSource> placed_samples(SourceFacts facts, std::vector<SliceRun> runs) {
  facts.places = std::move(runs);
  return std::make_unique<Placed>(std::move(facts));
}

}  // namespace tagrid
