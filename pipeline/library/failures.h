// Exceptions of the program as statuses of the library, with their messages.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "tagrid/tagrid.h"

namespace tagrid::library {

/// The messages of a handle, one for each thread that uses it.
class Messages {
 public:
  void set(std::string text) {
    const std::lock_guard lock(mutex_);
    texts_[std::this_thread::get_id()] = std::move(text);
  }
  /// Of this thread; "" where it has none.
  const char* get() const {
    const std::lock_guard lock(mutex_);
    const auto found = texts_.find(std::this_thread::get_id());
    return found == texts_.end() ? "" : found->second.c_str();
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::thread::id, std::string> texts_;
};

/// An argument of a call that makes no sense.
struct BadArgument {
  std::string what;
};

/// Thrown where a callback of the caller asks to stop.
struct Cancelled {};

/// The exception that is being handled: its status, and its message in `messages`.
tagrid_status failed(Messages& messages) noexcept;

/// Does the work of one call.
template <class Work>
tagrid_status call(Messages& messages, Work work) noexcept {
  try {
    work();
    return TAGRID_OK;
  } catch (...) {
    return failed(messages);
  }
}

inline void require(bool condition, const char* what) {
  if (!condition) throw BadArgument{what};
}

}  // namespace tagrid::library
