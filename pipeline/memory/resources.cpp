#include "pipeline/memory/resources.h"

#include <sched.h>

#include <algorithm>

#include "io/volume/volume_info.h"
#include "pipeline/memory/of_bricks.h"

namespace tagrid {

std::uint64_t first_memory_of_programs(const std::optional<std::uint64_t>& limit) {
  constexpr std::uint64_t least = std::uint64_t{64} << 20;
  const std::uint64_t left = limit ? *limit - std::min(*limit, memory_of_program) : most_first_memory;
  return std::clamp(left, least, most_first_memory);
}

std::uint64_t limit_for_most_first_memory() { return most_first_memory + memory_of_program; }

int available_threads() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return 1;
  return std::max(1, CPU_COUNT(&set));
}

}  // namespace tagrid
