// Complete runs: a volume is encoded to a .tag file, the file is decoded, or the file is verified. A volume
// is one part, on which this process works, or many parts, which all ranks share. The choice is made here.
#pragma once

#include <memory>
#include <string>

#include "io/files/unchanged_files.h"
#include "pipeline/decode/decode_run.h"
#include "pipeline/encode/encode_run.h"
#include "pipeline/memory/resources.h"
#include "pipeline/ranks/ranks.h"
#include "pipeline/verify/verify.h"

namespace tagrid {

// Rank 0 calls these functions; the other ranks call serve(). If one throws, no output is left under its
// name.

/// Encodes a volume. If input and output are files, the permissions and the time of the samples are kept.
/// Throws BrokenInput, WorldError, UsageError. Also throws if a run cannot be continued; the message says
/// why: different settings, a different input, or another process that is working on it. All ranks share the
/// work if input and output are files; otherwise this process does it alone.
FinishedEncode encode_volume(Ranks& ranks, const EncodeRun& run);

/// Decodes a .tag file, or a region of it. If input and output are files, permissions and time are kept. All
/// ranks share the work for an entire volume from a file to a file; otherwise this process does it alone. The
/// same applies to OpenVDB output, because the places of its leaves in the file are not known beforehand.
FinishedDecode decode_volume(Ranks& ranks, const DecodeRun& run);

/// Decodes all of a .tag file and throws BrokenInput at the first error: a wrong checksum, a brick that does
/// not decode, an activity that is not conforming, a face on which two bricks disagree, or wrong statistics.
/// With an original, also a voxel that differs from it by more than the file's bound, with its coordinates
/// and both values, and a mesh that differs by more than its bound. What both say of the geometry is
/// compared, and differences are in the result. All ranks share the work if the file and the original can be
/// read in any order: no pipe, no compressed original. Otherwise this process does it alone.
VerifyResult verify_file(Ranks& ranks, const VerifyRun& run);

/// Verifies an encoding before its input may be removed: decodes `encoded` and compares it with the volume
/// `input`; if it keeps the source files, also with these. `files` are those of the volume, since before it
/// was encoded. Throws BrokenInput if one of them has changed, also if that is within the bound;
/// std::runtime_error, which means a bug in tagrid, if the file is not within its bound.
void verify_encoding(const std::string& input, const SourceDescription& source, const std::string& encoded,
                     const UnchangedFiles& files, const Resources& resources);

/// Encodes a volume into a store. `resources` are those of this process. Throws as encode_volume() does.
FinishedEncode encode_into(std::shared_ptr<BrickStore> store, const EncodeRun& run,
                           const Resources& resources);

/// A store that writes one stream, which this process encodes. Both arguments must outlive all calls but
/// commit().
std::unique_ptr<BrickStore> store_of_stream(const EncodeRun& run, const Resources& resources);

}  // namespace tagrid
