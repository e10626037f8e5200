#include "tools/options/shared_options.h"

#include <algorithm>
#include <filesystem>

#include "io/files/file_attributes.h"
#include "io/files/open_source.h"
#include "io/files/temporaries.h"
#include "io/http/address.h"
#include "io/system/this_process.h"
#include "io/text/addresses.h"
#include "io/text/paths.h"
#include "io/text/text.h"
#include "tools/report/process.h"

namespace tagrid {

CLI::Option* add_text_option(CLI::App& command, const std::string& names, std::string& value,
                             const std::string& value_name, const std::string& help) {
  CLI::Option* option = command.add_option(names, value, help)->option_text(value_name);
  // A name that is an address would be a directory called "http:".
  if (value_name == "FILE" || value_name == "DIR")
    option->check(CLI::Validator(
        [](const std::string& given) {
          if (is_unknown_address(given)) return about_unknown_address(given);
          return is_address(given)
                     ? shown_address(given) +
                           ": is an address, but only INPUT can be one; download it first, or give a "
                           "path on this machine"
                     : std::string();
        },
        ""));
  return option;
}

CLI::Validator one_of(const std::vector<std::string>& words) {
  return CLI::Validator(
      [words](const std::string& given) {
        if (std::ranges::find(words, given) != words.end()) return std::string();
        return fmt::format("{}: must be one of {}", given, fmt::join(words, ", "));
      },
      "");
}

int RunOptions::thread_count() const { return threads > 0 ? threads : available_threads(); }

namespace {
// From here on, an address has its name without secrets.
std::string declared(const std::string& text) { return is_address(text) ? declare_address(text) : text; }
}  // namespace

CLI::Option* add_tag_input(CLI::App& command, std::string& input, const std::string& help) {
  const auto set = [&input](const std::string& text) { input = declared(text); };
  return command.add_option_function<std::string>("INPUT", set, help);
}

void add_tag_inputs(CLI::App& command, std::vector<std::string>& inputs, const std::string& help) {
  const auto set = [&inputs](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) inputs.push_back(declared(text));
  };
  command.add_option_function<std::vector<std::string>>("INPUT", set, help)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->required();
}

void add_tag_input(CLI::App& command, std::string& input) {
  add_tag_input(command, input, ".tag file or its address, or - for standard input")->required();
}

void add_run_options(CLI::App& command, RunOptions& options) {
  add_number_option(command, "-T,--threads", options.threads, "N",
                    "Threads; 0, the default: all available processors")
      ->check([](const std::string& text) {
        const auto threads = whole_number<int>(text);
        const bool good = threads && *threads >= 0 && *threads <= most_threads;
        return good ? std::string()
                    : fmt::format("{} is not a whole number from 0 to {}", text, most_threads);
      });
  command.add_flag("-q,--quiet", options.quiet, "Print only errors");
  command.add_flag("-v,--verbose", options.verbosity, "Print more details; twice: even more");
  // In the order of ProgressStyle.
  const std::vector<std::string> styles = {"auto", "bar", "plain", "none"};
  const auto set = [&options, styles](const std::string& style) {
    options.progress = static_cast<ProgressStyle>(std::ranges::find(styles, style) - styles.begin());
  };
  command
      .add_option_function<std::string>(
          "--progress", set,
          "Show progress: auto (a bar, on terminals only), bar, plain (a line every 30 seconds) or none")
      ->check(one_of(styles))
      ->option_text("auto|bar|plain|none");
}

void RunOptions::obey_memory_limit() const {
  if (memory) give_back_freed_memory(*memory);
}

bool RunOptions::says_result() const { return is_verbose() || (!quiet && is_terminal(standard_error)); }

bool RunOptions::is_watched() const {
  return is_verbose() || shown_style(progress, quiet) != ProgressStyle::none;
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
  resources.besides = memory_of_declared_sources();
  if (!spool.empty()) resources.spool = spool;
  return resources;
}

void add_memory_option(CLI::App& command, RunOptions& options) {
  const auto set = [&options](const std::string& text) {
    options.memory = byte_count(text);
    if (!options.memory || *options.memory == 0)
      throw UsageError("-M: {}: must be a number of bytes above 0, such as 800M or 1.5G{}", text,
                       hint_of_decimal_comma(text, byte_count));
  };
  command
      .add_option_function<std::string>(
          "-M,--memory", set,
          "Never use more memory than SIZE bytes, such as 800M or 1.5G; K, M, G and T are powers of 1024")
      ->option_text("SIZE");
}

void add_json_option(CLI::App& command, RunOptions& options) {
  add_text_option(command, "--json", options.json, "FILE", "Write statistics of the run to FILE as JSON");
}

void add_job_options(CLI::App& command, RunOptions& options, bool with_spool) {
  add_run_options(command, options);
  add_json_option(command, options);
  add_memory_option(command, options);
  if (with_spool) add_text_option(command, "--spool", options.spool, "DIR", "Directory for temporary files");
}

void add_report_options(CLI::App& command, RunOptions& options, bool& overwrite) {
  add_job_options(command, options, true);
  command.add_flag("-f,--force", overwrite, "Overwrite files that exist");
}

void add_removal_options(CLI::App& command, bool& remove) {
  CLI::Option* keep = command.add_flag("-k,--keep")->description("Keep the input (default)");
  command.add_flag("--rm", remove, "Remove the input after the output is complete and verified")
      ->excludes(keep);
}

void add_trust_option(CLI::App& command, bool& trust) {
  command.add_flag("--trust-description", trust,
                   "Confirm --dims, --type and --endian, to remove headerless input after lossy encoding");
}

bool is_unknown_address(const std::string& text, const std::filesystem::path& folder) {
  std::error_code none;
  return has_scheme(text) && !is_address(text) &&
         !std::filesystem::exists(symlink_status(folder / path_of(text.substr(0, text.find('/'))), none));
}

std::string about_unknown_address(const std::string& text) {
  return shown_address(text) +
         ": there is no such directory, and addresses begin with http://, https:// or s3://; give the path "
         "of a file on this machine";
}

void refuse_address(const std::string& input, std::string_view advice) {
  if (is_unknown_address(input)) throw UsageError(about_unknown_address(input));
  if (is_address(input) && !is_declared_source(input))
    throw UsageError("{}: is an address; only .tag files are read from servers{}", shown_address(input),
                     advice);
}

namespace {

void refuse_terminal_input(const std::string& input) {
  if (input == "-" && is_terminal(standard_input))
    throw UsageError("standard input: is a terminal; give a file, or use a pipe");
}

}  // namespace

void require_volume_input(const std::string& input, std::string_view from_pipe) {
  refuse_address(input,
                 fmt::format(", and files of other formats from this machine; download it first. A "
                             "single file that tagrid reads itself, such as .nrrd or .nii.gz, can also "
                             "come from a pipe: curl URL | tagrid {}",
                             from_pipe));
  refuse_terminal_input(input);
}

void require_tag_input(const std::string& input) {
  refuse_address(input, ", and not to change them; download it first");
  refuse_terminal_input(input);
  if (input != "-" && is_folder(input))
    throw UsageError(input + ": is a directory, not a .tag file; encode it first");
}

void warn(const RunOptions& options, const std::string& message) {
  if (!options.quiet && !message.empty()) say_line("tagrid: warning: " + message);
}

void remove_abandoned(const RunOptions& options, const std::vector<std::string>& inputs,
                      std::vector<std::string> outputs) {
  const auto is_temporary = [](const std::string& path) {
    return target_of_temporary(name_of_path(path)).has_value();
  };
  if (std::ranges::any_of(inputs, is_temporary)) return;
  outputs.push_back(options.json);
  std::erase_if(outputs, [](const std::string& path) { return path.empty() || path == "-"; });
  const std::size_t removed = remove_abandoned_files(outputs);
  if (removed > 0 && options.is_watched())
    say("tagrid: removed {} that a killed run left beside the output",
        removed == 1 ? "a temporary file" : counted(removed, "temporary file"));
}

}  // namespace tagrid
