// Sizes of files, for people.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <string>

namespace tagrid {

/// "1.2 MB" and the like, in powers of 1000, as in file managers.
inline std::string human_bytes(std::uint64_t bytes) {
  if (bytes < 1000) return fmt::format("{} B", bytes);
  double size = static_cast<double>(bytes);
  const char* unit = "";
  for (const char* next : {"kB", "MB", "GB", "TB", "PB"}) {
    size /= 1000;
    unit = next;
    if (size < 1000) break;
  }
  return fmt::format("{:.{}f} {}", size, size < 10 ? 2 : size < 100 ? 1 : 0, unit);
}

}  // namespace tagrid
