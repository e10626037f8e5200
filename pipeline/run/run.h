// Complete runs: a volume is encoded to a .tag file, the file is decoded, or the file is verified. A volume
// is one part, on which this process works, or many parts, which all ranks share. The choice is made here.
#pragma once

#include <memory>
#include <string>

#include "io/files/file_attributes.h"
#include "pipeline/decode/decode_run.h"
#include "pipeline/encode/encode_run.h"
#include "pipeline/memory/resources.h"
#include "pipeline/ranks/ranks.h"
#include "pipeline/verify/verify.h"

namespace tagrid {

// Rank 0 calls these functions, the others serve(). If one throws, no output is left under its name.

/// Encodes a volume. From file to file, permissions and time are kept, and all ranks share the work. Throws
/// BrokenInput, WorldError, and UsageError; also if a run cannot be continued: different settings, a
/// different input, or another process that is working on it.
FinishedEncode encode_volume(Ranks& ranks, const EncodeRun& run);

/// Decodes a .tag file, or a region of it. Permissions and time are kept. All ranks share the work for an
/// entire volume from file to file, but not to OpenVDB, whose leaves have no places known beforehand.
FinishedDecode decode_volume(Ranks& ranks, const DecodeRun& run);

/// Decodes all of a .tag file and throws BrokenInput at the first error: a wrong checksum, a brick that does
/// not decode, a grid that is not conforming, a face on which two bricks disagree, or wrong statistics; with
/// an original, also a voxel or a mesh beyond its bound. Differences of geometry are in the result. All ranks
/// share the work if the file and the original can be read in any order (no pipe, no compressed original).
VerifyResult verify_file(Ranks& ranks, const VerifyRun& run);

/// Verifies an encoding before its input may be removed: compares `encoded` with the volume `input` and, if
/// it keeps them, with the source files. `files` were watched since before the encoding. Throws BrokenInput
/// if one has changed, and std::runtime_error, which means a bug, if the file is not within its bound.
void verify_encoding(const std::string& input, const SourceDescription& source, const std::string& encoded,
                     const UnchangedFiles& files, const Resources& resources);

/// Throws BrokenInput unless the existing output of `run` is what encoding with this job would
/// write: the header, members and source files must be the same, and every sample within the bound.
/// Parity that `run` does not ask for may have been added. `original` is the volume of `run`. Also
/// throws WorldError.
VerifyResult require_result(const EncodeRun& run, const EncodeJob& job, const VolumeSource& original,
                            const Resources& resources);

/// Two ways to encode a volume; encode_volume() chooses one. They throw as it does.
/// This process writes a stream, front to back. `resources` are its own.
FinishedEncode encode_to_stream(const EncodeRun& run, const Resources& resources);
/// All ranks make parts, which become a file. With run.resume, a later run can continue.
FinishedEncode encode_in_parts(Ranks& ranks, const EncodeRun& run);

}  // namespace tagrid
