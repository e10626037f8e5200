// Calls of POSIX that a signal interrupts. For the sources of this room alone.
#pragma once

#include <cerrno>

namespace tagrid {

/// Makes a call, and repeats it if a signal interrupts it. Not for close(), which closes the file anyway.
template <class Call>
auto uninterrupted(Call call) {
  for (;;) {
    const auto result = call();
    if (result >= 0 || errno != EINTR) return result;
  }
}

}  // namespace tagrid
