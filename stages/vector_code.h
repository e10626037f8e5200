// How inner loops become vector code: plain loops that the compiler vectorizes, cloned for the instruction
// sets below and chosen when the program starts. All of them round alike (IEEE operations, no contraction of
// multiply and add), so every clone gives the same bytes.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(TAGRID_SCALAR)
#define TAGRID_VECTOR_CODE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define TAGRID_VECTOR_CODE
#endif
