// Volumes that a writer program writes.
#pragma once

#include <memory>
#include <string>

#include "io/programs/writer_conversation.h"
#include "io/volume/volume_sink.h"

namespace tagrid {

/// Asks the writer at an absolute path to begin a volume, which will be the file at `path`, or the standard output for
/// "-". The program writes a temporary file, and has ended when all samples are written; tagrid then gives the file its
/// name. For the standard output, devices and pipes, it copies the file. `first_memory`: bytes of memory that the program may
/// take until it has said how much it needs. Throws UsageError and WorldError.
std::unique_ptr<VolumeSink> create_with_writer(const std::string& program, const std::string& path,
                                               const VolumeInfo& info, const SinkOptions& options,
                                               const WriterOptions& wishes,
                                               std::uint64_t first_memory = most_first_memory);

}  // namespace tagrid
