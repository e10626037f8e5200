// The export of a volume as a DICOM series: the source files, as images of their own.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/files/file_bytes.h"
#include "io/files/open_source.h"
#include "io/files/output_folder.h"
#include "io/files/temporaries.h"
#include "io/metadata/loss.h"
#include "io/system/files.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "io/text/text.h"
#include "pipeline/restore/restore.h"
#include "tools/commands/commands.h"
#include "tools/report/damage.h"
#include "tools/report/failure.h"
#include "tools/report/process.h"
#include "tools/report/report.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

bool is_dicom_file(const std::string& path) {
  constexpr std::size_t magic_at = 128;
  std::array<std::byte, 4> magic;
  const FileSource file(path);
  if (file.size() < magic_at + magic.size()) return false;
  file.read_at(magic_at, magic);
  return std::ranges::equal(magic, std::string_view("DICM"), {}, {}, [](char c) { return std::byte(c); });
}

/// True for a directory of DICOM files alone, such as an earlier export.
bool is_series(const std::string& folder) {
  std::vector<FolderEntry> entries;
  return files().list(folder, entries) && std::ranges::all_of(entries, [&](const FolderEntry& entry) {
           const std::string path = folder + "/" + entry.name;
           const auto status = status_of_name(path);
           if (status && status->is_folder()) return is_series(path);
           return status && status->is_file() && is_dicom_file(path);
         });
}

std::string in_ascii(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

DicomExport export_of(const TagBricks& file) {
  const TagHeader& header = file.header();
  const Statistics total = statistics_of_all(file);
  DicomExport how{
      .done = "exact", .loss = "", .was_lossy = !header.metadata.text_of(lossy_source_key).empty()};
  if (header.parameters.is_exact() || total.max_error == 0) return how;
  // Parity is no part of what the samples were compressed to.
  const std::uint64_t bytes = file.sizes().file - file.sizes().parity;
  how.ratio = static_cast<double>(*sample_bytes(header.all_dims(), header.parameters.type)) /
              static_cast<double>(bytes);
  const Achieved achieved = achieved_of(total);
  how.done = fmt::format("bound {}, largest error {}, rmse {}, {} bytes", header.parameters.max_error,
                         total.max_error, achieved.rmse, bytes);
  how.loss = in_ascii(
      fmt::format("lossy compression by tagrid; samples differ from those of the original by at most {}",
                  error_text(total.max_error, header)));
  return how;
}

/// True if no byte of the file was changed: its content is refused, which no repair changes.
bool is_intact(const std::string& input) {
  try {
    TagReader(input).read_to_end();
    return true;
  } catch (const Error&) {
    return false;
  }
}

void export_series(const std::string& input, const std::string& folder, bool overwrite, const RunOptions& run,
                   const Ranks& ranks) {
  if (remove_abandoned_folders({folder}) > 0 && run.is_watched())
    say_line("tagrid: removed the hidden directory of a killed run");
  const TagBricks file(open_source(input));
  if (file.sizes().envelope == 0)
    throw UsageError(
        "keeps no source files, whose headers a DICOM series needs: it was not made from DICOM files, or "
        "without their headers (--strip, --grid-only, or a pipe); give another --format, such as nrrd or "
        "nifti");
  const DicomExport how = export_of(file);
  OutputFolder target(folder, overwrite, attributes_of(input), is_series);
  ProgressMeter meter(run.progress, run.quiet, "exporting", 1);
  Finished<RestoreResult> restored = restore_files({.input = input,
                                                    .folder = target.hidden(),
                                                    .exported = how,
                                                    .resources = run.resources(ranks),
                                                    .progress = meter.progress()});
  restored.commit();
  target.publish();
  target.keep();
  if (run.is_verbose())
    say("{}: {}, {}", folder, counted(restored.result.kept.files.size(), "DICOM file"),
        how.loss.empty() ? "with exact samples" : how.loss);
}

}  // namespace

void export_as_dicom(const std::string& input, const std::string& folder, bool overwrite,
                     const RunOptions& run, const Ranks& ranks) {
  try {
    export_series(input, folder, overwrite, run, ranks);
  } catch (const BrokenInput& broken) {
    throw BrokenInput(is_intact(input) ? words_of(broken) : words_with_repair(input, broken));
  }
}

}  // namespace tagrid
