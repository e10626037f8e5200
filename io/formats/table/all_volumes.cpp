// All volumes of a file whose reader gives them one by one.
#include "io/formats/table/all_volumes.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "io/errors/errors.h"
#include "io/formats/nrrd/geometry.h"
#include "io/volume/one_of_volumes.h"

namespace tagrid {
namespace {

/// Opens one volume after the other.
class OneByOne final : public VolumeSource {
 public:
  OneByOne(SourceFacts facts, std::int64_t slices, OpenByName open, std::vector<std::string> names)
      : VolumeSource(std::move(facts)), slices_(slices), open_(std::move(open)), names_(std::move(names)) {}

  std::uint64_t bytes_read() const override { return current_ ? current_->bytes_read() : 0; }
  void stop_when(const std::atomic<bool>& stop) override {
    stop_ = &stop;
    if (current_) current_->stop_when(stop);
  }

 private:
  void read(std::byte* out, std::int64_t first, std::int64_t count) override {
    const std::int64_t each = slices_ * slice_samples();
    while (count > 0) {
      const std::int64_t at = first % each, part = std::min(count, each - at);
      VolumeSource& volume = open(static_cast<std::size_t>(first / each));
      if (!traits().any_rows && volume.next_sample() != at) volume.seek_slice(at / slice_samples());
      volume.read_from(out, at, part);
      if (at + part == each) volume.finish();
      out += static_cast<std::size_t>(part) * size_of(info().type);
      first += part;
      count -= part;
    }
  }
  void seek(std::int64_t) override {}
  void end() override {}

  VolumeSource& open(std::size_t number) {
    if (!current_ || number != number_) {
      current_.reset();  // one program at a time
      current_ = open_(names_[number]);
      number_ = number;
      if (stop_ != nullptr) current_->stop_when(*stop_);
    }
    return *current_;
  }

  std::int64_t slices_;
  OpenByName open_;
  std::vector<std::string> names_;
  std::unique_ptr<VolumeSource> current_;
  std::size_t number_ = 0;
  const std::atomic<bool>* stop_ = nullptr;
};

/// What makes two volumes unlike, so that one file cannot have both; "" if nothing does.
std::string difference(const SourceFacts& a, const SourceFacts& b) {
  if (a.info.dims != b.info.dims || a.info.type != b.info.type)
    return fmt::format("{} and {}", described(a.info.dims, a.info.type), described(b.info.dims, b.info.type));
  if (a.rescale != b.rescale) return "other slopes and intercepts";
  return "";
}

/// The places of a volume in the files of all.
void add_places(const SourceFacts& volume, SourceFacts& all) {
  std::vector<std::size_t> numbers;
  for (const std::string& file : volume.files) {
    const auto known = std::ranges::find(all.files, file);
    numbers.push_back(static_cast<std::size_t>(known - all.files.begin()));
    if (known == all.files.end()) all.files.push_back(file);
  }
  for (SliceRun run : volume.places) {
    run.file = numbers[run.file];
    all.places.push_back(run);
  }
}

}  // namespace

std::unique_ptr<VolumeSource> all_volumes(const std::string& path, const std::vector<std::string>& names,
                                          const OpenByName& open) {
  SourceFacts all;
  bool is_placed = true;
  for (const std::string& name : names) {
    const SourceFacts facts = open(name)->facts();
    if (all.info.volumes == 1 && all.volume_names.empty()) {
      all = facts;
      all.files.clear();
      all.places.clear();
      all.plain_form = {};
    } else if (const std::string why = difference(all, facts); !why.empty()) {
      throw UsageError(
          Sentence{"{}: its volumes are unlike ({}), and cannot be in one file; choose one with {}",
                   {path, why, Setting{"series", "its name"}}});
    }
    is_placed = is_placed && !facts.places.empty();
    add_places(facts, all);
    all.volume_names.push_back(name);
  }
  if (!is_placed) all.places.clear();
  const std::int64_t slices = all.info.dims.z;
  take_all_volumes(all.info, static_cast<std::int64_t>(names.size()));
  return std::make_unique<OneByOne>(std::move(all), slices, open, names);
}

}  // namespace tagrid
