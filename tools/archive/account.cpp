#include "tools/archive/account.h"

#include <fmt/format.h>

#include "io/text/printable.h"
#include "tools/archive/records.h"
#include "tools/report/exit_codes.h"
#include "tools/report/failure.h"
#include "tools/report/process.h"
#include "tools/report/report.h"

namespace tagrid {

using nlohmann::ordered_json;

LineRecord::LineRecord(const ManifestLine& line, std::uint64_t sequence)
    : json_({{"input", text_of_name(line.input)},
             {"output", text_of_name(line.output)},
             {"status", "failed"},
             {"error", nullptr},
             {"code", exit_ok},
             {"version", TAGRID_VERSION},
             {"options", json_of(line.options)}}) {
  for (const char* key : output_keys) json_[key] = nullptr;
  json_["sequence"] = sequence;
  json_["seconds"] = json_["finished"] = nullptr;
}

void LineRecord::fail(const std::string& machine) {
  const Failure failure =
      current_failure("fewer threads (-T), a limit (-M SIZE) or a smaller --brick need less");
  error_ = machine.empty() ? failure.message : fmt::format("on {}: {}", machine, failure.message);
  json_["error"] = error_;
  json_["code"] = failure.code;
}

std::string LineRecord::text() {
  json_["seconds"] = std::chrono::duration<double>(Clock::now() - begin_).count();
  json_["finished"] = seconds_since_1970();
  return json_.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

void ConversionAccount::settle(const ManifestLine& line, const std::string& record,
                               const std::string& error) {
  const ordered_json json = ordered_json::parse(record);
  const auto status = json.at("status").get<std::string>();
  ++sums_.files;
  ++(status == "ok"        ? sums_.ok
     : status == "skipped" ? sums_.skipped
     : status == "removed" ? sums_.removed
                           : sums_.failed);
  if (status == "ok" || status == "removed") {
    sums_.bytes_in += json.at("bytes_in").get<std::uint64_t>();
    sums_.bytes_out += json.at("bytes_out").get<std::uint64_t>();
  }
  const auto restorable = json.find("restorable");
  const bool comes_back_changed =
      (status == "ok" || status == "skipped") && restorable != json.end() && *restorable == false;
  if (comes_back_changed) {
    ++sums_.not_restorable;
    const auto why = json.find("why_not_restorable");
    if (run_.verbosity > 0 && !run_.quiet)
      say_line(fmt::format("{}: cannot be restored byte for byte: {}", line.input,
                           why != json.end() && why->is_string() ? why->get<std::string>()
                                                                 : "an earlier run did not record why"));
  }
  const bool bad = json.at("code").get<int>() != exit_ok;
  // "out of memory" names no file, but a list has many volumes.
  const bool is_named = error.find(line.input) != error.npos || error.find(line.output) != error.npos;
  if (bad) say_line("tagrid: " + (is_named ? "" : line.input + ": ") + error);
  if (!bad && run_.verbosity > 0 && !run_.quiet) say_line(line.input + ": " + status);
}

}  // namespace tagrid
