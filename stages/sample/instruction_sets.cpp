#include "stages/sample/instruction_sets.h"

#include <atomic>

#if HWY_ARCH_X86
#include <cpuid.h>
#endif

namespace tagrid {
namespace {

#if HWY_ARCH_X86
// What Highway tells the compiler to use in each set; see hwy/ops/set_macros-inl.h. The compiler's function
// does not know two of these features.
bool has_lzcnt_and_f16c() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  const bool f16c = __get_cpuid(1, &a, &b, &c, &d) != 0 && (c & bit_F16C) != 0;
  return f16c && __get_cpuid(0x80000001, &a, &b, &c, &d) != 0 && (c & bit_LZCNT) != 0;
}

std::int64_t sets_of_machine() {
  __builtin_cpu_init();
  if (!__builtin_cpu_supports("sse4.1") || !__builtin_cpu_supports("sse4.2") ||
      !__builtin_cpu_supports("ssse3") || !__builtin_cpu_supports("aes") || !__builtin_cpu_supports("pclmul"))
    return 0;
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("bmi") || !__builtin_cpu_supports("bmi2") ||
      !__builtin_cpu_supports("fma") || !has_lzcnt_and_f16c())
    return HWY_SSE4;
  if (!__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512vl") ||
      !__builtin_cpu_supports("avx512dq") || !__builtin_cpu_supports("avx512bw") ||
      !__builtin_cpu_supports("avx512cd"))
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
