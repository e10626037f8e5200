// tagrid preview: writes a picture of the volume in a .tag file.

#include "io/files/open_source.h"
#include "io/text/paths.h"
#include "pipeline/preview/read_preview.h"

#include <filesystem>

#include "io/files/file_attributes.h"
#include "io/files/output_file.h"
#include "io/metadata/lengths.h"
#include "io/png/png_writer.h"
#include "tools/commands/commands.h"
#include "tools/options/output_options.h"
#include "tools/preview/sheet.h"
#include "tools/report/damage.h"
#include "tools/report/process.h"
#include "tools/report/report.h"
#include "tools/report/run_report.h"

namespace tagrid {
namespace {

struct PreviewCommand {
  std::string input;
  OutputOptions output;
  RunOptions run;
  std::vector<std::string> slices;
  std::string window;
  std::optional<std::int64_t> volume;

  void execute(Ranks& ranks) const {
    run.obey_memory_limit();
    const PreviewWishes wishes = wanted_slices();
    const std::optional<GreyWindow> wanted_window = window_option();
    if (output.path.empty() && volume)
      throw UsageError(
          "a volume needs -o FILE: without it, the output would have the name of the entire file");
    const std::string path = output.path.empty() ? output_beside(input, ".png") : output.path;
    require_tag_input(input);
    refuse_pipe();
    if (path != "-" && !path.ends_with(".png"))
      throw UsageError(path + ": a preview is written as PNG; its name must end in .png");
    refuse_terminal(ranks, path, "pictures");
    refuse_same_file(input, path);
    check_output(path, output.overwrite);
    remove_abandoned(run, {input}, {path});
    RunReport report(run.json, run.thread_count(), output.overwrite, "preview", input, path);

    const std::int64_t number = chosen_volume(input, volume, run);
    const auto all = std::make_shared<const TagBricks>(open_source(input));
    const std::shared_ptr<const TagBricks> volume_of_file = volume_in(all, number);
    const TagBricks& file = *volume_of_file;
    const PreviewContent content = read(ranks, file, wishes);
    const CodingParameters& parameters = file.parameters();
    const Rescale& rescale = file.header().metadata.rescale();
    const GreyWindow shown = wanted_window ? *wanted_window : window_of(content, parameters.type, rescale);
    const Image picture = sheet_of({.title = input == "-" ? "standard input" : name_of_path(input),
                                    .lines = lines_about(*all, number, file),
                                    .content = content,
                                    .type = parameters.type,
                                    .rescale = rescale,
                                    .window = shown,
                                    .lengths = lengths_of(file.header()),
                                    .cube_size = parameters.cube_size});
    OutputFile png(path, output.overwrite);
    write_png(picture.width(), picture.height(), picture.bytes(), png);
    report.write(figures_with(content, shown, file, all->sizes().file, png.position()), png);
    if (const std::string doubt = doubt_of_range(file.header(), file.index().total); !doubt.empty())
      warn(run, "{}: {}", shown_input(input), doubt);
    if (run.is_verbose()) {
      say("{} of {} bricks were read", content.bricks, file.count());
      say_line(memory_summary(content.memory));
    }
  }

  void refuse_pipe() const {
    // Opening a file that is missing, or a directory, gives a better message.
    const bool is_pipe =
        input == "-" ? !is_regular_input(input) : !is_regular_output(input) && !is_folder(input);
    if (is_pipe)
      throw UsageError(shown_input(input) + ": a preview needs a file, not a pipe; save it to one first");
  }

  PreviewContent read(const Ranks& ranks, const TagBricks& file, const PreviewWishes& wishes) const {
    ProgressMeter meter(run.progress, run.quiet, "reading", 1);
    return read_preview(file, wishes, run.resources(ranks), memory_of_sheet(), meter.progress());
  }

  static RunFigures figures_with(const PreviewContent& content, const GreyWindow& shown,
                                 const TagBricks& file, std::uint64_t bytes_in, std::uint64_t bytes_out) {
    RunFigures figures = figures_of(file.header(), file.index(), bytes_in, bytes_out);
    for (const PreviewSlice& slice : content.slices)
      figures.settings["slices"][std::string(1, "xyz"[slice.panel.axis])] = slice.panel.slice;
    figures.settings["window"] = {shown.low, shown.high};
    figures.settings["bricks"] = content.bricks;
    return figures;
  }

  PreviewWishes wanted_slices() const {
    PreviewWishes wishes;
    for (const std::string& text : slices) {
      const std::size_t axis = std::string_view("xyz").find(text.substr(0, 1));
      const auto slice = text.size() > 2 && text[1] == '='
                             ? whole_number<std::int64_t>(std::string_view(text).substr(2))
                             : std::nullopt;
      if (axis >= 3 || !slice)
        throw UsageError("--slice {}: must be x=, y= or z= and a whole number, such as z=20", text);
      wishes.slices[axis] = *slice;
    }
    return wishes;
  }

  std::optional<GreyWindow> window_option() const {
    if (window.empty()) return std::nullopt;
    const auto range = value_range(window);
    if (!range || range->first >= range->second)
      throw UsageError("--window {}: must be lo:hi with lo < hi{}", window,
                       hint_of_decimal_comma(window, [](auto given) { return value_range(given); }));
    return GreyWindow{range->first, range->second};
  }
};

}  // namespace

Action add_preview_command(CLI::App& app) {
  auto state = std::make_shared<PreviewCommand>();
  CLI::App* command = app.add_subcommand("preview", "Write a PNG of three slices and the levels of the grid");
  add_tag_input(*command, state->input, ".tag file or its address, not a pipe")->required();
  add_output_options(*command, state->output);
  command
      ->add_option("--slice", state->slices,
                   "Slice across an axis, one per axis (default: in or near the middle)")
      ->option_text("x=N|y=N|z=N")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->expected(1)
      ->allow_extra_args(false);
  add_volume_option(*command, state->volume);
  add_text_option(*command, "--window", state->window, "lo:hi",
                  "Values shown as black and as white (default: all but the lowest and highest 0.5 %)");
  add_job_options(*command, state->run, false);
  return [state](Ranks& ranks) { with_repair_advice(state->input, [&] { state->execute(ranks); }); };
}

}  // namespace tagrid
