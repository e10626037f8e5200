// Finds the load of a run that fits into its limit on memory.
#pragma once

#include <cstdint>

#include "pipeline/memory/available_memory.h"
#include "pipeline/memory/resources.h"

namespace tagrid {

/// The memory available to each of the processes that share the machine.
inline std::uint64_t share_of_memory(const Resources& resources) {
  return available_memory() / static_cast<std::uint64_t>(resources.processes);
}

/// Returns best(limit) for the given limit. If no limit is given, tries a quarter of this process's share of
/// memory, and then half of it. Returns `smallest` if `best` finds nothing. `best` returns a
/// std::optional<Load>.
template <class Load, class Best>
Load within(const Resources& resources, Best best, const Load& smallest) {
  if (resources.memory) return best(*resources.memory).value_or(smallest);
  const std::uint64_t share = share_of_memory(resources);
  for (const std::uint64_t part : {4, 2})
    if (const auto found = best(share / part)) return *found;
  return smallest;
}

}  // namespace tagrid
