// Volumes that a reader program opens.
#pragma once

#include <memory>
#include <string>

#include "io/programs/reader_conversation.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// Asks the reader at an absolute path to open the volume at `path`. If the samples lie plainly in files, the reader
/// ends, and tagrid reads them; otherwise it gives them slice by slice as long as the source lives. `first_memory`: bytes
/// of memory that the reader may take while it describes the volume. Throws BrokenInput, UsageError and WorldError.
std::unique_ptr<VolumeSource> open_with_reader(const std::string& program, const std::string& path,
                                               const ReaderOptions& options,
                                               std::uint64_t first_memory = most_first_memory);

}  // namespace tagrid
