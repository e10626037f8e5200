// Exceptions of the program as statuses of the library, with their messages.
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "tagrid/tagrid.h"

namespace tagrid::library {

/// The messages of a handle: one for each thread that uses it, or one for all of them.
class Messages {
 public:
  enum class Of { each_thread, the_handle };
  explicit Messages(Of of) : of_(of) {}

  void set(std::string text) {
    const std::lock_guard lock(mutex_);
    texts_[reader()] = std::move(text);
  }
  /// Of this thread; "" where it has none.
  const char* get() const {
    const std::lock_guard lock(mutex_);
    const auto found = texts_.find(reader());
    return found == texts_.end() ? "" : found->second.c_str();
  }

 private:
  std::thread::id reader() const {
    return of_ == Of::each_thread ? std::this_thread::get_id() : std::thread::id();
  }

  Of of_;
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
