#include "pipeline/memory/resources.h"

#include <sched.h>

#include <algorithm>

namespace tagrid {

int available_threads() {
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return 1;
  return std::max(1, CPU_COUNT(&set));
}

}  // namespace tagrid
