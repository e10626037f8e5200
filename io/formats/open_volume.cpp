#include "io/formats/open_volume.h"

#include <fmt/format.h>

#include "io/files/errors.h"
#include "io/formats/other_formats.h"
#include "io/nrrd/header.h"
#include "io/nrrd/source.h"
#include "io/samples/file_samples.h"
#include "io/vdb/reader.h"

namespace tagrid {
namespace {

BrokenInput no_volume(FileBytes& file) {
  if (file.peek(1).empty()) return BrokenInput(file.name() + ": is empty, and no volume");
  const OtherFormat format = other_format(file.peek(other_formats_peek));
  if (!format.what.empty())
    return BrokenInput(fmt::format("{}: {}", file.name(), format.what), format.problem);
  return BrokenInput(file.name() + ": not an NRRD volume, nor an OpenVDB file", Problem::no_known_format);
}

}  // namespace

std::unique_ptr<VolumeSource> open_volume(const std::string& path, const SourceDescription& source) try {
  auto file = std::make_unique<FileBytes>(path);
  const bool headerless = source.raw && source.raw->offset > 0;
  if (!headerless && begins_vdb(file->peek(8))) return open_vdb(std::move(file), path, source);
  if (!source.vdb_grid.empty()) throw UsageError(file->name() + ": is no OpenVDB file", Problem::not_openvdb);
  if (!headerless && begins_nrrd(file->peek(9))) return open_nrrd(std::move(file), path, source);
  if (source.raw) return open_raw(std::move(file), path, source);
  throw no_volume(*file);
} catch (const WrongSize& wrong) {
  const OtherFormat format = other_format(wrong.beginning);
  if (format.what.empty()) throw;
  throw BrokenInput(fmt::format("{}; it {}", wrong.what(), format.what), format.problem);
}

}  // namespace tagrid
