// The memory of programs that write volumes.
#pragma once

#include <cstdint>
#include <string_view>

#include "io/errors/errors.h"
#include "pipeline/memory/resources.h"

namespace tagrid {

/// The program tagrid-write-NAME.
struct WriterProgram {
  std::string_view name;
  bool keeps_volume = false;  ///< the entire volume in memory
};

/// Throws `limit` again, as a UsageError that says that `bytes` of it are for the program.
[[noreturn]] void throw_for_writer(const MemoryLimit& limit, const WriterProgram& writer,
                                   std::uint64_t bytes);

/// Throws UsageError if the machine does not have the memory that the program needs, and there is no other limit.
void require_memory_of_writer(const WriterProgram& writer, std::uint64_t bytes, const Resources& resources);

}  // namespace tagrid
