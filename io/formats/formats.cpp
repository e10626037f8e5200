#include "io/formats/formats.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "io/formats/other_formats.h"
#include "io/nrrd/header.h"
#include "io/nrrd/line.h"
#include "io/nrrd/sink.h"
#include "io/nrrd/source.h"
#include "io/vdb/reader.h"

namespace tagrid {
namespace {

using Sink = std::unique_ptr<VolumeSink>;

std::vector<Format> all_formats() {
  std::vector<Format> rows = {
      {.name = "nrrd",
       .extensions = {".nrrd"},
       .help = "header and samples",
       .what = "an NRRD volume",
       .peek = 9,
       .is_mine = begins_nrrd,
       .open = open_nrrd,
       .create = [](const std::string& path, const VolumeInfo& info, const WriteOptions& options) -> Sink {
         return create_nrrd(path, info, options.files);
       },
       .any_order = true},
      // The row "nrrd" reads these files.
      {.name = "nhdr",
       .extensions = {".nhdr"},
       .help = "header, with samples in a .raw file beside it",
       .create = [](const std::string& path, const VolumeInfo& info, const WriteOptions& options) -> Sink {
         return create_nhdr(path, samples_path(path, format_named("nhdr")), info, options.files);
       },
       .any_order = true,
       .samples_extension = ".raw"},
      {.name = "raw",
       .extensions = {".raw"},
       .help = "samples alone",
       .open = open_raw,
       .create = [](const std::string& path, const VolumeInfo& info, const WriteOptions& options) -> Sink {
         return create_raw(path, info, options.files);
       },
       .any_order = true},
      {.name = "vdb",
       .extensions = {".vdb"},
       .help = "OpenVDB",
       .what = "an OpenVDB file",
       .peek = 8,
       .is_mine = begins_vdb,
       .open = open_vdb,
       .create = [](const std::string& path, const VolumeInfo& info, const WriteOptions& options) -> Sink {
         return create_vdb(path, info, options.files, options.vdb);
       },
       .has_grids = true,
       .memory = memory_of_vdb_writer},
  };
  for (Format& other : other_formats()) rows.push_back(std::move(other));
  return rows;
}

}  // namespace

const std::vector<Format>& formats() {
  static const std::vector<Format> table = all_formats();
  return table;
}

std::vector<const Format*> written_formats() {
  std::vector<const Format*> written;
  for (const Format& format : formats())
    if (format.create != nullptr) written.push_back(&format);
  return written;
}

const Format& format_named(std::string_view name) {
  std::vector<std::string_view> names;
  for (const Format* format : written_formats()) {
    if (format->name == name) return *format;
    names.push_back(format->name);
  }
  throw UsageError(fmt::format("{}: must be one of {}", name, fmt::join(names, ", ")));
}

const Format* format_with_extension(const std::string& path) {
  const std::string name = lower_case(std::filesystem::path(path).filename().string());
  for (const Format* format : written_formats())
    for (const std::string_view extension : format->extensions)
      if (name.size() > extension.size() && name.ends_with(extension)) return format;
  return nullptr;
}

const Format& format_from_name(const std::string& path) {
  if (path == "-") return format_named("raw");
  if (const Format* format = format_with_extension(path)) return *format;
  std::string endings;
  const auto written = written_formats();
  for (const Format* format : written)
    endings += fmt::format("{}{} ({})",
                           format == written.front()  ? ""
                           : format == written.back() ? " or "
                                                      : ", ",
                           format->extensions.front(), format->help);
  throw UsageError(fmt::format("{}: the name of a volume must end in {}", path, endings));
}

std::size_t bytes_to_recognise() { return std::ranges::max(formats(), {}, &Format::peek).peek; }

const Format* format_of(std::string_view beginning, bool is_read) {
  for (const Format& format : formats())
    if (format.is_mine != nullptr && (format.open != nullptr) == is_read && format.is_mine(beginning))
      return &format;
  return nullptr;
}

std::string samples_path(const std::string& path, const Format& format) {
  if (format.samples_extension.empty()) return path;
  return std::filesystem::path(path).replace_extension(format.samples_extension).string();
}

}  // namespace tagrid
