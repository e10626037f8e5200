#include "pipeline/library/failures.h"

#include <atomic>
#include <exception>
#include <utility>

#include "io/errors/error_kinds.h"
#include "io/errors/errors.h"
#include "pipeline/memory/of_bricks.h"

namespace tagrid::library {
namespace {

struct Message {
  std::uint64_t handle = 0;
  std::string text;
};
thread_local Message last_of_thread;

tagrid_status status_of(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage:
      return TAGRID_INVALID_ARGUMENT;
    case ErrorKind::broken_input:
      return TAGRID_BROKEN_INPUT;
    case ErrorKind::closed_pipe:
    case ErrorKind::world:
      return TAGRID_IO_ERROR;
    case ErrorKind::memory:
      return TAGRID_OUT_OF_MEMORY;
    case ErrorKind::bug:
      break;
  }
  return TAGRID_BUG;
}

tagrid_status sorted(std::string& message) {
  try {
    throw;
  } catch (const BadArgument& bad) {
    message = bad.what;
    return TAGRID_INVALID_ARGUMENT;
  } catch (const Cancelled&) {
    message = "cancelled by the caller";
    return TAGRID_CANCELLED;
  } catch (const MemoryLimit& error) {
    // The plan counts the whole process; a caller's limit is for the work of the call.
    message = error.but_for(memory_of_program).what();
    return TAGRID_MEMORY_LIMIT;
  } catch (...) {
    SortedError error = sorted_error(std::current_exception());
    message = error.kind == ErrorKind::memory ? "out of memory" : std::move(error.message);
    return status_of(error.kind);
  }
}

}  // namespace

MessageOfEachThread::MessageOfEachThread() {
  static std::atomic<std::uint64_t> handles = 0;
  handle_ = ++handles;
}

void MessageOfEachThread::set(std::string text) noexcept { last_of_thread = {handle_, std::move(text)}; }

const char* MessageOfEachThread::get() const {
  return last_of_thread.handle == handle_ ? last_of_thread.text.c_str() : "";
}

tagrid_status sorted_failure(std::string& message) noexcept {
  try {
    return sorted(message);
  } catch (...) {
    message.clear();
    return TAGRID_OUT_OF_MEMORY;
  }
}

}  // namespace tagrid::library
