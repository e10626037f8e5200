#include "io/samples/slices_in_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "io/bytes/little_endian.h"
#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/samples/stored_bits.h"

namespace tagrid {
namespace {

class Placed final : public VolumeSource {
 public:
  explicit Placed(SourceFacts facts) : VolumeSource(std::move(facts)) {
    std::int64_t slices = 0;
    for (const SliceRun& run : runs()) {
      assert(run.slices > 0 && run.file < files().size());
      ends_.push_back(slices += run.slices);
    }
    assert(slices == info().dims.z);
  }

  /// What is wrong with one of the files is found before anything is written.
  void check_files() const {
    for (const SliceRun& run : runs()) {
      const auto source = facts().opened->file(run.file);
      const auto end = end_of_run(run, rows());
      if (!end || *end > source->size())
        throw BrokenInput("{}: has {} bytes, but its slices should end at byte {} ({})", source->name(),
                          source->size(), end ? std::to_string(*end) : "2^64",
                          described(info().dims, info().type));
    }
  }

  std::uint64_t bytes_read() const override { return bytes_read_; }

 private:
  const std::vector<SliceRun>& runs() const { return facts().places; }
  SliceRows rows() const {
    return {static_cast<std::uint64_t>(info().dims.x) * size_of(info().type), info().dims.y};
  }

  const FileSource& file(std::size_t number) {
    if (file_ && number_ == number) return *file_;
    file_.reset();  // of thousands, one is open at a time
    file_ = facts().opened->file(number);
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
  std::shared_ptr<const FileSource> file_;
  std::size_t number_ = 0;  // of file_
};

std::map<std::string, std::size_t> numbers_of(const std::vector<std::string>& files) {
  std::map<std::string, std::size_t> numbers;
  for (const std::string& file : files) numbers.emplace(file, numbers.size());
  return numbers;
}

/// Adds the files of all parts to `form`.
PlainForm joined_plain_form(PlainForm form, const std::vector<std::string>& files, std::int64_t parts,
                            const OpenPart& open) {
  const auto numbers = numbers_of(files);
  for (std::int64_t i = 0; i < parts; ++i) {
    const SourceFacts facts = open(i)->facts();
    if (!facts.plain_form) return {"", {}, {}, "some of its files are stored in another way than others"};
    PlainForm part = facts.plain_form();
    form.warnings.insert(form.warnings.end(), part.warnings.begin(), part.warnings.end());
    for (SliceRun run : part.places) {
      run.file += form.files.size();
      form.places.push_back(run);
    }
    for (PlainFile& file : part.files) {
      for (PlainPiece& piece : file.pieces) piece.file = numbers.at(facts.files[piece.file]);
      form.files.push_back(std::move(file));
    }
  }
  return form;
}

class Joined final : public VolumeSource {
 public:
  Joined(SourceFacts facts, std::int64_t parts, OpenPart open)
      : VolumeSource(with_traits(std::move(facts), parts, open)),
        open_(std::move(open)),
        slices_(info().dims.z / parts),
        bytes_read_(static_cast<std::size_t>(parts)) {}

  std::uint64_t bytes_read() const override {
    const std::uint64_t before = std::accumulate(bytes_read_.begin(), bytes_read_.end(), std::uint64_t{0});
    return part_ ? before - bytes_read_[static_cast<std::size_t>(number_)] + part_->bytes_read() : before;
  }
  void stop_when(const std::atomic<bool>& stop) override {
    stop_ = &stop;
    if (part_) part_->stop_when(stop);
  }

 private:
  static SourceFacts with_traits(SourceFacts facts, std::int64_t parts, const OpenPart& open) {
    assert(parts > 0 && facts.info.dims.z % parts == 0);
    const std::uint64_t own = facts.traits.memory;
    facts.traits = {.again = true, .any_rows = true, .whole_slices = false, .memory = own};
    bool are_plain = true;
    std::int64_t unusual = 0;
    const auto numbers = numbers_of(facts.files);
    for (std::int64_t i = 0; i < parts; ++i) {
      const SourceFacts part = open(i)->facts();
      assert(part.traits.again && !part.traits.whole_slices);
      facts.traits.any_rows = facts.traits.any_rows && part.traits.any_rows;
      facts.traits.memory = std::max(facts.traits.memory, own + part.traits.memory);
      are_plain = are_plain && !part.places.empty();
      facts.holds_other_bytes = facts.holds_other_bytes || part.holds_other_bytes;
      // Thousands of files may have the same warnings.
      const bool is_unusual = !part.warnings.empty() || !part.not_understood.empty();
      if (is_unusual && unusual++ == 0) {
        facts.warnings.insert(facts.warnings.end(), part.warnings.begin(), part.warnings.end());
        facts.not_understood.insert(facts.not_understood.end(), part.not_understood.begin(),
                                    part.not_understood.end());
      }
      for (SliceRun run : part.places) {
        run.file = numbers.at(part.files[run.file]);
        facts.places.push_back(run);
      }
    }
    if (unusual > 1) facts.warnings.push_back(fmt::format("it is so in {} of the {} files", unusual, parts));
    if (!are_plain) facts.places.clear();
    if (are_plain || !facts.plain_form) {
      facts.plain_form = {};
    } else {
      facts.plain_form = [before = facts.plain_form, files = facts.files, parts, open] {
        return joined_plain_form(before(), files, parts, open);
      };
    }
    facts.traits.memory += facts.places.size() * sizeof(SliceRun);
    return facts;
  }

  VolumeSource& part(std::int64_t number) {
    if (part_ && number_ == number) return *part_;
    if (part_) bytes_read_[static_cast<std::size_t>(number_)] = part_->bytes_read();
    part_.reset();  // one open file at a time
    part_ = open_(number);
    number_ = number;
    if (stop_ != nullptr) part_->stop_when(*stop_);
    return *part_;
  }

  void read(std::byte* out, std::int64_t first, std::int64_t count) override {
    const std::int64_t in_part = slices_ * slice_samples();
    while (count > 0) {
      const std::int64_t from = first % in_part, n = std::min(count, in_part - from);
      VolumeSource& source = part(first / in_part);
      source.read_from(out, from, n);
      if (source.next_sample() == in_part) source.finish();
      out += static_cast<std::size_t>(n) * size_of(info().type);
      first += n;
      count -= n;
    }
  }
  void seek(std::int64_t z) override {
    if (z == 0) {
      part_.reset();
      std::ranges::fill(bytes_read_, 0);
    }
    if (z < info().dims.z) part(z / slices_).seek_slice(z % slices_);
  }
  void end() override {}  // parts are finished as they are read

  OpenPart open_;
  std::int64_t slices_;                    // of a part
  std::vector<std::uint64_t> bytes_read_;  // of the parts that were read
  std::unique_ptr<VolumeSource> part_;
  std::int64_t number_ = 0;  // of part_
  const std::atomic<bool>* stop_ = nullptr;
};

}  // namespace

std::unique_ptr<VolumeSource> placed_samples(SourceFacts facts, std::vector<SliceRun> runs) {
  facts.places = std::move(runs);
  facts.opened = std::make_shared<OpenFiles>(facts.files);
  facts.traits = {.again = true,
                  .any_rows = true,
                  .whole_slices = false,
                  .memory = OpenFiles::memory(facts.files) +
                            facts.places.size() * (sizeof(SliceRun) + sizeof(std::int64_t))};
  auto volume = std::make_unique<Placed>(std::move(facts));
  volume->check_files();
  return volume;
}

std::unique_ptr<VolumeSource> placed_samples_again(const SourceFacts& facts) {
  return std::make_unique<Placed>(facts);
}

std::unique_ptr<VolumeSource> joined(SourceFacts facts, std::int64_t parts, OpenPart open) {
  return std::make_unique<Joined>(std::move(facts), parts, std::move(open));
}

}  // namespace tagrid
