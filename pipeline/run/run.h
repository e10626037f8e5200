// Whole runs: a volume to a .tag file, back, and the file put to the test. A volume is one part, worked on by
// this process, or many, which all ranks share: that is decided here.
#pragma once

#include <string>

#include "pipeline/decode/decode_run.h"
#include "pipeline/encode/encode_run.h"
#include "pipeline/ranks/ranks.h"
#include "pipeline/verify/verify.h"

namespace tagrid {

// To be called by rank 0; the others serve(). Where they throw, nothing is left under the name of the output.

/// Encodes a volume. From file to file the permissions and the time of the samples are kept. Throws
/// BrokenInput, WorldError, UsageError; also where a run cannot be continued, and says why: other settings,
/// another input, or another process that is at it. By all ranks from a file to a file, else by this one.
FinishedEncode encode_volume(Ranks& ranks, const EncodeRun& run);

/// Decodes a .tag file, or a region of it. From file to file the permissions and the time are kept. By all
/// ranks a whole volume from a file to a file, as the leaves of an OpenVDB file have no place that is known
/// beforehand; else by this one.
FinishedDecode decode_volume(Ranks& ranks, const DecodeRun& run);

/// Decodes all of a .tag file and throws BrokenInput at the first thing that is wrong: a checksum, a brick that
/// does not decode, an activity that is not conforming, a face on which two bricks disagree, statistics that
/// do not fit. With an original also a voxel that is further from it than the file's bound, with its
/// coordinates and both values, and a mesh that is further from it than its bound. By all ranks where file and
/// original can be read in any order: no pipes, no compressed original; else by this one.
VerifyResult verify_file(Ranks& ranks, const VerifyRun& run);

/// What an encoding made, put to the test before its input may go: decodes `encoded` and compares it with the
/// volume `input`. Throws std::runtime_error, which is a bug of ours, if it is not within its bound.
void verify_encoding(const std::string& input, const SourceDescription& source, const std::string& encoded,
                     const Resources& resources);

}  // namespace tagrid
