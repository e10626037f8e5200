// Plain loops as vector code: the compiler clones them for these instruction sets, and one clone is chosen when the
// program starts, which needs ELF: Windows has no clones. All give the same bytes (IEEE operations, no contraction of
// multiply and add). Not for unnamed namespaces: gcc 12 does not vectorize clones there. Highway vectorizes what no
// compiler does (instruction_sets.h); see docs/dev/decisions/0039-two-kinds-of-vector-code.md.
#pragma once

#if defined(__x86_64__) && defined(__ELF__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__) && !defined(TAGRID_SCALAR)
#define TAGRID_VECTOR_CODE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define TAGRID_VECTOR_CODE
#endif

// Functions called by such loops must be inlined into them.
#define TAGRID_INLINE inline __attribute__((always_inline))

// Placed before a loop: no iteration reads what another one writes. This is needed if pointers reach the loop
// through an inlined function, where gcc forgets __restrict.
#if defined(__GNUC__) && !defined(__clang__)
#define TAGRID_INDEPENDENT _Pragma("GCC ivdep")
#else
#define TAGRID_INDEPENDENT
#endif
