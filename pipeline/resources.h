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

  // NOLINTNEXTLINE: a number of threads alone says enough
  Resources(int thread_count) : threads(thread_count) {}
};

}  // namespace tagrid
