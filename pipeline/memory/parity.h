// The memory of parity, which is made when all else of an encoding has given its memory back.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
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

/// The same for a file that is complete. Never refuses: that a limit is missed by little is no reason to lose the file.
std::uint64_t memory_for_stripes_of_finished(const ParityLayout& layout, const Resources& resources);

/// Appends parity, if it is wanted, to a finished file of `size` bytes. Returns its size. REQUIRES:
/// file.can_seek(). Inline, for libraries plan memory but must not link what handles the signals of a process.
inline std::uint64_t end_with_parity(OutputFile& file, std::uint64_t size, std::optional<ParityShare> share,
                                     const Resources& resources) {
  if (!share) return size;
  const FileSource written(file.temporary());
  if (written.size() != size) throw WorldError(file.name() + ": was changed while it was being written");
  const WriteAt write = [&](std::uint64_t position, std::span<const std::byte> bytes) {
    file.write_at(position, bytes);
  };
  return write_parity(written, *share, size, write,
                      memory_for_stripes_of_finished(ParityLayout::of(size, *share), resources));
}

}  // namespace tagrid
