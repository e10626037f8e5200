// What the commands mesh and surface have in common: each writes a form of the grid of a .tag file.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "io/metadata/lengths.h"
#include "pipeline/meshes/grid_input.h"
#include "pipeline/progress/progress.h"
#include "tools/options/output_options.h"
#include "tools/report/process.h"
#include "tools/report/report.h"
#include "tools/report/run_report.h"

namespace tagrid {

/// The words for what such a command writes, and the usual extension of its files.
struct GridForm {
  const char *name, *plural, *extension;
  bool uses_grid = true;  ///< the adaptive grid of the file
};

/// The options of such a command. Options has a region; Result is a GridResult.
template <class Options, class Result>
struct GridCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;
  Options options;
  std::string region;
  std::optional<std::int64_t> volume;
  std::string path;  ///< of the output, after write()

  /// Checks the options, calls `write_form`, writes the report, and warns of what the user should know of the
  /// output. `add_settings(result, settings)` adds to the settings in the report.
  template <class AddSettings>
  Result write(const Ranks& ranks, const GridForm& form,
               const std::function<Finished<Result>(const GridRun<Options>&)>& write_form,
               AddSettings add_settings) {
    run.obey_memory_limit();
    options.region = wanted_region(region);
    options.overwrite = output.overwrite;
    if (output.path.empty() && (!options.region.is_all() || volume))
      throw UsageError(
          "a region or a volume needs -o FILE: without it, the output would have the name of the entire {}",
          form.name);
    path = output.path.empty() ? output_beside(input, form.extension) : output.path;
    require_tag_input(input);
    refuse_terminal(ranks, path, form.plural);
    remove_abandoned(run, {input}, {path});
    RunReport report(run.json, run.thread_count(), output.overwrite, form.name, input, path);
    const std::int64_t number = chosen_volume(input, volume, run);
    Finished<Result> written = [&] {
      ProgressMeter meter(run.progress, run.quiet, fmt::format("writing the {}", form.name), 1);
      return write_form({input, number, path, options, run.resources(ranks), meter.progress()});
    }();
    const GridResult& result = written.result;
    RunFigures figures = figures_of(result.header, result.index, result.bytes_in, result.bytes_out);
    add_settings(written.result, figures.settings);
    report.write(figures, written);
    for (const std::string& warning : result.warnings) warn(run, warning);
    if (const std::string doubt = doubt_of_range(result.header, result.index.total);
        form.uses_grid && !doubt.empty())
      warn(run, "{}: {}", shown_input(input), doubt);
    if (const std::string mixed = lost_by_mixed_units(result.header.metadata.geometry()); !mixed.empty())
      warn(run, path + ": " + mixed);
    if (has_uneven_slices(result.header))
      warn(run, "{}: slices of the source are unequally spaced; in the {} all distances are equal", path,
           form.name);
    return std::move(written.result);
  }

  /// Says how much was written, and with -v in which coordinates.
  void tell_size(const std::string& counts, const TagHeader& header) const {
    if (run.says_result()) say_line(counts);
    if (run.is_verbose()) say_line("coordinates: " + coordinates_text(header));
  }
};

}  // namespace tagrid
