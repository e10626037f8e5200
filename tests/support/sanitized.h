// Whether the tests run under a sanitizer, where everything takes several times as much time and memory.
#pragma once

namespace tagrid {

#ifdef TAGRID_SANITIZED
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

}  // namespace tagrid
