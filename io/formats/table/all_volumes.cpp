// All volumes of a file whose reader gives them one by one.
#include "io/formats/table/all_volumes.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/volume/one_of_volumes.h"

namespace tagrid {
namespace {

/// Opens one volume after the other.
class OneByOne final : public VolumeSource {
 public:
  OneByOne(SourceFacts facts, std::int64_t slices, OpenByName open, std::vector<std::string> names)
      : VolumeSource(std::move(facts)), slices_(slices), open_(std::move(open)), names_(std::move(names)) {}

  // A file of several volumes may be read once for each of them, and counts once.
  std::uint64_t bytes_read() const override { return size_of_files(files()); }
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

/// Slices of several volumes may alternate in a file, as channels do. Runs follow each other, so each slice of
/// such a file becomes a run of its own. `rows` are those of a slice.
std::vector<SliceRun> runs_apart(const std::vector<SliceRun>& places, const SliceRows& rows) {
  std::vector<const SliceRun*> in_order;
  for (const SliceRun& run : places) in_order.push_back(&run);
  std::ranges::sort(in_order, {}, [](const SliceRun* run) { return std::pair(run->file, run->offset); });
  std::set<std::size_t> mixed;
  for (std::size_t i = 1; i < in_order.size(); ++i) {
    const SliceRun &before = *in_order[i - 1], &run = *in_order[i];
    if (before.file == run.file && end_of_run(before, rows).value_or(0) > run.offset) mixed.insert(run.file);
  }
  std::vector<SliceRun> apart;
  for (SliceRun run : places) {
    const std::int64_t slices = std::exchange(run.slices, 1);
    if (!mixed.contains(run.file)) {
      run.slices = slices;
      apart.push_back(run);
      continue;
    }
    for (std::int64_t i = 0; i < slices; ++i, run.offset += run.step) apart.push_back(run);
  }
  return apart;
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
      all.opened = nullptr;
      all.plain_form = {};
    } else if (const std::string why = difference(all, facts); !why.empty()) {
      throw UsageError("{}: its volumes are unlike ({}), and cannot be in one file; choose one with {}", path,
                       why, Setting{"series", "its name"});
    }
    is_placed = is_placed && !facts.places.empty();
    add_places(facts, all);
    all.volume_names.push_back(name);
  }
  const SliceRows rows = {static_cast<std::uint64_t>(all.info.dims.x) * size_of(all.info.type),
                          all.info.dims.y};
  all.places = is_placed ? runs_apart(all.places, rows) : std::vector<SliceRun>();
  const std::int64_t slices = all.info.dims.z;
  take_all_volumes(all.info, static_cast<std::int64_t>(names.size()));
  return std::make_unique<OneByOne>(std::move(all), slices, open, names);
}

}  // namespace tagrid
