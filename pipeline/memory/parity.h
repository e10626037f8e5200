// The memory of parity, which is made when all else of an encoding has given its memory back.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "io/files/output_file.h"
#include "io/parity/parity.h"
#include "pipeline/memory/resources.h"

namespace tagrid {

/// Memory for stripes, for write_parity() and ProtectedFile: the usual amount, or what a limit leaves. Throws
/// MemoryLimit for `work` if it leaves too little.
std::uint64_t memory_for_stripes(const std::optional<std::uint64_t>& limit, const ParityLayout& layout,
                                 const std::string& work);

/// The most memory that the process takes while parity is made of a file whose size is not known yet, but is
/// not far above `bytes`. Throws MemoryLimit if a limit is too small. REQUIRES: bytes > 0.
std::uint64_t memory_of_parity(const Resources& resources, std::uint64_t bytes, ParityShare share);

/// Appends parity, if it is wanted, to a finished file of `size` bytes, which no longer fits into a limit that
/// memory_of_parity() accepted only if it became far larger: then it takes what it needs. Returns its size.
std::uint64_t end_with_parity(OutputFile& file, std::uint64_t size, std::optional<ParityShare> share,
                              const Resources& resources);

}  // namespace tagrid
