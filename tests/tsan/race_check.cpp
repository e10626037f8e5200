// A deliberate race: does ThreadSanitizer, with the help of tbb_edges.cpp, see into the pipeline? The node
// that reads slices and the workers that encode bricks count in one variable without a lock. With the
// argument "locked" they use a lock, and nothing may be reported.
#include <atomic>
#include <cstdio>
#include <cstring>

#include "tests/support/graph_ends.h"

using namespace tagrid;

int main(int argc, char** argv) {
  const bool locked = argc > 1 && std::strcmp(argv[1], "locked") == 0;
  CodingParameters parameters{.dims = {60, 60, 400}, .cube_size = 8, .max_level = 9, .field_scale = 1};
  std::atomic<long> proper{0};
  long improper = 0;
  const auto count = [&] {
    if (locked)
      ++proper;
    else
      ++improper;
  };
  SlicesFrom slices([&](const Box&) -> SliceSamples {
    count();
    return std::make_shared<std::byte[]>(3600);
  });
  BricksInto bricks([](const BrickBytes&, const Statistics&) {});
  WatchBricks watch([&](std::int64_t) { count(); });
  encode(job_of(parameters, 4), BrickRows::all(parameters.bricks()), slices, bricks, watch);
  std::printf("%ld slices and bricks\n", proper + improper);
  return 0;
}
