#include "tools/report/failure.h"

#include <fmt/format.h>

#include <exception>
#include <filesystem>
#include <system_error>

#include "io/files/held_files.h"
#include "io/text/numbered_names.h"
#include "io/text/paths.h"
#include "pipeline/memory/resources.h"

namespace tagrid {
namespace {

std::string memory_advice(const MemoryNeeds& needs) {
  const auto limit = [](std::uint64_t bytes) { return fmt::format("-M {}M", (bytes + (1 << 20) - 1) >> 20); };
  std::string advice = "; give " + limit(needs.needed);
  if (needs.with_spool)
    advice += ", or --spool DIR, a directory for the samples, and " + limit(*needs.with_spool);
  if (const auto& brick = needs.smaller_brick)
    advice += fmt::format(", or smaller bricks: --brick {}{}", brick->edge,
                          brick->needed > needs.allowed ? " and " + limit(brick->needed) : "");
  return advice;
}

/// `name`: that of the file, if it is known. `message`: says how it is compressed.
std::string advice_on_compressed(const std::string& name, std::string_view message) {
  const char* program = "zcat";
  for (const auto& [kind, other] : {std::pair("(zstd)", "zstdcat"), {"(xz)", "xzcat"}, {"(bzip2)", "bzcat"}})
    if (message.ends_with(kind)) program = other;
  // A shell takes other characters for something else.
  const bool is_plain = !name.empty() && name.find_first_not_of(
                                             "abcdefghijklmnopqrstuvwxyz"
                                             "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                             "0123456789._/+-") == name.npos;
  const std::filesystem::path inner = path_of(name).filename().stem();
  if (inner.extension() == ".tar" || path_of(name).extension() == ".tgz")
    return "; unpack it first, for example with tar xf";
  const std::string stem = is_plain ? text_of(inner.stem()) : "NAME";
  const std::string output = fmt::format("{} {}", program, is_plain ? name : "FILE");
  return fmt::format(
      ": `{} | tagrid encode - -o {}.tag`, with --dims and --type if the samples have no header (to compare: "
      "`| tagrid verify NAME.tag --against -`)",
      output, stem);
}

// Advice that follows the message of the error.
std::string advice_on(const std::string& message, const ErrorDetail& detail) {
  switch (detail.problem) {
    case Problem::none:
    case Problem::cancelled:
    case Problem::newer_format:
      return "";
    case Problem::unknown_beginning:
      return "; if it is a volume, encode it first";
    case Problem::output_exists:
      return "; give -f to overwrite it";
    case Problem::memory_limit:
      return memory_advice(detail.memory.value_or(MemoryNeeds()));
    case Problem::writer_memory:
      return fmt::format(
          "{}, which is safe with less memory if most voxels are background, or choose another format, such "
          "as .nrrd",
          memory_advice({.needed = detail.memory.value_or(MemoryNeeds()).needed}));
    case Problem::volumes_below:
      return fmt::format("; tagrid convert --find {} lists the volumes in it", detail.subject);
    case Problem::no_known_format:
      return "; if it holds samples without a header, describe them with --dims and --type";
    case Problem::compressed_file:
      return advice_on_compressed(detail.subject, message);
    case Problem::not_openvdb:
      return "; leave out --vdb-grid";
    case Problem::describes_itself:
      return "; leave out --dims and the other options that describe samples";
    case Problem::endian_differs:
      return "; leave out --endian";
    case Problem::mesh_fills_no_space:
      return "; give --padded for a mesh of complete root cubes";
    case Problem::no_source_files:
      return "; use tagrid decode FILE.tag -o FILE.nrrd to get the volume and its metadata";
    case Problem::slices_missing:
      return "; give --gaps-ok if that is intended";
    case Problem::data_outside:
      return "; if you trust the header, add --data-outside, or move the file into its directory";
    case Problem::program_memory:
      return fmt::format("; a larger -M raises its limit, up to -M {}M", limit_for_most_first_memory() >> 20);
  }
  return "";
}

bool is_held_by_another(const std::exception_ptr& exception) {
  try {
    std::rethrow_exception(exception);
  } catch (const HeldByAnother&) {
    return true;
  } catch (...) {
    return false;
  }
}

std::string words_of(const std::string& message, const ErrorDetail& detail) {
  return detail.with_options.value_or(message) + advice_on(message, detail);
}

}  // namespace

std::string words_of(const Error& error) { return words_of(error.what(), error.detail()); }

Failure current_failure(const std::string& memory_advice) {
  const SortedError error = sorted_error(std::current_exception());
  const std::string message = words_of(error.message, error.detail);
  switch (error.kind) {
    case ErrorKind::usage: {
      std::vector<std::string> list;
      for (const Choice& choice : error.detail.choices)
        list.push_back(fmt::format("{}  {}  {}", list.size() + 1, choice.name, choice.text));
      // Volumes without names are alike, and there may be thousands: the message says their number.
      if (!list.empty() && error.detail.choices.back().name == std::to_string(list.size())) list.clear();
      // One format was looked for, but there may be volumes of others.
      std::error_code unknown;
      if (!list.empty() && std::filesystem::is_directory(path_of(error.detail.subject), unknown)) {
        std::vector<std::string> names;
        for (const Choice& choice : error.detail.choices) names.push_back(choice.name);
        if (std::string doubt = doubt_of_patterns(names); !doubt.empty()) list.push_back(std::move(doubt));
        list.push_back("`tagrid convert --find` lists all volumes in the directory");
      }
      return {exit_usage, message, std::move(list)};
    }
    case ErrorKind::broken_input:
      return {exit_broken_input, message};
    case ErrorKind::closed_pipe:
      return {exit_world, ""};
    case ErrorKind::world:
      return {is_held_by_another(std::current_exception()) ? exit_resumable : exit_world, message};
    case ErrorKind::memory:
      return {exit_world, "out of memory" + (memory_advice.empty() ? "" : "; " + memory_advice)};
    case ErrorKind::bug:
      break;
  }
  return {exit_bug, fmt::format("this is a bug: {}; please report it", error.message)};
}

}  // namespace tagrid
