// Bytes that are written in order, wherever they go.
#pragma once

#include <cstddef>
#include <span>

namespace tagrid {

/// Takes bytes in order: a file, a pipe, or an object of a caller of the library.
class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Takes all of `bytes`, after those before. Throws WorldError on failure.
  virtual void write(std::span<const std::byte> bytes) = 0;
};

}  // namespace tagrid
