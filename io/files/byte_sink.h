// Takes bytes in order: a file, a pipe, or an object of a caller of the library.
#pragma once

#include <cstddef>
#include <span>

namespace tagrid {

class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Takes all of `bytes`, after those before. Throws WorldError on failure.
  virtual void write(std::span<const std::byte> bytes) = 0;
};

}  // namespace tagrid
