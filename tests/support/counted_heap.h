// How much heap a piece of a test takes at its peak. Only in a program that is linked with counted_heap.cpp.
#pragma once

#include <cstdint>

namespace tagrid {

/// Counts what is allocated from now on, by all threads, in bytes as they were asked for. One at a time.
class HeapPeak {
 public:
  HeapPeak();
  /// The most that has been in use at once since then, beyond what was in use before.
  std::uint64_t bytes() const;

 private:
  std::int64_t before_;
};

}  // namespace tagrid
