#include "tools/archive/events.h"

#include <nlohmann/json.hpp>

#include "io/text/text.h"
#include "tools/report/report.h"

namespace tagrid {

using nlohmann::ordered_json;

std::string line_of(const CheckEvent& event) {
  return written_json({{"event", "check"},
                       {"output", text_of_name(event.output)},
                       {"status", event.status},
                       {"error", json_text_or_null(event.error)},
                       {"bytes", event.bytes},
                       {"modified_ns", event.modified},
                       {"version", TAGRID_VERSION},
                       {"finished", event.finished}});
}

std::optional<CheckEvent> parse_check(std::string_view line) {
  const ordered_json json = ordered_json::parse(line, nullptr, false);
  if (json.at("event").get<std::string>() != "check") return std::nullopt;
  CheckEvent event;
  event.output = name_of_text(json.at("output").get<std::string>());
  event.finished = json.at("finished").get<double>();
  event.status = json.at("status").get<std::string>();
  if (const ordered_json& error = json.at("error"); error.is_string()) event.error = error.get<std::string>();
  event.bytes = json.at("bytes").get<std::uint64_t>();
  event.modified = json.at("modified_ns").get<std::int64_t>();
  return event;
}

}  // namespace tagrid
