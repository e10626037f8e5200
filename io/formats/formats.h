// The formats of volumes, as a table. A format is a row and a room of its own: names of files, messages, help and
// what is done with a file follow from the row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/files/errors.h"
#include "io/files/file_bytes.h"
#include "io/vdb/writer.h"
#include "io/volume/volume_sink.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// How a volume is written; of what is meant for one format, others take no notice.
struct WriteOptions {
  SinkOptions files = {};
  VdbOptions vdb = {};
};

/// A format without `open` is not read, one without `create` not written. One that has neither is recognised,
/// to say what can be done with it.
struct Format {
  std::string_view name;  ///< "nrrd"
  /// How names of its files end, in lower case: ".nrrd". The first is the usual one.
  std::vector<std::string_view> extensions;
  std::string_view help;       ///< One line: "header and samples".
  std::string_view what = "";  ///< "an NRRD volume"; "is a DICOM file" and what to do, if it is not read.
  Problem problem = Problem::none;  ///< Of a file that is not read.

  /// Whether a file that begins so is one: with its first `peek` bytes, or all there are. Files of a format
  /// without it are read where somebody says what they are.
  std::size_t peek = 0;
  bool (*is_mine)(std::string_view beginning) = nullptr;
  /// Reads `file`, which was opened at `path` and stands at its beginning.
  std::unique_ptr<VolumeSource> (*open)(std::unique_ptr<FileBytes> file, const std::string& path,
                                        const SourceDescription& source) = nullptr;

  /// Begins a volume at `path`, or on the standard output for "-". Throws UsageError if a file is there and may
  /// not be overwritten, or the format cannot be written there; WorldError if it cannot be created.
  std::unique_ptr<VolumeSink> (*create)(const std::string& path, const VolumeInfo& info,
                                        const WriteOptions& options) = nullptr;
  bool any_order = false;  ///< A file is written in any order, by several processes if need be.
  bool has_grids = false;  ///< SourceDescription::vdb_grid and VdbOptions are meant for it.
  /// How the name of the file with the samples ends instead: ".raw"; "" if there is one file only.
  std::string_view samples_extension = "";
  /// Bytes that writing takes besides the samples that are given.
  std::uint64_t (*memory)(const VolumeInfo& info) = [](const VolumeInfo&) { return std::uint64_t{0}; };
};

/// All that are known; those that are written in the order in which people are told of them.
const std::vector<Format>& formats();

/// Those that are written.
std::vector<const Format*> written_formats();
/// The format of that name; throws UsageError if none is written that is called so.
const Format& format_named(std::string_view name);
/// The format that is written to files whose names end so; nullptr if there is none.
const Format* format_with_extension(const std::string& path);
/// The same, and raw for "-"; throws UsageError if there is none.
const Format& format_from_name(const std::string& path);

/// Bytes of a file that format_of() wants to see.
std::size_t bytes_to_recognise();
/// The format of a file that begins so: of those that are read, or of the others. nullptr if there is none.
const Format* format_of(std::string_view beginning, bool is_read);

/// The file that the samples of a volume at `path` are written to: beside a detached header, else `path`.
std::string samples_path(const std::string& path, const Format& format);

}  // namespace tagrid
