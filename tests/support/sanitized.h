// Whether the tests run under a sanitizer, where everything takes several times as much time and memory.
#pragma once

namespace tagrid {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

}  // namespace tagrid
