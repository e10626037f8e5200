#include "pipeline/library/calls.h"

#include <oneapi/tbb/global_control.h>

#include <atomic>
#include <exception>

#include "io/errors/errors.h"
#include "pipeline/memory/plan.h"

namespace tagrid::library {
namespace {

struct Message {
  std::uint64_t handle = 0;
  std::string text;
};
thread_local Message last_of_thread;

std::string message_of(const SortedError& error) {
  if (error.kind == ErrorKind::memory) return "out of memory";
  if (error.detail.problem != Problem::memory_limit || error.detail.subject.empty()) return error.message;
  // The plan counts the whole process; a caller's limit is for the work of the call.
  return MemoryLimit(error.message, error.detail).but_for(memory_of_program).what();
}

}  // namespace

tagrid_call settings_of(const tagrid_call* call) {
  return taken_over(call, tagrid_call_init, sizeof(tagrid_call));
}

Resources resources_of(const tagrid_call& call) {
  require(call.threads >= 0, "the number of threads is negative");
  // If a caller limits the threads of oneTBB, the limit applies to these threads, too.
  const auto most =
      oneapi::tbb::global_control::active_value(oneapi::tbb::global_control::max_allowed_parallelism);
  const int wanted = call.threads == 0 ? available_threads() : call.threads;
  Resources resources(static_cast<int>(std::min(static_cast<std::size_t>(wanted), most)));
  // The plan counts the whole process, but a caller's limit is for the work of the call.
  if (call.memory_limit > 0)
    resources.memory = std::min(call.memory_limit, UINT64_MAX - memory_of_program) + memory_of_program;
  return resources;
}

Progress progress_of(const tagrid_call& call) {
  if (call.progress == nullptr) return {};
  return [function = call.progress, user = call.progress_user](std::uint64_t done, std::uint64_t total) {
    if (function(user, done, total) != 0) cancel();
  };
}

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
