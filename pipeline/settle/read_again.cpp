#include "pipeline/job/read_again.h"

#include <fmt/format.h>

#include <utility>

#include "io/errors/errors.h"
#include "io/files/spool_file.h"
#include "io/samples/file_samples.h"

namespace tagrid {
namespace {

double gigabytes(std::uint64_t bytes) { return static_cast<double>(bytes) / 1e9; }

}  // namespace

bool needs_copy(const SourceTraits& traits, Look look, const Resources& resources) {
  switch (look) {
    case Look::once:
      return false;
    case Look::again:
      return !traits.again;
    case Look::a_few_rows:
      return !traits.any_rows && !traits.whole_slices;
    case Look::all_rows_often:
      return !traits.any_rows && (!traits.whole_slices || !resources.spool.empty());
  }
  return false;
}

std::unique_ptr<VolumeSource> copied(std::unique_ptr<VolumeSource> source, const std::string& folder,
                                     const Resources& resources, std::uint64_t besides,
                                     const TellOfCopy& tell) {
  const SampleCopy copy{source->name(), folder, *sample_bytes(source->info().dims, source->info().type)};
  const RoomForFiles room = room_in(copy.folder);
  const Setting spool{"spool", "another directory"};
  if (room.bytes && *room.bytes < copy.bytes)
    throw WorldError(
        Sentence{"{}: is read more than once, which needs a copy of its samples ({} GB), but {} has only "
                 "{} GB free; name another directory with {}",
                 {copy.volume, fmt::format("{:.2f}", gigabytes(copy.bytes)), copy.folder,
                  fmt::format("{:.2f}", gigabytes(*room.bytes)), spool}});
  const bool is_chosen = !resources.spool.empty();
  if (room.is_in_memory && !is_chosen && resources.memory && copy.bytes + besides > *resources.memory)
    throw WorldError(Sentence{
        "{}: is read more than once, which needs a copy of its samples ({} GB), but {} is a file system in "
        "memory, and the copy would exceed the memory limit; name a directory on a disk with {}",
        {copy.volume, fmt::format("{:.2f}", gigabytes(copy.bytes)), copy.folder, spool}});
  if (tell) tell(copy);
  return spooled(std::move(source), copy.folder);
}

std::unique_ptr<VolumeSource> view_of_rows(VolumeSource& source, std::int64_t kept) {
  return rows_of_slices(std::shared_ptr<VolumeSource>(std::shared_ptr<void>(), &source), kept);
}

}  // namespace tagrid
