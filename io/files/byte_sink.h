// Where bytes go, in order: a file, a pipe, or whatever a caller of the library writes to.
#pragma once

#include <cstddef>
#include <span>

namespace tagrid {

class ByteSink {
 public:
  virtual ~ByteSink() = default;
  /// Takes all of `bytes`, after those before. Throws WorldError where that fails.
  virtual void write(std::span<const std::byte> bytes) = 0;
};

}  // namespace tagrid
