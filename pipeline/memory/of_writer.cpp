#include "pipeline/memory/of_writer.h"

#include <fmt/format.h>

#include "pipeline/memory/within.h"

namespace tagrid {

void throw_for_writer(const MemoryLimit& limit, std::string_view writer, std::uint64_t bytes) {
  ErrorDetail detail;
  detail.problem = Problem::writer_memory;
  detail.numbers = limit.detail().numbers;
  throw UsageError(
      fmt::format("{}; up to {} MiB of it are for tagrid-write-{}, which keeps the whole volume in memory",
                  limit.what(), (bytes >> 20) + 1, writer),
      detail);
}

void require_memory_of_writer(std::string_view writer, std::uint64_t bytes, const Resources& resources) {
  const std::uint64_t there = share_of_memory(resources);
  if (resources.memory || bytes <= there) return;
  throw_for_writer(MemoryLimit("writing the volume", there, bytes, {}), writer, bytes);
}

}  // namespace tagrid
