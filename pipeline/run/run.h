// Whole runs: a volume to a .tag file, and back.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "io/formats/formats.h"
#include "io/tag/file.h"
#include "pipeline/encode/options.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/resources.h"

namespace tagrid {

struct EncodeResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t bytes_in = 0;    ///< read, headers included
  std::uint64_t file_bytes = 0;  ///< written
  std::string temporary;         ///< where the file is before it gets its name; "" for pipes and devices
  std::uint64_t memory = 0;      ///< that the plan takes at most
  double times_read = 0;         ///< how often a sample was read to be encoded, on average
};

/// Encodes the volume at `input` into `output` ("-": the standard streams). From file to file the permissions
/// and the time of the samples are kept. Throws BrokenInput, WorldError, UsageError; then nothing is left
/// under the name of the output.
EncodeResult encode_volume(const std::string& input, const SourceDescription& source,
                           const std::string& output, bool overwrite, const EncodeOptions& options,
                           const Resources& resources, const Progress& progress = {},
                           const BeforeNaming<EncodeResult>& before_naming = {});

struct DecodeResult {
  TagHeader header;
  TagIndex index;
  std::uint64_t bytes_in = 0;            ///< of the .tag file
  std::uint64_t bytes_out = 0;           ///< written, headers included
  std::uint64_t memory = 0;              ///< that the plan takes at most
  std::optional<VdbSummary> vdb;         ///< of an OpenVDB file
  Index3 dims = header.parameters.dims;  ///< of the volume that was written
};

/// Decodes the .tag file `input` into the volume `output`. From file to file the permissions and the time are
/// kept. `vdb` is for OpenVDB files; its max_error does not count.
DecodeResult decode_volume(const std::string& input, const std::string& output, const Format& format,
                           bool overwrite, const Resources& resources, const Progress& progress = {},
                           const BeforeNaming<DecodeResult>& before_naming = {}, const VdbOptions& vdb = {});

/// What an encoding made, put to the test before its input may go: decodes `encoded` and compares it with the
/// volume `input`. Throws std::runtime_error, which is a bug of ours, if it is not within its bound.
void verify_encoding(const std::string& input, const SourceDescription& source, const std::string& encoded,
                     const Resources& resources);

}  // namespace tagrid
