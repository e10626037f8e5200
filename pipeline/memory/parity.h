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

/// The least memory that the process takes while parity is made of a file whose size is not known yet, but is
/// not far above `bytes`. REQUIRES: bytes > 0.
std::uint64_t least_memory_of_parity(std::uint64_t bytes, ParityShare share);

/// Appends parity, if it is wanted, to a finished file of `size` bytes. Returns its size. Never refuses: if the
/// file became far larger than its samples, parity takes what it needs.
std::uint64_t end_with_parity(OutputFile& file, std::uint64_t size, std::optional<ParityShare> share,
                              const Resources& resources);

}  // namespace tagrid
