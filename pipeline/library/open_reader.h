// A reader of the library, and calls on it.
#pragma once

#include <memory>

#include "io/tag/bricks.h"
#include "pipeline/library/failures.h"

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

}  // namespace tagrid::library
