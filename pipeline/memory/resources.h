// The threads and memory that a run may use.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "io/errors/errors.h"

namespace tagrid {

struct Resources {
  int threads = 1;
  /// Peak resident memory of the entire process. If not given, the target is a quarter of the memory
  /// available to each process, and a run is refused only if the machine cannot hold it.
  std::optional<std::uint64_t> memory = std::nullopt;
  /// Of these, bytes that something else takes than the work itself: what reads an input from a server.
  std::uint64_t besides = 0;
  /// Number of such processes that share the machine.
  int processes = 1;
  /// The directory for a temporary file of samples whose order must change, if there may be one.
  std::optional<std::string> spool = std::nullopt;

  explicit Resources(int thread_count) : threads(thread_count) {}
};

/// Bytes of memory that a program which reads or writes a format may take until it has said how much it
/// needs: what a limit leaves to it, but always enough for the programs of tagrid to start.
std::uint64_t first_memory_of_programs(const std::optional<std::uint64_t>& limit);
/// The smallest limit with which that is as much as without a limit.
std::uint64_t limit_for_most_first_memory();

/// Number of threads that this process may run on (its affinity).
int available_threads();

/// Limits on what is in memory at once while bricks are encoded.
struct EncodeBudget {
  int threads = 1;
  /// Slices that are read ahead of those that a layer of bricks needs.
  std::int64_t slices_ahead = 0;
  /// Bricks between their subdivision and the writer.
  std::int64_t bricks_in_flight = 1;
};

/// Limits on what is in memory at once while bricks are decoded.
struct DecodeBudget {
  int threads = 1;
  /// Bricks between the reader and the rows in which they are collected.
  std::int64_t bricks_in_flight = 1;
  /// Rows of bricks that are collected and then written; all rows of a layer make complete slices.
  std::int64_t rows = 1;
};

/// Bytes of memory of the machine, or of the control group (version 2 or 1, or a group that contains it) if
/// that allows less. `root` is where /proc and /sys are, for tests.
std::uint64_t available_memory(const std::string& root = "");

/// The memory available to each of the processes that share the machine.
inline std::uint64_t share_of_memory(const Resources& resources) {
  return available_memory() / static_cast<std::uint64_t>(resources.processes);
}

/// The limit on memory, or without one a part of this process's share of memory: 1 is all, 4 a quarter.
inline std::uint64_t allowed_memory(const Resources& resources, std::uint64_t part = 1) {
  return resources.memory ? *resources.memory : share_of_memory(resources) / part;
}

/// Returns best(limit). Without a limit, tries a quarter of this process's share of memory, then half of it.
/// Returns `smallest` if `best`, which returns a std::optional<Load>, finds nothing.
template <class Load, class Best>
Load within(const Resources& resources, Best best, const Load& smallest) {
  auto found = best(allowed_memory(resources, 4));
  if (!found && !resources.memory) found = best(allowed_memory(resources, 2));
  return found.value_or(smallest);
}

/// What `besides` leaves of a limit.
inline std::uint64_t without(std::uint64_t besides, std::uint64_t limit) {
  return limit - std::min(limit, besides);
}

/// The largest number of rows up to `all` that fit, or 0. More rows never need less memory.
template <class Fit>
std::int64_t most_rows(std::int64_t all, Fit fit) {
  if (!fit(1)) return 0;
  std::int64_t low = 1, high = all;
  while (low < high) {
    const std::int64_t middle = high - (high - low) / 2;
    if (fit(middle))
      low = middle;
    else
      high = middle - 1;
  }
  return low;
}

/// The most threads whose needed(threads) bytes fit into the limit on memory. Throws MemoryLimit for `what`.
template <class Needed>
int threads_within(const Resources& resources, const char* what, Needed needed) {
  int threads = std::max(resources.threads, 1);
  if (!resources.memory) return threads;
  const auto all = [&](int count) { return needed(count) + resources.besides; };
  while (threads > 1 && all(threads) > *resources.memory) --threads;
  if (const std::uint64_t least = all(threads); least > *resources.memory)
    throw MemoryLimit(what, {.needed = least, .allowed = *resources.memory});
  return threads;
}

/// The program tagrid-write-NAME.
struct WriterProgram {
  std::string_view name;
  bool keeps_volume = false;  ///< the entire volume in memory
};

/// Throws `limit` again, as a UsageError that says that `bytes` of it are for the program.
[[noreturn]] void throw_for_writer(const MemoryLimit& limit, const WriterProgram& writer,
                                   std::uint64_t bytes);

/// Throws UsageError if the machine lacks the memory that the program needs, and there is no other limit.
void require_memory_of_writer(const WriterProgram& writer, std::uint64_t bytes, const Resources& resources);

}  // namespace tagrid
