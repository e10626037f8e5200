#include "tools/archive/conversion.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "io/errors/errors.h"
#include "io/files/output_file.h"
#include "io/system/files.h"
#include "io/system/this_process.h"
#include "io/text/text.h"
#include "pipeline/parts/work_orders.h"
#include "pipeline/ranks/messages.h"
#include "tools/archive/encoding_pass.h"
#include "tools/archive/key_file.h"
#include "tools/archive/records.h"
#include "tools/archive/removal_pass.h"
#include "tools/report/failure.h"
#include "tools/report/process.h"
#include "tools/report/report.h"

namespace tagrid {

TAGRID_MEMBERS(ManifestLine, number, name, input, is_relative, output, mark, options)
TAGRID_MEMBERS(RunOptions, threads, quiet, verbosity, progress, json, memory, spool)
TAGRID_MEMBERS(ConversionOptions, output_dir, keys, overwrite, skip_done, trust_description, run)

namespace {

using nlohmann::ordered_json;

/// The record of a line, created when its work begins. From then on it has all keys; unknown values are null.
class LineRecord {
 public:
  /// `folder`: that of the outputs. `sequence`: see KnownOutputs::next_sequence().
  LineRecord(const ManifestLine& line, const std::string& folder, std::uint64_t sequence)
      : json({{"input", text_of_name(name_in_records(line.input, base_of_records(folder, line)))},
              {"output", text_of_name(line.output)},
              {"status", "failed"},
              {"error", nullptr},
              {"code", exit_ok},
              {"version", TAGRID_VERSION},
              {"options", json_of(line.options)}}) {
    for (const char* key : output_keys) json[key] = nullptr;
    json["compared"] = false;
    json["warnings"] = ordered_json::array();
    json["sequence"] = sequence;
    json["seconds"] = json["finished"] = nullptr;
  }

  /// Records that the exception being handled ended the work, on this machine if it has to be named.
  void fail(const std::string& machine = {}) {
    const Failure failure =
        current_failure("fewer threads (-T), a limit (-M SIZE) or a smaller --brick need less");
    error = machine.empty() ? failure.message : fmt::format("on {}: {}", machine, failure.message);
    json["error"] = error;
    json["code"] = failure.code;
  }

  /// The line of the record, as it is now.
  std::string text() {
    json["seconds"] = std::chrono::duration<double>(Clock::now() - begin_).count();
    json["finished"] = seconds_since_1970();
    return written_json(json);
  }

  ordered_json json;  ///< The results for the line are added here.
  std::string error;  ///< the message in its original bytes; "" if nothing failed

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point begin_ = Clock::now();
};

/// The bytes of the samples of a volume, as far as its record describes them.
std::uint64_t sample_bytes_in(const ordered_json& record) {
  const ordered_json &dims = record.at("dims"), &type = record.at("type");
  if (dims.is_null() || type.is_null()) return 0;
  const Index3 size{dims.at(0).get<std::int64_t>(), dims.at(1).get<std::int64_t>(),
                    dims.at(2).get<std::int64_t>()};
  const auto known = sample_type_named(type.get<std::string>());
  return known ? sample_bytes(size, *known).value_or(0) : 0;
}

/// Collects the results of all lines, in one process.
struct ConversionAccount {
  const RunOptions& run;
  LineFile& results;
  ListMeter& meter;
  KeyFile* keys = nullptr;  ///< null: the archive has names
  ConversionSums sums = {};
  std::set<std::string> reasons = {};  ///< of failures, without names of volumes, that were told

  /// A record as the archive has it: without names if there is a key file, which then has the rest.
  std::string in_archive(const std::string& record) const {
    return keys ? written_json(keys->sealed(ordered_json::parse(record))) : record;
  }

  /// Counts a line by its last record, and reports its result.
  void settle(const ManifestLine& line, const std::string& record, const std::string& error) {
    const ordered_json json = ordered_json::parse(record);
    const auto status = json.at("status").get<std::string>();
    ++sums.files;
    ++(status == "ok"        ? sums.ok
       : status == "skipped" ? sums.skipped
       : status == "removed" ? sums.removed
                             : sums.failed);
    if (json.at("compared").get<bool>()) ++sums.compared;
    meter.end_volume(status == "ok" || status == "removed" ? sample_bytes_in(json) : 0);
    for (const ordered_json& warning : json.at("warnings"))
      warn(run, name_of_text(warning.get<std::string>()));
    if (status == "ok" || status == "removed") {
      sums.bytes_in += json.at("bytes_in").get<std::uint64_t>();
      sums.bytes_out += json.at("bytes_out").get<std::uint64_t>();
    }
    if ((status == "ok" || status == "skipped") && json.value("restorable", ordered_json()) == false) {
      ++sums.not_restorable;
      const ordered_json why = json.value("why_not_restorable", ordered_json());
      if (run.is_verbose())
        say("{}: cannot be restored byte for byte: {}", line.input,
            why.is_string() ? why.get<std::string>() : "an earlier run did not record why");
    }
    const bool bad = json.at("code").get<int>() != exit_ok;
    if (bad) tell_of_failure(line, error);
    if (!bad && run.is_verbose()) say_line(line.input + ": " + status);
  }

  /// A wrong option of the command fails for all lines: the reason is told once, if it is long.
  void tell_of_failure(const ManifestLine& line, const std::string& error) {
    constexpr std::size_t short_reason = 80;
    std::string reason = error;
    for (const std::string& name : {line.input, line.output})
      for (std::size_t at; (at = reason.find(name)) != reason.npos;) reason.erase(at, name.size());
    // "out of memory" names no file, but a list has many volumes.
    const bool is_named = reason.size() < error.size();
    if (reason.size() > short_reason && !reasons.insert(reason).second)
      say_line("tagrid: " + line.input + ": fails for the same reason");
    else
      say_line("tagrid: " + (is_named ? "" : line.input + ": ") + error);
  }
};

/// The data that the other ranks need.
struct ConversionOrder {
  std::vector<ManifestLine> lines;
  ConversionOptions options;
};
TAGRID_MEMBERS(ConversionOrder, lines, options)

/// The result of a line that one of them processed.
struct DoneLine {
  std::uint64_t index = 0;
  std::string record, error;
};
TAGRID_MEMBERS(DoneLine, index, record, error)

/// Collective. Throws WorldError if a rank on another machine sees another directory of this name, or none.
void require_shared_folder(Ranks& ranks, const std::string& folder) {
  if (ranks.machine().empty()) return;
  std::unique_ptr<OutputFile> seen;  // no other directory has its temporary name
  std::string name;
  all_do(ranks, [&] {
    if (ranks.rank() > 0) return;
    seen = std::make_unique<OutputFile>(folder + "/seen-by-all", true);
    name = seen->temporary();
  });
  Bytes bytes = packed_order(name);
  ranks.broadcast(bytes);
  all_do(ranks, [&] {
    if (!status_of(unpacked_order<std::string>(bytes)))
      throw WorldError(folder +
                       ": is not the same directory on this machine; all ranks must see the directory of the "
                       "outputs under the same name");
  });
}

/// The key file, which exists; nothing if there is none.
std::unique_ptr<KeyFile> key_file_of(const ConversionOptions& options) {
  return options.keys.empty() ? nullptr : std::make_unique<KeyFile>(options.keys);
}

/// Volumes without a record after such a line count as not done, and their originals are kept.
void warn_of_unreadable(const RunOptions& run, const KnownOutputs& known) {
  constexpr std::size_t most = 20;
  const std::vector<std::string>& lines = known.unreadable();
  for (std::size_t i = 0; i < std::min(lines.size(), most); ++i)
    warn(run, lines[i] + "; volumes without a later record count as not done");
  if (lines.size() > most) warn(run, "{} more lines are not records", lines.size() - most);
}

/// Collective. `account` is that of rank 0; for other ranks it is null. `meter` shows the lines of this rank.
void share_lines(Ranks& ranks, const ConversionOrder& order, ListMeter& meter, ConversionAccount* account) {
  require_shared_folder(ranks, order.options.output_dir);
  std::unique_ptr<KeyFile> keys;
  std::unique_ptr<KnownOutputs> known;
  // Every rank reads the records before any rank writes to them.
  all_do(ranks, [&] {
    keys = key_file_of(order.options);
    known = std::make_unique<KnownOutputs>(order.options.output_dir, keys.get());
    known->require_these_keys();
  });
  if (account != nullptr) {
    account->keys = keys.get();
    warn_of_unreadable(order.options.run, *known);
  }
  SharedWork shared;
  LateSyncs syncs(account != nullptr ? &account->results : nullptr);
  const EncodingPass pass{order.options, order.options.run.resources(ranks), *known, shared.stop, meter,
                          syncs};
  shared.count = static_cast<std::int64_t>(order.lines.size());
  shared.work = [&](std::int64_t index) {
    const ManifestLine& line = order.lines[static_cast<std::size_t>(index)];
    LineRecord record(line, order.options.output_dir, known->next_sequence(line.output));
    meter.begin_volume(line.name);
    if (keys) {
      // Another run may have begun with another key file: nothing more is written.
      known->read_more();
      known->require_these_keys();
    }
    try {
      if (!keys) known->read_more();  // other runs may be at the same outputs
      record.json["sequence"] = known->next_sequence(line.output);
      encode_line(pass, line, record.json);
    } catch (const std::exception&) {
      record.fail(ranks.machine());
    }
    shared.account = packed_order(DoneLine{static_cast<std::uint64_t>(index), record.text(), record.error});
  };
  shared.take = [&](const Bytes& bytes) {
    const auto done = unpacked_order<DoneLine>(bytes);
    syncs.append(account->in_archive(done.record));
    syncs.sync_if_due();
    account->settle(order.lines.at(done.index), done.record, done.error);
  };
  share_out(ranks, shared);
  all_do(ranks, [&] { syncs.sync(); });
}

}  // namespace

std::vector<ManifestLine> lines_of(Shard shard, const std::vector<ManifestLine>& lines) {
  std::vector<ManifestLine> part;
  for (std::size_t i = shard.index; i < lines.size(); i += shard.count) part.push_back(lines[i]);
  return part;
}

ConversionSums encode_lines(Ranks& ranks, const std::vector<ManifestLine>& lines,
                            const ConversionOptions& options, LineFile& results) {
  const ConversionOrder order{lines, options};
  send_order(ranks, packed_order(order));
  ListMeter meter(options.run.progress, options.run.quiet, lines.size());
  ConversionAccount account{options.run, results, meter};
  share_lines(ranks, order, meter, &account);
  return account.sums;
}

void obey_conversion(Ranks& ranks, const Bytes& bytes) {
  auto order = unpacked_order<ConversionOrder>(bytes);
  if (order.options.run.memory) give_back_freed_memory(*order.options.run.memory);
  order.options.run.progress = ProgressStyle::none;
  ListMeter meter(ProgressStyle::none, true, order.lines.size());
  try {
    share_lines(ranks, order, meter, nullptr);
  } catch (const std::exception&) {
    // Rank 0 receives the failure, too.
  }
}

ConversionSums remove_originals(const Ranks& ranks, const std::vector<ManifestLine>& lines,
                                const std::vector<ManifestLine>& all, const ConversionOptions& options,
                                LineFile& results) {
  const std::unique_ptr<KeyFile> keys = key_file_of(options);
  KnownOutputs known(options.output_dir, keys.get());
  known.require_these_keys();
  warn_of_unreadable(options.run, known);
  ListMeter meter(options.run.progress, options.run.quiet, lines.size());
  RemovalPass pass(all, options, options.run.resources(ranks), known, meter);
  ConversionAccount account{options.run, results, meter, keys.get()};
  for (const ManifestLine& line : lines) {
    known.read_more();  // other runs may be at the same outputs
    LineRecord record(line, options.output_dir, known.next_sequence(line.output));
    meter.begin_volume(line.name);
    std::string text;
    const auto append = [&] { results.append(account.in_archive(text = record.text())); };
    try {
      pass.remove_original(line, record.json, append);
    } catch (const std::exception&) {
      if (record.json["status"] == "removed") record.json["status"] = "kept";
      record.fail();
      append();
    }
    account.settle(line, text, record.error);
  }
  return account.sums;
}

}  // namespace tagrid
