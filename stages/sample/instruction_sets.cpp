#include "stages/sample/instruction_sets.h"

#include <atomic>

#if HWY_ARCH_X86
#include <cpuid.h>
#endif

namespace tagrid {
namespace {

#if HWY_ARCH_X86
struct Registers {
  unsigned a = 0, b = 0, c = 0, d = 0;
};

Registers cpuid(unsigned leaf) {
  Registers found;
  __get_cpuid_count(leaf, 0, &found.a, &found.b, &found.c, &found.d);
  return found;
}

/// The registers that the system keeps for each thread: XCR0 (Intel's manual, volume 1, 13.3).
unsigned kept_registers() {
  unsigned low = 0, high = 0;
  __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
  return low;
}

// Not __builtin_cpu_supports(): it does not know two of these features, and not every compiler's library has it.
std::int64_t sets_of_machine() {
  const auto has = [](unsigned found, unsigned bits) { return (found & bits) == bits; };
  // What Highway tells the compiler to use in each set; see hwy/ops/set_macros-inl.h.
  const Registers basic = cpuid(1), more = cpuid(7), extended = cpuid(0x80000001);
  if (!has(basic.c, bit_SSSE3 | bit_SSE4_1 | bit_SSE4_2 | bit_AES | bit_PCLMUL)) return 0;
  constexpr unsigned of_avx = 0x6, of_avx512 = 0xE6;
  const unsigned kept = has(basic.c, bit_OSXSAVE) ? kept_registers() : 0;
  if (!has(kept, of_avx) || !has(basic.c, bit_AVX | bit_FMA | bit_F16C) ||
      !has(more.b, bit_AVX2 | bit_BMI | bit_BMI2) || !has(extended.c, bit_LZCNT))
    return HWY_SSE4;
  if (!has(kept, of_avx512) ||
      !has(more.b, bit_AVX512F | bit_AVX512VL | bit_AVX512DQ | bit_AVX512BW | bit_AVX512CD))
    return HWY_SSE4 | HWY_AVX2;
  return HWY_SSE4 | HWY_AVX2 | HWY_AVX3;
}
#else
std::int64_t sets_of_machine() { return 0; }
#endif

std::atomic<std::int64_t> limit = 0;

}  // namespace

std::int64_t instruction_sets() {
  static const std::int64_t all = (sets_of_machine() & HWY_TARGETS) | HWY_STATIC_TARGET;
  const std::int64_t only = limit.load(std::memory_order_relaxed);
  return only == 0 ? all : all & only;
}

void limit_instruction_sets(std::int64_t sets) { limit = sets; }

}  // namespace tagrid
