#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/targets.h"

namespace tagrid::fuzz {

void claim(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken claim: %s\n", what);
  std::abort();
}

}  // namespace tagrid::fuzz
