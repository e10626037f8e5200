// Volumes that reader and writer programs open and write.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "io/programs/reader_conversation.h"
#include "io/programs/writer_conversation.h"
#include "io/volume/volume_sink.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// Asks the reader at an absolute path to open the volume at `path`. If the samples lie plainly in files, the
/// reader ends, and tagrid reads them; otherwise it gives them slice by slice as long as the source lives.
/// `first_memory`: bytes of memory that the reader may take while it describes the volume. Throws
/// BrokenInput, UsageError and WorldError.
std::unique_ptr<VolumeSource> open_with_reader(const std::string& program, const std::string& path,
                                               const ReaderOptions& options,
                                               std::uint64_t first_memory = most_first_memory);

/// Asks the writer at an absolute path to begin a volume, which will be the file at `path`, or the standard
/// output for "-". The program writes a temporary file, and has ended when all samples are written; tagrid
/// then gives the file its name. For the standard output, devices and pipes, it copies the file.
/// `first_memory`: bytes of memory that the program may take until it has said how much it needs. Throws
/// UsageError and WorldError.
std::unique_ptr<VolumeSink> create_with_writer(const std::string& program, const std::string& path,
                                               const VolumeInfo& info, const SinkOptions& options,
                                               const WriterOptions& wishes,
                                               std::uint64_t first_memory = most_first_memory);

}  // namespace tagrid
