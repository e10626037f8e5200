#include "tools/conversion.h"

#include <fmt/format.h>

#include <chrono>

#include "tools/conversion_records.h"
#include "tools/encoding_pass.h"
#include "tools/exit_codes.h"
#include "tools/failure.h"
#include "tools/input_removal.h"
#include "tools/process.h"
#include "tools/removal_pass.h"

namespace tagrid {
namespace {

using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

ordered_json begun_record(const ManifestLine& line) {
  return {{"input", json_text(line.input)},
          {"output", json_text(line.output)},
          {"status", "failed"},
          {"error", nullptr},
          {"code", exit_ok},
          {"version", TAGRID_VERSION},
          {"options", line.options}};
}

/// The exception that is being handled.
void set_failure(ordered_json& record) {
  const Failure failure = current_failure();
  record["error"] = failure.message;
  record["code"] = failure.code;
}

void count(const ordered_json& record, ConversionSums& sums) {
  const auto status = record.at("status").get<std::string>();
  ++sums.files;
  ++(status == "ok"        ? sums.ok
     : status == "skipped" ? sums.skipped
     : status == "removed" ? sums.removed
                           : sums.failed);
  if (status != "ok" && status != "removed") return;
  sums.bytes_in += record.at("bytes_in").get<std::uint64_t>();
  sums.bytes_out += record.at("bytes_out").get<std::uint64_t>();
}

void tell(const RunOptions& run, const ManifestLine& line, const ordered_json& record) {
  const auto status = record.at("status").get<std::string>();
  const bool bad = record.at("code").get<int>() != 0;
  if (bad) say(fmt::format("tagrid: {}\n", record.at("error").get<std::string>()));
  if (!bad && run.verbosity > 0 && !run.quiet) say(fmt::format("{}: {}\n", line.input, status));
}

}  // namespace

NextLine lines_of(Shard shard, std::size_t lines) {
  return [shard, lines, next = shard.index]() mutable -> std::optional<std::size_t> {
    if (next >= lines) return std::nullopt;
    const std::size_t index = next;
    next += shard.count;
    return index;
  };
}

ConversionSums convert_lines(const std::vector<ManifestLine>& lines, const NextLine& next,
                             const ConversionOptions& options, LineFile& results) {
  const KnownOutputs known(options.output_dir);
  const EncodingPass encoding(options, known);
  std::optional<RemovalPass> removal;
  if (options.remove_verified) removal.emplace(lines, options, known);
  ConversionSums sums;
  while (const auto index = next()) {
    const ManifestLine& line = lines.at(*index);
    ordered_json record = begun_record(line);
    std::vector<std::string> originals;
    const auto append = [&, begin = Clock::now()] {
      record["seconds"] = std::chrono::duration<double>(Clock::now() - begin).count();
      record["finished"] = seconds_since_1970();
      results.append(record.dump(-1, ' ', false, ordered_json::error_handler_t::replace));
    };
    try {
      if (removal)
        originals = removal->verified(line, record);
      else
        encoding.run(line, record);
    } catch (const std::exception&) {
      set_failure(record);
    }
    append();
    // Recorded first: a run that is killed in between finds the original there, and verifies once more.
    try {
      remove_files(originals);
    } catch (const std::exception&) {
      record["status"] = "kept";
      set_failure(record);
      append();
    }
    count(record, sums);
    tell(options.run, line, record);
  }
  return sums;
}

}  // namespace tagrid
