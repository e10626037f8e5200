// Translates exceptions of the program to status codes of the library, with their messages.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "io/errors/errors.h"
#include "tagrid/tagrid.h"

namespace tagrid::library {

/// The messages of a handle that is used by one thread at a time. The last message is returned to any thread.
class SharedMessage {
 public:
  void set(std::string text) noexcept { text_ = std::move(text); }
  const char* get() const { return text_.c_str(); }

 private:
  std::string text_;
};

/// The messages of a handle that threads share: each thread reads its own. A thread keeps only its last
/// message, of any handle, so memory does not grow with the number of threads or handles.
class MessageOfEachThread {
 public:
  MessageOfEachThread();

  void set(std::string text) noexcept;
  /// "" if the last message of this thread belongs to another handle.
  const char* get() const;

 private:
  std::uint64_t handle_;  ///< unique: no other handle ever has this number
};

/// Stops the call, because a callback of the caller asked for it.
[[noreturn]] inline void cancel() { throw UsageError("cancelled by the caller", Problem::cancelled); }

/// The status of the exception that is being handled, and its message; "" if there is no memory for it.
tagrid_status sorted_failure(std::string& message) noexcept;

/// Does the work of one call.
template <class Messages, class Work>
tagrid_status call(Messages& messages, Work work) noexcept {
  try {
    work();
    return TAGRID_OK;
  } catch (...) {
    std::string message;
    const tagrid_status status = sorted_failure(message);
    messages.set(std::move(message));
    return status;
  }
}

}  // namespace tagrid::library
