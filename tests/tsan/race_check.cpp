// A deliberate race: does ThreadSanitizer, with the help of tbb_edges.cpp, see into the pipeline? The node
// that reads slices and the workers that encode bricks count in one variable without a lock. With the
// argument "locked" they use a lock, and nothing may be reported.
#include <atomic>
#include <cstdio>
#include <cstring>

#include "pipeline/encode/graph.h"
#include "tests/support/generous_budgets.h"

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
  EncodeStreams streams;
  streams.read_slice = [&](const Box&) -> SliceSamples {
    count();
    return std::make_shared<std::byte[]>(3600);
  };
  streams.write_brick = [](std::int64_t, BrickCode) {};
  streams.brick_done = [&](std::int64_t) { count(); };
  run_encode_graph(parameters, BrickRows::all(parameters.bricks()), generous_encoding(parameters, 4),
                   streams);
  std::printf("%ld slices and bricks\n", proper + improper);
  return 0;
}
