// The load of a run within its limit on memory.
#pragma once

#include <cstdint>

#include "pipeline/memory/available_memory.h"
#include "pipeline/memory/resources.h"

namespace tagrid {

/// What there is for each of the processes that share the machine.
inline std::uint64_t share_of_memory(const Resources& resources) {
  return available_memory() / static_cast<std::uint64_t>(resources.processes);
}

/// best(limit) within the limit, or where none is given, within a quarter of what there is, or half of it;
/// `smallest` where that finds nothing. `best` returns a std::optional<Load>.
template <class Load, class Best>
Load within(const Resources& resources, Best best, const Load& smallest) {
  if (resources.memory) return best(*resources.memory).value_or(smallest);
  const std::uint64_t share = share_of_memory(resources);
  for (const std::uint64_t part : {4, 2})
    if (const auto found = best(share / part)) return *found;
  return smallest;
}

}  // namespace tagrid
