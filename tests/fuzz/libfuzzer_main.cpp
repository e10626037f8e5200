// The entry of libFuzzer. TAGRID_FUZZ_TARGET is one of the functions in targets.h.
#include "tests/fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tagrid::fuzz::TAGRID_FUZZ_TARGET({data, size});
  return 0;
}
