#include "io/volume/one_of_volumes.h"

#include <cassert>
#include <limits>
#include <utility>

#include "io/errors/errors.h"
#include "io/text/text.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {
namespace {

SourceFacts facts_of_one(const SourceFacts& several, std::int64_t number) {
  SourceFacts facts = several;
  facts.info = info_of_volume(several, number);
  facts.places.clear();
  facts.opened = nullptr;
  facts.plain_form = {};
  return facts;
}

class OneOfVolumes final : public VolumeSource {
 public:
  OneOfVolumes(std::shared_ptr<VolumeSource> several, std::int64_t number)
      : VolumeSource(facts_of_one(several->facts(), number)),
        several_(std::move(several)),
        first_slice_(number * info().dims.z) {}

  std::uint64_t bytes_read() const override { return several_->bytes_read(); }
  void stop_when(const std::atomic<bool>& stop) override { several_->stop_when(stop); }
  bool at_once() const override { return several_->at_once(); }
  void read_at(std::byte* out, std::int64_t first, std::int64_t count) const override {
    several_->read_at(out, first_slice_ * slice_samples() + first, count);
  }

 private:
  void read(std::byte* out, std::int64_t first, std::int64_t count) override {
    const std::int64_t position = first_slice_ * slice_samples() + first;
    if (!traits().any_rows && several_->next_sample() != position && first % slice_samples() == 0)
      several_->seek_slice(position / slice_samples());
    several_->read_from(out, position, count);
  }
  void seek(std::int64_t z) override { several_->seek_slice(first_slice_ + z); }
  void end() override {
    if (first_slice_ + info().dims.z == several_->info().dims.z) several_->finish();
  }

  std::shared_ptr<VolumeSource> several_;
  std::int64_t first_slice_;
};

bool are_all_wanted(const SourceDescription& source, const Index3& dims, std::int64_t volumes) {
  return source.all_volumes && !source.series && volumes > 1 && volumes <= most_volumes &&
         dims.z <= std::numeric_limits<std::int64_t>::max() / volumes &&
         is_volume_size({dims.x, dims.y, dims.z * volumes});
}

std::int64_t number_of_volume(const std::string& name, const std::optional<std::string>& series,
                              std::int64_t volumes, const std::string& each) {
  // A header that claims more has no choices, as they would take memory.
  constexpr std::int64_t most_choices = 65536;
  if (!series && volumes == 1) return 0;
  const Setting setting{"series", "the number of one"};
  if (!series) {
    std::vector<Choice> choices;
    for (std::int64_t i = 1; i <= volumes && volumes <= most_choices; ++i)
      choices.push_back({std::to_string(i), each});
    throw UsageError(Sentence("{}: holds {} volumes of {}; choose one with {}, by its number from 1 on", name,
                              volumes, each, setting),
                     {.subject = name, .option = "series", .choices = std::move(choices)});
  }
  const auto number = whole_number_of(*series);
  if (!number || *number < 1 || *number > volumes)
    throw UsageError("{}: holds {} volumes; {} must be a number from 1 to {}, not {}", name, volumes, setting,
                     volumes, *series);
  return *number - 1;
}

}  // namespace

std::optional<std::int64_t> wanted_volume(const SourceDescription& source, const std::string& name,
                                          const VolumeInfo& one, std::int64_t volumes) {
  if (are_all_wanted(source, one.dims, volumes)) return std::nullopt;
  return number_of_volume(name, source.series, volumes, described(one.dims, one.type));
}

void take_all_volumes(VolumeInfo& one, std::int64_t volumes) {
  one.dims.z *= volumes;
  one.volumes = volumes;
}

VolumeInfo info_of_volume(const SourceFacts& several, std::int64_t number) {
  VolumeInfo one = several.info;
  one.dims.z /= one.volumes;
  one.volumes = 1;
  const auto named = static_cast<std::size_t>(number);
  if (named < several.volume_names.size())
    one.metadata.add_written_pair(volume_name_key, several.volume_names[named]);
  return one;
}

std::unique_ptr<VolumeSource> one_of_volumes(std::shared_ptr<VolumeSource> several, std::int64_t number) {
  assert(number >= 0 && number < several->info().volumes);
  return std::make_unique<OneOfVolumes>(std::move(several), number);
}

std::unique_ptr<VolumeSource> one_of_volumes(VolumeSource& several, std::int64_t number) {
  return one_of_volumes(std::shared_ptr<VolumeSource>(std::shared_ptr<void>(), &several), number);
}

}  // namespace tagrid
