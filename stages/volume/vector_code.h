// How inner loops become vector code: the compiler vectorizes plain loops and clones them for the instruction
// sets below; one clone is chosen when the program starts. All clones round alike (IEEE operations, no
// contraction of multiply and add), so each gives the same bytes. Do not use this for functions in an unnamed
// namespace: gcc 12 does not vectorize their clones.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(TAGRID_SCALAR)
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
