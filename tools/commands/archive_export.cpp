// tagrid archive restore and export: volumes leave an archive, as the files that they were or in another format.

#include <cerrno>
#include <filesystem>
#include <memory>
#include <string>

#include "io/errors/errors.h"
#include "io/system/files.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/archive/manifest.h"
#include "tools/commands/archive_command.h"
#include "tools/commands/commands.h"
#include "tools/options/output_options.h"
#include "tools/report/failure.h"
#include "tools/report/process.h"

namespace tagrid {
namespace {

namespace fs = std::filesystem;

/// Calls take(path of the output, its name without .tag) for volumes that are wanted. One that fails is reported, and
/// the next one follows. Throws BrokenInput if one failed. `done`: "restored".
template <class Take>
void take_out(const ArchiveCommand& command, const char* name, const char* done, const Take& take) {
  const Catalogue catalogue = command.opened();
  std::size_t taken = 0, failed = 0;
  for (const CatalogueEntry& entry : command.named(catalogue, name)) {
    const std::string path = catalogue.path_of(entry.name);
    try {
      if (!entry.bytes)
        throw BrokenInput(entry.status == "failed" ? "was never encoded: " + entry.problem
                                                   : path + ": is gone");
      take(path, text_of(path_of(entry.name).replace_extension()));
      ++taken;
    } catch (const Error&) {
      ++failed;
      say("tagrid: {}: {}", entry.name, current_failure().message);
    }
  }
  if (command.run.is_watched() || failed > 0) say("volumes: {} {}, {} failed", taken, done, failed);
  if (failed > 0)
    throw BrokenInput("{}: {} could not be {}", command.folder, counted(failed, "volume"), done);
}

void make_target(const std::string& folder) {
  if (!files().make_folder(folder) && errno != EEXIST)
    throw world_error("cannot create the directory", folder, errno);
}

struct ArchiveRestoreCommand : ArchiveCommand {
  OutputOptions output;

  void execute(Ranks& ranks) const {
    if (output.path.empty() || output.path == "-")
      throw UsageError(
          "give -o TARGET, the directory for the originals; restore --records brings all back to their "
          "places");
    make_target(output.path);
    take_out(*this, "archive restore", "restored", [&](const std::string& path, const std::string& name) {
      make_own_folders(output.path, name);
      restore_files_of(path, path_in(output.path, name), output.overwrite, run, ranks);
    });
  }
};

/// Not a format of volumes: source files are exported, not samples alone.
constexpr const char* dicom = "dicom";

struct ArchiveExportCommand : ArchiveCommand {
  ExportedVolume volume;  ///< its paths are those of each output

  void execute(Ranks& ranks) const {
    if (volume.output.empty() || volume.output == "-")
      throw UsageError("give -o TARGET, the directory for the volumes");
    if (volume.format.empty())
      throw UsageError("give --format NAME, such as nrrd, nifti, tiff, zarr or dicom");
    if (volume.format == dicom) refuse_for_dicom();
    make_target(volume.output);
    if (volume.format == dicom)
      return take_out(*this, "archive export", "exported",
                      [&](const std::string& path, const std::string& name) {
                        make_own_folders(volume.output, name);
                        export_as_dicom(path, path_in(volume.output, name), volume.overwrite, run, ranks);
                      });
    wanted_region(volume.region);  // refused before the first volume
    const std::string extension(format_named(volume.format).extensions.front());
    take_out(*this, "archive export", "exported", [&](const std::string& path, const std::string& name) {
      ExportedVolume one = volume;
      one.input = path;
      one.output = path_in(volume.output, (name + extension));
      make_own_folders(volume.output, name + extension);
      decode_as(one, run, ranks);
    });
  }

  void refuse_for_dicom() const {
    const char* option = !volume.region.empty() ? "--region"
                         : volume.step != 1     ? "--step"
                         : volume.overview != 0 ? "--overview"
                         : volume.values        ? "--values"
                                                : nullptr;
    if (option != nullptr)
      throw UsageError(
          "{}: --format dicom exports complete series of stored samples; other formats, such as nrrd, nifti "
          "and tiff, have this option",
          option);
  }
};

}  // namespace

Action add_archive_restore_command(CLI::App& app) {
  auto state = std::make_shared<ArchiveRestoreCommand>();
  CLI::App* command =
      add_archive_action(app, *state, "restore", "Restore the source files of volumes below a directory");
  add_text_option(*command, "-o,--output", state->output.path, "TARGET",
                  "Directory for the volumes, by the names of their outputs");
  command->add_flag("-f,--force", state->output.overwrite, "Overwrite files that exist");
  add_run_options(*command, state->run);
  add_memory_option(*command, state->run);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

Action add_archive_export_command(CLI::App& app) {
  auto state = std::make_shared<ArchiveExportCommand>();
  CLI::App* command = add_archive_action(app, *state, "export",
                                         "Decode volumes below a directory; with dicom, as a new series");
  ExportedVolume& volume = state->volume;
  add_text_option(*command, "-o,--output", volume.output, "TARGET",
                  "Directory for the volumes, by the names of their outputs");
  add_format_option(*command, volume.format, dicom);
  add_region_option(*command, volume.region);
  add_number_option(
      *command, "--step", volume.step, "N",
      "Only every Nth sample along each axis, counted from 0 in the entire volume: 1, 2, 4, ...");
  add_number_option(
      *command, "--overview", volume.overview, "F",
      "The means of blocks of F samples along each axis, if the file has them (see tagrid info)");
  command->add_flag("--values", volume.values,
                    "Write values in every format; integers if slope and intercept are, otherwise floats");
  command->add_flag("-f,--force", volume.overwrite, "Overwrite files that exist");
  add_run_options(*command, state->run);
  add_memory_option(*command, state->run);
  return [state](Ranks& ranks) { state->execute(ranks); };
}

}  // namespace tagrid
