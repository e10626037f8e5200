// Chooses among the versions of a function that Highway compiles for several instruction sets. Highway's own
// choice takes a library that measures the clock in every program that starts (3 ms), so only its headers are
// used.
#pragma once

#include <hwy/detect_targets.h>

#include <cstdint>

namespace tagrid {

/// The instruction sets of this machine, as bits HWY_AVX3, HWY_AVX2 and HWY_SSE4, as far as vector code is
/// compiled for them. The set that every machine has counts as HWY_STATIC_TARGET.
std::int64_t instruction_sets();

/// For tests: from now on, no others than these; 0: all. Not while vector code runs.
void limit_instruction_sets(std::int64_t sets);

/// The first version that this machine can run. A version that was not compiled is null, except for the last
/// one.
template <class Function>
Function best_version(Function avx3, Function avx2, Function sse4, Function any) {
  const std::int64_t sets = instruction_sets();
  if (avx3 != nullptr && (sets & HWY_AVX3) != 0) return avx3;
  if (avx2 != nullptr && (sets & HWY_AVX2) != 0) return avx2;
  if (sse4 != nullptr && (sets & HWY_SSE4) != 0) return sse4;
  return any;
}

/// The best version of a function in tagrid::HWY_NAMESPACE, as a pointer to it. REQUIRES: hwy/highway.h.
#define TAGRID_BEST_VERSION(function)                                                  \
  best_version<decltype(&HWY_STATIC_DISPATCH(function))>(                              \
      HWY_CHOOSE_AVX3(function), HWY_CHOOSE_AVX2(function), HWY_CHOOSE_SSE4(function), \
      &HWY_STATIC_DISPATCH(function))

}  // namespace tagrid
