#include "pipeline/library/failures.h"

#include <atomic>
#include <exception>

#include "io/errors/error_kinds.h"
#include "pipeline/memory/of_bricks.h"

namespace tagrid::library {
namespace {

struct Message {
  std::uint64_t handle = 0;
  std::string text;
};
thread_local Message last_of_thread;

tagrid_status status_of(const SortedError& error) {
  if (error.detail.problem == Problem::memory_limit) return TAGRID_MEMORY_LIMIT;
  if (error.detail.problem == Problem::cancelled) return TAGRID_CANCELLED;
  switch (error.kind) {
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

std::string message_of(const SortedError& error) {
  if (error.kind == ErrorKind::memory) return "out of memory";
  if (error.detail.problem != Problem::memory_limit || error.detail.sentence.terms.empty())
    return error.message;
  // The plan counts the whole process; a caller's limit is for the work of the call.
  return MemoryLimit(error.message, error.detail).but_for(memory_of_program).what();
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
    const SortedError error = sorted_error(std::current_exception());
    message = message_of(error);
    return status_of(error);
  } catch (...) {
    message.clear();
    return TAGRID_OUT_OF_MEMORY;
  }
}

}  // namespace tagrid::library
