// Measures the peak of the heap in a piece of a test. Only in a program that is linked with counted_heap.cpp.
#pragma once

#include <cstdint>

namespace tagrid {

/// Counts the bytes that all threads request from now on. Only one object at a time.
class HeapPeak {
 public:
  HeapPeak();
  /// The peak of the bytes in use since then, minus those that were in use before.
  std::uint64_t bytes() const;

 private:
  std::int64_t before_;
};

}  // namespace tagrid
