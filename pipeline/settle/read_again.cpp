#include "pipeline/settle/read_again.h"

#include <fmt/format.h>

#include <algorithm>
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
      return !traits.any_rows && (!traits.whole_slices || resources.spool);
  }
  return false;
}

std::unique_ptr<VolumeSource> copied(std::unique_ptr<VolumeSource> source, const Resources& resources,
                                     std::uint64_t besides, const TellOfCopy& tell) {
  const SampleCopy copy{source->name(), spool_folder(resources.spool, "-"),
                        *sample_bytes(source->info().dims, source->info().type)};
  const RoomForFiles room = room_in(copy.folder);
  const Setting spool{"spool", "another directory"};
  if (room.bytes && *room.bytes < copy.bytes)
    throw WorldError(
        "{}: is read more than once, which needs a copy of its samples ({} GB), but {} has only "
        "{} GB free; name another directory with {}",
        copy.volume, fmt::format("{:.2f}", gigabytes(copy.bytes)), copy.folder,
        fmt::format("{:.2f}", gigabytes(*room.bytes)), spool);
  const bool is_chosen = resources.spool.has_value();
  if (room.is_in_memory && !is_chosen && resources.memory && copy.bytes + besides > *resources.memory)
    throw WorldError(
        "{}: is read more than once, which needs a copy of its samples ({} GB), but {} is a file system in "
        "memory, and the copy would exceed the memory limit; name a directory on a disk with {}",
        copy.volume, fmt::format("{:.2f}", gigabytes(copy.bytes)), copy.folder, spool);
  if (tell) tell(copy);
  return spooled(std::move(source), copy.folder);
}

EncodeJob settle_any(const EncodeOptions& given, std::unique_ptr<VolumeSource>& volume,
                     const Settling& settling) {
  const ResolvedOptions options = in_samples(given, volume->facts());
  Settling with_view = settling;
  // A view of rows has a slice.
  if (look_of(options, {}) >= Look::a_few_rows && volume->traits().whole_slices)
    with_view.needs.besides += volume->slice_bytes();
  EncodeJob job = planned(options, with_view);
  const Look look = look_of(options, settling.earlier);
  const bool has_copy = needs_copy(volume->traits(), look, settling.resources);
  if (has_copy) volume = copied(std::move(volume), settling.resources, job.memory, settling.before_copy);
  std::int64_t kept = 0;
  std::unique_ptr<VolumeSource> view;
  if (look >= Look::a_few_rows && !volume->traits().any_rows) {
    // With all slices that a layer of bricks needs, none is decoded twice in one pass.
    const std::int64_t layer = std::min(options.parameters.bricks().length() + 1, options.parameters.dims.z);
    if (look == Look::all_rows_often)
      kept = slices_beside(options.parameters, job.plan, settling.resources, layer);
    view = rows_of_slices(std::shared_ptr<VolumeSource>(std::shared_ptr<void>(), volume.get()), kept);
  }
  find_in_samples(job, options, view ? *view : *volume, with_view);
  job.times_read += has_copy;
  job.memory += static_cast<std::uint64_t>(kept) * volume->slice_bytes();
  return job;
}

}  // namespace tagrid
