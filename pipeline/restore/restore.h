// Source files in a .tag file: kept by encoding, compared by verification, restored by `tagrid restore`.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/envelope/envelope.h"
#include "io/envelope/restored_files.h"
#include "io/formats/dicom/exported.h"
#include "io/tag/bricks.h"
#include "io/volume/volume_source.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"

namespace tagrid {

/// Looks at the content of all files, with so many threads. Throws as look_at_content() does.
void look_at_contents(SourceFiles& source, bool exact, int threads);

struct RestoreRun {
  std::string input;   ///< a .tag file; not a pipe
  std::string folder;  ///< for the files
  bool overwrite = false;
  /// Files of DICOM become images of their own; others are a BrokenInput.
  std::optional<DicomExport> exported = {};
  Resources resources{0};
  Progress progress = {};
};

/// The source files of a .tag file, or their plain form.
struct KeptFiles {
  std::vector<EnvelopeFile> files;
  std::string compression;  ///< of the samples in the source; "" if these are its files as they were
};

struct RestoreResult {
  TagHeader header;
  TagIndex index;  ///< with the statistics of all volumes
  std::uint64_t bytes_in = 0, bytes_out = 0;
  KeptFiles kept;
};

/// Restores the source files of a .tag file: byte for byte if its samples are exact, which is checked;
/// otherwise with decoded samples. Files whose samples were compressed come in their plain form. Throws
/// UsageError if the file has no source files, or if one is in the way; BrokenInput; WorldError.
Finished<RestoreResult> restore_files(const RestoreRun& run);

/// Bytes of memory that reading the envelope of a .tag file takes; 0 if it cannot be read. Throws WorldError.
std::uint64_t memory_of_envelope(const std::string& path);
/// Reads the envelope of a .tag file to the end. Throws BrokenInput.
KeptFiles source_files_of(const TagBricks& file);

/// How the source files in a .tag file compare with others.
struct SourceComparison {
  bool has_same_names = false;
  /// All bytes besides the samples are equal; and so are the samples, if they are exact.
  bool is_same = false;
  std::string compression;  ///< of the samples; then plain forms were compared
  std::string difference;   ///< a sentence about the first difference
};
/// Compares all bytes in the envelope with the files of `original`, with so many threads.
SourceComparison compare_source_files(const TagBricks& file, const VolumeSource& original, int threads);
/// Throws BrokenInput if the files of the volume named `original` differ.
void require_same(const SourceComparison& found, const std::string& original);

}  // namespace tagrid
