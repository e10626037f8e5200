// libc++ describes errors of the system by printf, which would be 7 kB of the module. It has no system.
#include <cstddef>

extern "C" {

int strerror_r(int, char* text, std::size_t room) {
  if (room > 0) *text = 0;
  return 0;
}

int snprintf(char* text, std::size_t room, const char*, ...) {
  if (room > 0) *text = 0;
  return 0;
}
}
