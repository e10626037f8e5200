// Whole runs: a volume to a .tag file, and back.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "io/tag_file.h"
#include "io/volume_writer.h"
#include "pipeline/encode_options.h"

namespace tagrid {

/// Told how many voxels of how many are done; called by one thread at a time.
using Progress = std::function<void(std::uint64_t done, std::uint64_t total)>;

/// Threads that this process may run on (its affinity).
int available_threads();

struct EncodeResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t file_bytes = 0;
};

/// Encodes the volume at `input` into `output` ("-": the standard streams). Throws BrokenInput, WorldError,
/// UsageError; then nothing is left under the name of the output.
EncodeResult encode_volume(const std::string& input, const std::optional<RawDescription>& raw,
                           const std::string& output, bool overwrite, const EncodeOptions& options,
                           int threads, const Progress& progress = {});

/// Decodes the .tag file `input` into the volume `output`.
void decode_volume(const std::string& input, const std::string& output, VolumeFormat format, bool overwrite,
                   int threads, const Progress& progress = {});

}  // namespace tagrid
