#include "pipeline/memory/of_writer.h"

#include <fmt/format.h>

#include "pipeline/memory/within.h"

namespace tagrid {

void throw_for_writer(const MemoryLimit& limit, const WriterProgram& writer, std::uint64_t bytes) {
  ErrorDetail detail;
  detail.problem = writer.keeps_volume ? Problem::writer_memory : limit.detail().problem;
  detail.numbers = limit.detail().numbers;
  throw UsageError(fmt::format("{}; up to {} MiB of it are for tagrid-write-{}{}", limit.what(),
                               (bytes + (1 << 20) - 1) >> 20, writer.name,
                               writer.keeps_volume ? ", which keeps the entire volume in memory" : ""),
                   detail);
}

void require_memory_of_writer(const WriterProgram& writer, std::uint64_t bytes, const Resources& resources) {
  const std::uint64_t there = share_of_memory(resources);
  if (resources.memory || bytes <= there) return;
  throw_for_writer(MemoryLimit("writing the volume", there, bytes, {}), writer, bytes);
}

}  // namespace tagrid
