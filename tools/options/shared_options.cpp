#include "tools/options/shared_options.h"
#include "tools/report/process.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "io/errors/errors.h"
#include "io/files/abandoned_files.h"
#include "io/files/file_attributes.h"
#include "io/files/temporaries.h"
#include "tools/options/raw_rows.h"

namespace tagrid {

namespace {

ProgressStyle progress_style(const std::string& word) {
  if (word == "bar") return ProgressStyle::bar;
  if (word == "plain") return ProgressStyle::plain;
  return word == "none" ? ProgressStyle::none : ProgressStyle::automatic;
}

}  // namespace

CLI::Validator one_of(const std::vector<std::string>& words) {
  return CLI::Validator(
      [words](const std::string& given) {
        if (std::find(words.begin(), words.end(), given) != words.end()) return std::string();
        return fmt::format("{}: must be one of {}", given, fmt::join(words, ", "));
      },
      "");
}

int RunOptions::thread_count() const { return threads > 0 ? threads : available_threads(); }

void add_run_options(CLI::App& command, RunOptions& options) {
  add_number_option(command, "-T,--threads", options.threads,
                    "Threads to use; 0, the default, means all processors available to the process")
      ->option_text("N")
      ->check([](const std::string& text) {
        const auto threads = whole_number<int>(text);
        const bool good = threads && *threads >= 0 && *threads <= most_threads;
        return good ? std::string()
                    : fmt::format("{} is not a whole number from 0 to {}", text, most_threads);
      });
  command.add_flag("-q,--quiet", options.quiet, "Print only errors");
  command.add_flag("-v,--verbose", options.verbosity, "Print more details");
  command
      .add_option_function<std::string>(
          "--progress", [&options](const std::string& style) { options.progress = progress_style(style); },
          "How to show progress: auto (a bar on a terminal, nothing elsewhere), bar, plain (a line per "
          "minute) or none")
      ->check(one_of({"auto", "bar", "plain", "none"}))
      ->option_text("auto|bar|plain|none");
}

void RunOptions::obey_memory_limit() const {
  if (memory) give_back_freed_memory(*memory);
}

bool RunOptions::is_watched() const {
  return !quiet && (verbosity > 0 || shown_style(progress, quiet) != ProgressStyle::none);
}

SourceDescription RunOptions::limited(SourceDescription source) const {
  source.reader_memory = first_memory_of_programs(memory);
  return source;
}

Resources RunOptions::resources(const Ranks& ranks) const {
  Resources resources = resources_of_each_rank();
  resources.threads = thread_count();
  resources.processes = ranks.on_this_machine();
  return resources;
}

Resources RunOptions::resources_of_each_rank() const {
  Resources resources(threads);
  resources.memory = memory;
  resources.spool = spool;
  return resources;
}

void add_memory_option(CLI::App& command, RunOptions& options) {
  command
      .add_option_function<std::string>(
          "-M,--memory",
          [&options](const std::string& text) {
            options.memory = byte_count(text);
            if (!options.memory || *options.memory == 0)
              throw UsageError(
                  fmt::format("-M: {}: must be a number of bytes above 0, such as 800M or 1.5G", text));
          },
          "Never use more memory than SIZE bytes, such as 800M or 1.5G; K, M, G and T are powers of 1024")
      ->option_text("SIZE");
}

void add_spool_option(CLI::App& command, RunOptions& options) {
  command
      .add_option(
          "--spool", options.spool,
          "Directory for temporary files: samples of a pipe whose slices exceed the memory limit, or output "
          "of another program for a pipe")
      ->option_text("DIR");
}

void add_json_option(CLI::App& command, RunOptions& options) {
  command.add_option("--json", options.json, "Write statistics of the run to FILE as JSON")
      ->option_text("FILE");
}

void add_report_options(CLI::App& command, RunOptions& options, bool& overwrite) {
  add_run_options(command, options);
  add_json_option(command, options);
  add_memory_option(command, options);
  add_spool_option(command, options);
  command.add_flag("-f,--force", overwrite, "Overwrite the file of --json if it exists");
}

void add_removal_options(CLI::App& command, bool& remove) {
  CLI::Option* keep = command.add_flag("-k,--keep")->description("Keep the input (default)");
  command.add_flag("--rm", remove, "Remove the input after the output is complete and verified")
      ->excludes(keep);
}

void add_trust_option(CLI::App& command, bool& trust) {
  command.add_flag(
      "--trust-description", trust,
      "Confirm --dims, --type and --endian, so that headerless input may be removed after lossy encoding");
}

void add_output_options(CLI::App& command, OutputOptions& options) {
  command.add_option("-o,--output", options.path, "Output file, or - for standard output")
      ->option_text("FILE");
  command.add_flag("-f,--force", options.overwrite, "Overwrite the output if it exists");
}

void add_format_option(CLI::App& command, std::string& format) {
  std::vector<std::string> help;
  for (const Format* written : written_formats())
    help.push_back(fmt::format("{} ({})", written->name, written->help));
  command
      .add_option(
          "--format", format,
          fmt::format("Format of the output (default: from its extension):\n{}", fmt::join(help, "\n")))
      ->check([](const std::string& given) {
        // A program that somebody added is not in the list.
        try {
          format_named(given);
          return std::string();
        } catch (const UsageError& error) {
          return std::string(error.what());
        }
      })
      ->option_text("FORMAT");
}

const Format& volume_format_option(const std::string& format, const std::string& output) {
  // A device or a named pipe is treated like standard output.
  const bool is_file = output != "-" && is_regular_output(output);
  if (format.empty()) return is_file ? format_from_name(output) : format_named("raw");
  const Format& asked = format_named(format);
  const Format* named = format_with_extension(output);
  if (is_file && named != nullptr && named != &asked)
    throw UsageError(fmt::format(
        "--format {}: the extension of {} is that of another format; leave out --format, or name the output "
        "{}",
        format, output, std::filesystem::path(output).replace_extension(asked.extensions.front()).string()));
  return asked;
}

SampleType sample_type_option(const std::string& name) {
  if (const auto type = sample_type_named(name)) return *type;
  throw UsageError(
      fmt::format("--type {}: must be uint8, int8, uint16, int16, uint32, int32, float32 or float64", name));
}

CLI::Option* add_dims_option(CLI::App& command, std::string& dims) {
  const auto& row = raw_rows().front();
  return command.add_option("--" + row.name, dims, row.help)->option_text(row.value);
}

Index3 dims_option(const std::string& dims) {
  const auto sizes = three_sizes(dims);
  if (!sizes)
    throw UsageError(fmt::format("--dims {}: must be three whole numbers from 1 to 2^31: X,Y,Z", dims));
  return *sizes;
}

std::optional<RawDescription> RawOptions::description() const {
  const bool nothing = dims.empty() && type.empty() && endian.empty() && spacing.empty() && offset.empty();
  if (nothing) return std::nullopt;
  if (dims.empty() || type.empty()) {
    std::vector<std::string> given;
    for (const auto& [name, value] : {std::pair("--dims", &dims),
                                      {"--type", &type},
                                      {"--endian", &endian},
                                      {"--spacing", &spacing},
                                      {"--offset", &offset}})
      if (!value->empty()) given.emplace_back(name);
    const std::string options = fmt::format("{}", fmt::join(given, ", "));
    throw UsageError(
        fmt::format("{}: headerless input needs both --dims and --type; a file of any other format describes "
                    "its samples itself: leave out {}",
                    options, options));
  }
  RawDescription raw;
  raw.dims = dims_option(dims);
  raw.type = sample_type_option(type);
  if (!endian.empty()) raw.big_endian = endian == "big";
  if (!offset.empty()) {
    const auto bytes = byte_count(offset);
    if (!bytes || offset.find('.') != offset.npos)
      throw UsageError(
          fmt::format("--offset: {}: must be a whole number of bytes, optionally with K, M, G or T", offset));
    raw.offset = *bytes;
  }
  if (!spacing.empty()) {
    raw.spacing = three_distances(spacing);
    if (!raw.spacing)
      throw UsageError(fmt::format("--spacing {}: must be three positive numbers: X,Y,Z", spacing));
  }
  return raw;
}

void refuse_terminal(const Ranks& ranks, const std::string& output, const char* what) {
  if (output != "-" || !isatty(STDOUT_FILENO)) return;
  if (ranks.count() > 1)
    throw UsageError("standard output: is a terminal under mpirun, which changes bytes; give -o FILE");
  throw UsageError(
      fmt::format("standard output: {} are not written to a terminal; give -o FILE, or use a pipe", what));
}

void refuse_terminal_input(const std::string& input) {
  if (input == "-" && isatty(STDIN_FILENO))
    throw UsageError("standard input: is a terminal; give a file, or use a pipe");
}

void refuse_folder(const std::string& input) {
  if (input != "-" && is_folder(input))
    throw UsageError(input + ": is a folder, not a .tag file; encode it first");
}

void warn(const RunOptions& options, const std::string& message) {
  if (!options.quiet) say_line("tagrid: warning: " + message);
}

void remove_abandoned(const RunOptions& options, const std::vector<std::string>& inputs,
                      std::vector<std::string> outputs) {
  const auto is_temporary = [](const std::string& path) {
    return target_of_temporary(std::filesystem::path(path).filename().string()).has_value();
  };
  if (std::ranges::any_of(inputs, is_temporary)) return;
  outputs.push_back(options.json);
  std::erase_if(outputs, [](const std::string& path) { return path.empty() || path == "-"; });
  const std::size_t removed = remove_abandoned_files(outputs);
  if (removed > 0 && options.is_watched())
    say_line(fmt::format("tagrid: removed {} that a killed run left beside the output",
                         removed == 1 ? "a temporary file" : fmt::format("{} temporary files", removed)));
}

std::string output_beside(const std::string& input, const std::string& ending) {
  if (input == "-") return "-";
  return std::filesystem::path(input).replace_extension(ending).string();
}

}  // namespace tagrid
