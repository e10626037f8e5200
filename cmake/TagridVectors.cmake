# The instruction sets for which vector code is compiled: AVX-512, AVX2, SSE4 or NEON, and none. Every source with vector code
# has to be told the same. Vectors whose length is not known when compiling are not supported. 0x50 are HWY_AVX3_SPR and
# HWY_AVX3_ZEN4, names that Highway 1.0 does not have.
# Sanitizers look at one set beside none, since all come from one source.
set(left_out 0x50|HWY_SSSE3|HWY_AVX3_DL|HWY_SVE|HWY_SVE2|HWY_SVE_256|HWY_SVE2_128|HWY_RVV)
if(TAGRID_SANITIZE)
  string(APPEND left_out |HWY_AVX3|HWY_SSE4)
endif()
target_compile_definitions(tagrid_hwy INTERFACE HWY_DISABLED_TARGETS=\(${left_out}\))
# Its assertions need its library, of which only the headers are used.
target_compile_definitions(tagrid_hwy INTERFACE HWY_IS_DEBUG_BUILD=0)
if(TAGRID_SANITIZE)
  target_compile_definitions(tagrid_hwy INTERFACE TAGRID_SMALL_CODE)
endif()
# The module for browsers without vectors, too: with the vectors that Highway emulates instead, it would be larger and slower,
# and clang 19 would take many minutes for the coder of lanes.
if(TAGRID_SCALAR OR "${TAGRID_WASM_KIND}" STREQUAL "scalar")
  target_compile_definitions(tagrid_hwy INTERFACE HWY_COMPILE_ONLY_SCALAR)
endif()
# Highway 1.0 has NEON only with the instructions for AES, and gcc inlines its classes only where all of a source may use them.
# Of the processors with arm64 that people compute with, only those of the Raspberry Pi 4 and older lack them.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64" AND CMAKE_CXX_COMPILER_ID STREQUAL GNU AND NOT TAGRID_SCALAR)
  target_compile_options(tagrid_hwy INTERFACE -march=armv8-a+crypto)
endif()
