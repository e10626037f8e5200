// Exceptions of the program as statuses of the library, with their messages.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "tagrid/tagrid.h"

namespace tagrid::library {

/// The messages of a handle that one thread at a time uses: the last one is for whoever asks.
class SharedMessage {
 public:
  void set(std::string text) noexcept { text_ = std::move(text); }
  const char* get() const { return text_.c_str(); }

 private:
  std::string text_;
};

/// The messages of a handle that threads share: each thread reads its own. A thread keeps its last message alone, of
/// whatever handle, so that nothing grows with the number of threads or handles.
class MessageOfEachThread {
 public:
  MessageOfEachThread();

  void set(std::string text) noexcept;
  /// "" where the last message of this thread is of another handle.
  const char* get() const;

 private:
  std::uint64_t handle_;  ///< no other one ever has this number
};

/// An argument of a call that makes no sense.
struct BadArgument {
  std::string what;
};

/// Thrown where a callback of the caller asks to stop.
struct Cancelled {};

/// The exception that is being handled: its status, and its message, "" where there is no memory for it.
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

inline void require(bool condition, const char* what) {
  if (!condition) throw BadArgument{what};
}

}  // namespace tagrid::library
