#include "io/formats/open_volume.h"

#include <fmt/format.h>

#include "io/files/errors.h"
#include "io/formats/formats.h"
#include "io/samples/file_samples.h"

namespace tagrid {
namespace {

BrokenInput no_volume(FileBytes& file) {
  const std::string_view beginning = file.peek(bytes_to_recognise());
  if (beginning.empty()) return BrokenInput(file.name() + ": is empty, so it is not a volume");
  if (const Format* other = format_of(beginning, false))
    return BrokenInput(fmt::format("{}: {}", file.name(), other->what), other->problem);
  std::string known;
  for (const Format& format : formats())
    if (format.open != nullptr && format.is_mine != nullptr)
      known += fmt::format("{}{}", known.empty() ? "" : " or ", format.what);
  return BrokenInput(fmt::format("{}: not {}", file.name(), known), Problem::no_known_format);
}

}  // namespace

std::unique_ptr<VolumeSource> open_volume(const std::string& path, const SourceDescription& source) try {
  auto file = std::make_unique<FileBytes>(path);
  const bool is_described = source.raw && source.raw->offset > 0;
  const Format* format = is_described ? nullptr : format_of(file->peek(bytes_to_recognise()), true);
  if (!source.vdb_grid.empty() && (format == nullptr || !format->has_grids))
    throw UsageError(file->name() + ": is not an OpenVDB file", Problem::not_openvdb);
  if (format == nullptr && source.raw) format = &format_named("raw");
  if (format == nullptr) throw no_volume(*file);
  return format->open(std::move(file), path, source);
} catch (const WrongSize& wrong) {
  const Format* other = format_of(wrong.beginning, false);
  if (other == nullptr) throw;
  throw BrokenInput(fmt::format("{}; it {}", wrong.what(), other->what), other->problem);
}

}  // namespace tagrid
