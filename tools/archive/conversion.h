// The work of `convert`: encodes the volumes of a manifest, each with the entire pipeline.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/files/held_files.h"
#include "pipeline/ranks/ranks.h"
#include "tools/archive/manifest.h"
#include "tools/options/shared_options.h"

namespace tagrid {

/// One of `count` equal parts of a manifest: lines index, index + count, and so on.
struct Shard {
  std::size_t index = 0, count = 1;
};
std::vector<ManifestLine> lines_of(Shard shard, const std::vector<ManifestLine>& lines);

struct ConversionOptions {
  std::string output_dir;
  std::string keys;                ///< the key file of an archive without names; "": it has names
  bool overwrite = false;          ///< replaces existing outputs
  bool skip_done = false;          ///< skips volumes that a record describes as done
  bool trust_description = false;  ///< removes originals even if only the options describe the layout of
                                   ///< their samples
  RunOptions run;                  ///< threads and memory are per rank
};

/// The numbers of lines with each result, and the bytes of the volumes that were encoded or
/// removed. `compared`: those among `ok` that were not encoded, because their outputs existed and
/// contain the volumes.
struct ConversionSums {
  std::uint64_t files = 0, ok = 0, compared = 0, skipped = 0, removed = 0, failed = 0, not_restorable = 0,
                bytes_in = 0, bytes_out = 0;
};

/// Encodes the volumes of `lines`, each on the next rank that is free, and appends a record for each to
/// `results`. A line that fails is reported and recorded, and the next one follows. Throws other failures,
/// such as results that cannot be written. Called by rank 0; the others call serve().
ConversionSums encode_lines(Ranks& ranks, const std::vector<ManifestLine>& lines,
                            const ConversionOptions& options, LineFile& results);
/// Called by the other ranks when rank 0 orders it: see serve().
void obey_conversion(Ranks& ranks, const Bytes& order);

/// Removes the originals of those `lines` whose outputs pass another verification. `all` are the lines of the
/// entire manifest. Records and failures: see encode_lines(). Called by one rank.
ConversionSums remove_originals(const Ranks& ranks, const std::vector<ManifestLine>& lines,
                                const std::vector<ManifestLine>& all, const ConversionOptions& options,
                                LineFile& results);

}  // namespace tagrid
