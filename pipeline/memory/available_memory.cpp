#include "pipeline/memory/available_memory.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>

namespace tagrid {
namespace {

// "max", like any text that is not a number, means no limit.
std::uint64_t limit_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::uint64_t limit;
  return in >> limit ? limit : std::numeric_limits<std::uint64_t>::max();
}

// The smallest limit of a group and of the groups that contain it.
std::uint64_t least_limit(const std::filesystem::path& top, std::filesystem::path group,
                          const std::string& file) {
  std::uint64_t least = limit_in(top / file);
  for (group = group.relative_path(); !group.empty(); group = group.parent_path())
    least = std::min(least, limit_in(top / group / file));
  return least;
}

bool names_memory(const std::string& controllers) {
  return ("," + controllers + ",").find(",memory,") != std::string::npos;
}

}  // namespace

std::uint64_t available_memory(const std::string& root) {
  const auto pages = static_cast<std::uint64_t>(std::max(sysconf(_SC_PHYS_PAGES), 1L));
  std::uint64_t least = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  const std::filesystem::path groups = root + "/sys/fs/cgroup";
  std::ifstream own(root + "/proc/self/cgroup");
  // Lines are number:controllers:path; version 2 has no controllers.
  for (std::string line; std::getline(own, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1),
                      path = line.substr(second + 1);
    if (controllers.empty())
      least = std::min(least, least_limit(groups, path, "memory.max"));
    else if (names_memory(controllers))
      least = std::min(least, least_limit(groups / "memory", path, "memory.limit_in_bytes"));
  }
  return least;
}

}  // namespace tagrid
