// How inner loops become vector code: plain loops that the compiler vectorizes, cloned for the instruction
// sets below and chosen when the program starts. All of them round alike (IEEE operations, no contraction of
// multiply and add), so every clone gives the same bytes. Not for functions of a namespace without a name:
// gcc 12 does not vectorize their clones.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(TAGRID_SCALAR)
#define TAGRID_VECTOR_CODE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define TAGRID_VECTOR_CODE
#endif

// What such loops call must become part of them.
#define TAGRID_INLINE inline __attribute__((always_inline))

// Before a loop: no iteration reads what another writes. For pointers that reach the loop through a function
// that has become part of another: gcc forgets __restrict there.
#if defined(__GNUC__) && !defined(__clang__)
#define TAGRID_INDEPENDENT _Pragma("GCC ivdep")
#else
#define TAGRID_INDEPENDENT
#endif
