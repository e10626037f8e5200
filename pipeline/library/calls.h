// What calls of the library share: messages, status codes, and conversions to and from the pipeline.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <utility>

#include "io/errors/errors.h"
#include "io/tag/blocks.h"
#include "io/tag/bricks.h"
#include "io/tag/header.h"
#include "io/tag/index.h"
#include "io/volume/volume_info.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "pipeline/reading/read_region.h"
#include "stages/grid/box.h"
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

/// Reads a struct of a caller that was compiled with an older or a newer header: missing members get their
/// defaults, unknown ones are ignored. `first_size`: of the struct's first version.
template <class Struct>
Struct taken_over(const Struct* given, void (*init)(Struct*), std::size_t first_size) {
  Struct result;
  init(&result);
  if (given == nullptr) return result;
  require(given->struct_size >= first_size, "a struct was not set up: call its init function first");
  std::memcpy(&result, given, std::min(given->struct_size, sizeof result));
  result.struct_size = sizeof result;
  return result;
}

/// The reverse: writes as much of a result as the caller's struct can hold.
template <class Struct>
void hand_over(Struct result, Struct* to, std::size_t first_size) {
  require(to != nullptr, "there is no struct to fill");
  require(to->struct_size >= first_size, "struct_size must be set to the size of the struct");
  result.struct_size = to->struct_size;
  std::memcpy(to, &result, std::min(to->struct_size, sizeof result));
}

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

/// A caller's half-open box within `dims`, with both ends included. Throws UsageError.
Box box_of(const tagrid_box& box, const Index3& dims);
/// `strides`; if null, those of `shape` samples without gaps.
Strides strides_of(const std::int64_t* strides, const Index3& shape, std::size_t sample_size);

tagrid_geometry geometry_of_volume(const Geometry& geometry);
/// The lines of an NRRD header with the same content; "" if nothing is known.
std::string nrrd_fields_of(const tagrid_geometry& geometry);

tagrid_info info_of(const TagHeader& header, const TagIndex& index, const TagSizes& sizes);

}  // namespace tagrid::library
