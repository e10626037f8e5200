// The memory that names and places of source files take.
#pragma once

#include <cstdint>
#include <string>

#include "io/envelope/envelope.h"
#include "io/volume/volume_source.h"

namespace tagrid {

/// What an envelope may have many of.
struct EnvelopeSize {
  std::uint64_t files = 0, name_bytes = 0, runs = 0;
  std::uint64_t bytes = 0;  ///< of its content
};

/// Reads an envelope to its end, without remembering its files; see EnvelopeReader. Throws BrokenInput.
EnvelopeSize envelope_size(const std::string& name, const SampleShape& shape, bool exact,
                           NextBlock next_block);
/// The most that the envelope of these files can have. Throws WorldError.
EnvelopeSize envelope_size(const SourceFacts& facts);

/// Bytes of memory that the files of an envelope take when they are read, verified or restored.
std::uint64_t memory_of_files(const EnvelopeSize& size);
/// Bytes of memory that source_files() and write_envelope() take.
std::uint64_t memory_of_source_files(const SourceFacts& facts);

}  // namespace tagrid
