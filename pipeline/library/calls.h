// What calls of the library with threads share: messages, limits, and the handle of a reader.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "io/tag/bricks.h"
#include "pipeline/library/answers.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "pipeline/reading/read_region.h"
#include "tagrid/tagrid.h"

namespace tagrid::library {

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

/// A reader of the library.
struct tagrid_reader {
  std::shared_ptr<const tagrid::ByteSource> source;
  /// Null if opening failed.
  std::unique_ptr<tagrid::TagBricks> file;
  /// Until the reader is open, only the thread that opens it has the handle.
  tagrid::library::SharedMessage of_opening;
  mutable tagrid::library::MessageOfEachThread messages;
};

namespace tagrid::library {

/// Does the work of a call on a reader that is open.
template <class Work>
tagrid_status with_file(const tagrid_reader* reader, Work work) noexcept {
  if (reader == nullptr) return TAGRID_INVALID_ARGUMENT;
  return call(reader->messages, [&] {
    require(reader->file != nullptr, "the reader is not open");
    work(*reader->file);
  });
}

tagrid_call settings_of(const tagrid_call* call);
/// The limits on threads and memory for the call.
Resources resources_of(const tagrid_call& call);
/// The caller's function, or an empty one. It calls cancel() if the caller asks to stop.
Progress progress_of(const tagrid_call& call);

}  // namespace tagrid::library
