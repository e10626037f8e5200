#include "tools/report/failure.h"

#include <fmt/format.h>

#include <exception>

#include "io/errors/error_kinds.h"
#include "io/errors/errors.h"
#include "tools/report/advice.h"
#include "tools/report/exit_codes.h"

namespace tagrid {

Failure current_failure(const std::string& memory_advice) {
  const SortedError error = sorted_error(std::current_exception());
  switch (error.kind) {
    case ErrorKind::usage: {
      std::vector<std::string> list;
      for (const Choice& choice : error.detail.choices)
        list.push_back(fmt::format("{}  {}  {}", list.size() + 1, choice.name, choice.text));
      // Volumes without names are alike, and there may be thousands: the message says their number.
      if (!list.empty() && error.detail.choices.back().name == std::to_string(list.size())) list.clear();
      return {exit_usage, words_of(error), std::move(list)};
    }
    case ErrorKind::broken_input:
      return {exit_broken_input, words_of(error)};
    case ErrorKind::closed_pipe:
      return {exit_world, ""};
    case ErrorKind::world:
      return {exit_world, words_of(error)};
    case ErrorKind::memory:
      return {exit_world, "out of memory" + (memory_advice.empty() ? "" : "; " + memory_advice)};
    case ErrorKind::bug:
      break;
  }
  return {exit_bug, fmt::format("this is a bug: {}; please report it", error.message)};
}

}  // namespace tagrid
