// Tests ask for more threads than a small machine has cores, so that more can go wrong.
#include <oneapi/tbb/global_control.h>

namespace {
const oneapi::tbb::global_control many_threads(oneapi::tbb::global_control::max_allowed_parallelism, 16);
}
