// The formats of volumes, as a table. A format is one row, and has a room of its own. File names, messages,
// help and the handling of a file follow from the row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_bytes.h"
#include "io/volume/volume_sink.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// How a volume is written.
struct WriteOptions {
  SinkOptions files = {};
  /// For programs that write formats, by their names: see docs/dev/readers.md. Those that a format does not have
  /// are ignored.
  std::map<std::string, std::string> wishes = {};
  KnownFacts known = {};
  /// Bytes of memory that such a program may take until it has said how much it needs.
  std::uint64_t first_memory = most_first_memory;
};

/// Bytes that files of a format have at this place.
struct Magic {
  std::string_view bytes;
  std::size_t at = 0;
};

/// True for a file that begins as one of these says.
bool begins_with_any(std::string_view beginning, const std::vector<Magic>& magic);

/// How files of a format are recognized and read. A format with neither `open` nor `program` cannot be read.
struct Reads {
  /// A file has the format if it has one of these, or if `is_mine` returns true for its first `peek` bytes,
  /// or for the whole file if that is shorter. Formats with neither are read only if the user says what the
  /// file is.
  std::vector<Magic> magic = {};
  /// Files with one of the extensions have the format if they begin as one of these says, as others do, too.
  std::vector<Magic> named_magic = {};
  std::size_t peek = 0;
  bool (*is_mine)(std::string_view beginning) = nullptr;
  bool in_gzip = false;  ///< The whole file may be in gzip; then what is in it is recognized.
  /// Reads `file`, which was opened at `path` and is at its beginning.
  std::unique_ptr<VolumeSource> (*open)(std::unique_ptr<FileBytes> file, const std::string& path,
                                        const SourceDescription& source) = nullptr;
  /// Reads a directory of such files, each of which is a slice; nullptr if tagrid itself reads none.
  std::unique_ptr<VolumeSource> (*open_folder)(const std::string& folder,
                                               const SourceDescription& source) = nullptr;
  bool has_series = false;         ///< SourceDescription::series applies to files that tagrid itself reads.
  bool takes_description = false;  ///< SourceDescription::raw may be given.

  /// The program tagrid-read-PROGRAM reads it; "" if tagrid does so itself.
  std::string_view program = "";
  bool has_folders = false;  ///< A directory of such files can be one volume, or hold several.
  /// Such files often are pictures beside volumes: a directory that has slices of another format is one of those.
  bool are_often_pictures = false;
  /// True for a directory that is a file of this format, as it were; nullptr if there are none.
  bool (*is_folder)(const std::string& folder) = nullptr;

  /// The format whose row reads such files, too; "" for this one.
  std::string_view as = "";

  bool any() const { return open != nullptr || !program.empty(); }
  bool is_recognized() const { return !magic.empty() || is_mine != nullptr; }
  bool begins(std::string_view beginning) const;
  std::size_t bytes_to_recognize() const;  ///< how many bytes of a file begins() needs
};

/// How files of a format are written. A format without `header`, `detached_header`, `create` and `program`
/// cannot be written.
struct Writes {
  /// The bytes before the samples in a file that tagrid itself writes.
  std::string (*header)(const VolumeInfo& info) = nullptr;
  std::string_view trailer = "";  ///< The bytes after the samples.
  bool in_gzip = false;           ///< The whole file is written in gzip.
  /// The header of samples in a file of their own, with `samples_extension`. Throws UsageError if it cannot
  /// name that file.
  std::string (*detached_header)(const VolumeInfo& info, const std::string& data_file) = nullptr;
  /// Begins files that are more than a header and samples. Throws as create_volume() does.
  std::unique_ptr<VolumeSink> (*create)(const std::string& path, const VolumeInfo& info,
                                        const KnownFacts& known, const SinkOptions& options) = nullptr;
  bool has_levels = false;  ///< Files have the levels of KnownFacts, too.
  /// The program tagrid-write-PROGRAM writes it; "" if tagrid does so itself.
  std::string_view program = "";
  bool holds_volume = false;  ///< The program keeps the volume in memory, as a whole.
  bool any_order = false;     ///< A file can be written in any order, even by several processes.
  /// The extension of the file with the samples, if that is a separate file: ".raw"; otherwise "".
  std::string_view samples_extension = "";
  /// Bytes of memory that writing takes, besides the samples that are passed in, and besides
  /// VolumeSink::memory().
  std::uint64_t (*memory)(const VolumeInfo& info) = [](const VolumeInfo&) { return std::uint64_t{0}; };

  bool any() const {
    return header != nullptr || detached_header != nullptr || create != nullptr || !program.empty();
  }
};

/// What a file that is written keeps of the volume, and what it loses.
struct Keeps {
  /// A file says one distance between slices, and one slope and intercept for all samples.
  bool slices_are_alike = false;
  bool volumes = false;  ///< A file can have several volumes; see VolumeInfo::volumes.
  /// Programs that read this format apply the slope and the intercept in a file to its samples.
  bool applies_rescale = false;
  /// A file has every line of the header, or everything that follows from them.
  bool header = false;
  bool loss = false;  ///< Without the header, a file has the text of lossy_source_key.
  /// Without the header, a file of this volume has the unit of values.
  bool (*units)(const VolumeInfo& info) = [](const VolumeInfo&) { return false; };
  /// The prefix of key-value pairs that this format stores in its own fields; "" if there are none.
  std::string_view own_pairs = "";
  /// A sentence if a file of this volume has no place for its slope and intercept; otherwise "".
  std::string (*lost_rescale)(const VolumeInfo& info) = [](const VolumeInfo&) { return std::string(); };
  /// What else this format loses of the volume, one sentence for each loss.
  std::vector<std::string> (*lost)(const VolumeInfo& info) = [](const VolumeInfo&) {
    return std::vector<std::string>();
  };
};

/// Formats that are neither read nor written are in other_formats.h.
struct Format {
  std::string_view name;  ///< "nrrd"
  /// The extensions of its files, in lower case: ".nrrd". The first one is the usual one.
  std::vector<std::string_view> extensions;
  std::string_view help;       ///< One line: "header and samples".
  std::string_view what = "";  ///< "an NRRD volume"
  bool has_grids = false;      ///< SourceDescription::vdb_grid applies to it, and so do wishes about grids.
  Reads reads = {};
  Writes writes = {};
  Keeps keeps = {};
};

/// All known formats. Those that can be written come in the order in which help lists them.
const std::vector<Format>& formats();

/// The formats that can be written, but for those of programs that somebody added.
std::vector<const Format*> written_formats();
/// The format with this name: of the table, also one of its endings without the dot, or of a program
/// tagrid-write-NAME that somebody added. Throws UsageError if no format with this name can be written.
const Format& format_named(std::string_view name);
/// The format that is written to files with this extension, as above; nullptr if there is none.
const Format* format_with_extension(const std::string& path);
/// The same, but raw for "-". Throws UsageError if there is none.
const Format& format_from_name(const std::string& path);

/// Begins a volume of this format at `path`, or on the standard output for "-". Throws UsageError if a file
/// exists and may not be overwritten, or if the format cannot be written there; WorldError if it cannot be
/// created, or if the program that writes the format is missing.
std::unique_ptr<VolumeSink> create_volume(const Format& format, const std::string& path,
                                          const VolumeInfo& info, const WriteOptions& options);

/// The format with this name, if it can be read; nullptr if there is none.
const Format* read_format_named(std::string_view name);
/// The names of all formats that can be read, by tagrid itself or by a program that is there.
std::vector<std::string> read_format_names();

/// The number of bytes of a file that format_of() needs.
std::size_t bytes_to_recognize();
/// The format that can be read and begins like this; nullptr if there is none.
const Format* format_of(std::string_view beginning);

/// The format of which a directory is a file, as it were; nullptr if it is one of no format.
const Format* format_of_folder(const std::string& folder);

/// What a file of this format cannot say of the volume, besides Keeps::lost_rescale: sentences for users.
std::vector<std::string> losses(const Format& format, const VolumeInfo& info);
/// A sentence on the attributes of DICOM, and the unit HU, that a file of this format has no place for; "" if
/// there are none. They are not among losses(), as nobody who chooses the format expects them there.
std::string usual_losses(const Format& format, const VolumeInfo& info);

/// The file that holds the samples of a volume at `path`: the one beside a detached header, or `path` itself.
std::string samples_path(const std::string& path, const Format& format);

}  // namespace tagrid
