// Events of an archive besides the records of `convert`: lines of JSON, each of which says what was done to an output.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tagrid {

/// The beginning of the names of files of events, which end in ".jsonl".
inline constexpr const char* events_name = "events";

/// What a check of an output found.
struct CheckEvent {
  std::string output;
  double finished = 0;        ///< seconds since 1970
  std::string status;         ///< "ok", "damaged", "missing"
  std::string error;          ///< what is wrong; "" if nothing is
  std::uint64_t bytes = 0;    ///< of the file that was checked
  std::int64_t modified = 0;  ///< of that file, in nanoseconds since 1970
};

/// The line of an event, without an end.
std::string line_of(const CheckEvent& event);

/// Reads a line; nothing if it is an event of another kind. Throws nlohmann::json::exception if it is no event.
std::optional<CheckEvent> parse_check(std::string_view line);

}  // namespace tagrid
