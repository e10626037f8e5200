#include "pipeline/memory/resources.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "io/system/this_process.h"
#include "io/volume/volume_info.h"
#include "pipeline/memory/plan.h"

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

std::uint64_t first_memory_of_programs(const std::optional<std::uint64_t>& limit) {
  constexpr std::uint64_t least = std::uint64_t{64} << 20;
  const std::uint64_t left = limit ? *limit - std::min(*limit, memory_of_program) : most_first_memory;
  return std::clamp(left, least, most_first_memory);
}

std::uint64_t limit_for_most_first_memory() { return most_first_memory + memory_of_program; }

int available_threads() { return usable_processors(); }

std::uint64_t available_memory(const std::string& root) {
  std::uint64_t least = memory_of_machine();
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

void throw_for_writer(const MemoryLimit& limit, const WriterProgram& writer, std::uint64_t bytes) {
  ErrorDetail detail;
  detail.problem = writer.keeps_volume ? Problem::writer_memory : limit.detail().problem;
  detail.memory = limit.needs();
  throw UsageError(fmt::format("{}; up to {} MiB of it are for tagrid-write-{}{}", limit.what(),
                               (bytes + (1 << 20) - 1) >> 20, writer.name,
                               writer.keeps_volume ? ", which keeps the entire volume in memory" : ""),
                   detail);
}

void require_memory_of_writer(const WriterProgram& writer, std::uint64_t bytes, const Resources& resources) {
  const std::uint64_t there = share_of_memory(resources);
  if (resources.memory || bytes <= there) return;
  throw_for_writer(MemoryLimit("writing the volume", {.needed = bytes, .allowed = there}), writer, bytes);
}

}  // namespace tagrid
