// What a run may take of the machine.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace tagrid {

struct Resources {
  int threads = 1;
  /// Resident memory of the whole process at its peak. Where it is not given, a quarter of what there is
  /// for each process is the aim, and nothing is refused that the machine can hold.
  std::optional<std::uint64_t> memory = std::nullopt;
  /// How many such processes share the machine.
  int processes = 1;
  /// The folder for a temporary file of samples, where a stream has to be read or written in another order
  /// than it comes; "": there is none.
  std::string spool = {};

  explicit Resources(int thread_count) : threads(thread_count) {}
};

/// Threads that this process may run on (its affinity).
int available_threads();

/// How much may be in memory at once while bricks are encoded.
struct EncodeBudget {
  int threads = 1;
  /// Slices that are read ahead of those that a layer of bricks needs.
  std::int64_t slices_ahead = 0;
  /// Bricks between their subdivision and the writer.
  std::int64_t bricks_in_flight = 1;
};

/// How much may be in memory at once while bricks are decoded.
struct DecodeBudget {
  int threads = 1;
  /// Bricks between the reader and the rows that they are gathered to.
  std::int64_t bricks_in_flight = 1;
  /// Rows of bricks that are gathered and then written; all of a layer make whole slices.
  std::int64_t rows = 1;
};

}  // namespace tagrid
