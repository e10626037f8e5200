// Whether the tests run under a sanitizer, where everything takes several times as much time and memory.
#pragma once

#include <cstddef>

namespace tagrid {

#ifdef TAGRID_SANITIZED
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

// Which of the bits of a small file are flipped, one after another. That checksums find them all is shown without
// sanitizers; seven has no factor in common with eight, so with them every bit of a byte has its turn as well.
inline constexpr std::size_t damage_stride = sanitized ? 7 : 1;

}  // namespace tagrid
