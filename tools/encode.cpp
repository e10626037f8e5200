// tagrid encode: a volume to a .tag file.

#include <fmt/format.h>

#include <algorithm>

#include "io/errors.h"
#include "io/file_attributes.h"
#include "io/system_call.h"
#include "io/temporaries.h"
#include "pipeline/dims_order.h"
#include "pipeline/encode_parts.h"
#include "pipeline/run.h"
#include "tools/commands.h"
#include "tools/exit_codes.h"
#include "tools/input_removal.h"
#include "tools/process.h"
#include "tools/report.h"
#include "tools/run_report.h"
#include "tools/shared_options.h"

namespace tagrid {
namespace {

struct EncodeCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;
  RawOptions raw;
  EncodeOptions options;
  std::string range;
  bool remove = false, resume = false;

  // "auto" or lo:hi.
  void parse_range() {
    if (range.empty()) return;
    if (range == "auto") {
      options.range_from_data = true;
      return;
    }
    options.range = value_range(range);
    if (!options.range) throw UsageError(fmt::format("--range {}: must be lo:hi or auto", range));
  }

  void execute() {
    parse_range();
    const std::string path = output.path.empty() ? output_beside(input, ".tag") : output.path;
    refuse_terminal_input(input);
    refuse_terminal(path, "compressed bytes");
    const auto description = raw.description();
    options.validate();
    if (resume) require_resumable(path);
    std::vector<std::string> removed_after;
    if (remove) removed_after = removable_volume(input, description, path);
    RunReport report(run, output.overwrite, "encode", input, path);
    if (description) warn_of_order(*description);

    const EncodeResult result = encode(description, path, [&](const EncodeResult& written) {
      if (remove) verify_encoding(input, description, written.temporary, run.resources());
      report.write({written.header.parameters.dims, written.header.parameters.type,
                    settings_json(written.header.parameters), written.bytes_in, written.file_bytes,
                    achieved_json(written.index)});
    });
    report.keep();
    if (run.verbosity > 0 && !run.quiet)
      say(summary(result) + "\n" + memory_summary(result.memory, result.times_read) + "\n");
    remove_files(removed_after);
  }

  EncodeResult encode(const std::optional<RawDescription>& description, const std::string& path,
                      const BeforeNaming<EncodeResult>& before_naming) const {
    ProgressMeter meter(run.progress, run.quiet, "encoding", 1);
    const Progress update = [&](std::uint64_t done, std::uint64_t total) { meter.update(done, total); };
    if (resume || (ranks().count() > 1 && parts_are_possible(input, path)))
      return encode_in_parts(ranks(), input, description, path, output.overwrite, options,
                             {resume, "tagrid " TAGRID_VERSION, run.resources_of_each_rank()}, update,
                             before_naming);
    return encode_volume(input, description, path, output.overwrite, options, run.resources(), update,
                         before_naming);
  }

  // A run whose parts are kept; from now on a signal leaves them.
  void require_resumable(const std::string& path) const {
    if (!is_regular_output(path)) throw UsageError("--resume: the output must be a file; give -o FILE");
    // Whether it is there is for its reader to find.
    if (input == "-" || (status_of(input) && !attributes_of(input)))
      throw UsageError("--resume: the input must be a file, which can be read again");
    end_signals_with(exit_resumable,
                     run.quiet ? "" : "tagrid: interrupted; the same command goes on from here\n");
  }

  void warn_of_order(const RawDescription& description) const {
    const auto likelier = run.quiet ? std::nullopt : likelier_dims(input, description);
    if (!likelier) return;
    const Index3 &given = description.dims, &other = *likelier;
    warn(run,
         fmt::format("{}: looks far smoother with --dims {},{},{} than with {},{},{}; check their order, "
                     "x is the fastest",
                     input, other.x, other.y, other.z, given.x, given.y, given.z));
  }
};

void add_bounds(CLI::App& command, EncodeOptions& o) {
  const char* group = "What is kept";
  add_number_option(command, "--max-error", o.max_error,
                    "Largest error of any voxel; 0, the default: lossless")
      ->option_text("E")
      ->group(group);
  add_number_option(command, "--surface-error", o.surface_error, "Tighter bound where the grid is refined")
      ->option_text("F")
      ->group(group);
  command.add_flag("--grid-only", o.grid_only, "Store the adaptive grid alone; voxels are interpolated")
      ->group(group);
  command
      .add_option_function<std::string>(
          "--effort",
          [&o](const std::string& word) {
            const auto found = std::find(effort_names.begin(), effort_names.end(), word);
            o.effort = static_cast<Effort>(found - effort_names.begin());
          },
          "fast, default or best: time for size, of voxels of 8 and 16 bits")
      ->check(one_of({"fast", "default", "best"}))
      ->option_text("fast|default|best")
      ->group(group);
  add_number_option(command, "--mesh-error", o.mesh_error,
                    "Refine until the mesh is within E of every sample")
      ->option_text("E")
      ->group(group);
}

void add_grid_options(CLI::App& command, EncodeCommand& c) {
  const char* group = "The grid";
  EncodeOptions& o = c.options;
  add_number_option(command, "--accuracy", o.accuracy, "m: as good as a circle's m-gon (20)")
      ->option_text("m")
      ->group(group);
  add_number_option(command, "--cube", o.cube_size, "Edge of a root cube, a power of two, 4 .. 256 (32)")
      ->option_text("S")
      ->group(group);
  add_number_option(command, "--max-level", o.max_level, "Refine no further than this level")
      ->option_text("n")
      ->group(group);
  command
      .add_option("--range", c.range,
                  "Value range that counts as 8 voxels of height, or auto: that of the data")
      ->option_text("lo:hi|auto")
      ->group(group);
  add_number_option(command, "--field-scale", o.field_scale,
                    "Voxels of height per unit of value, instead of --range")
      ->option_text("lambda")
      ->group(group);
  add_number_option(command, "--brick", o.brick_edge, "Root cubes an edge of a brick; default max(2, 64/S)")
      ->option_text("N")
      ->group(group);
}

}  // namespace

Action add_encode_command(CLI::App& app) {
  auto state = std::make_shared<EncodeCommand>();
  CLI::App* command = app.add_subcommand("encode", "Encode a volume into a .tag file");
  command->add_option("INPUT", state->input, "NRRD file, headerless file, or - for the standard input")
      ->required();
  add_output_options(*command, state->output);
  add_bounds(*command, state->options);
  add_grid_options(*command, *state);
  add_raw_options(*command, state->raw);
  add_run_options(*command, state->run);
  add_json_option(*command, state->run);
  add_memory_option(*command, state->run);
  add_spool_option(*command, state->run);
  add_removal_options(*command, state->remove);
  command->add_flag("--resume", state->resume,
                    "Keep what is done in .NAME.parts, and go on with it after an interruption");
  return [state] { state->execute(); };
}

}  // namespace tagrid
