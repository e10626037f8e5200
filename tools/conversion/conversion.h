// The work of `convert`: volumes of a manifest, one after the other, each by the whole pipeline.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/files/line_file.h"
#include "pipeline/ranks/ranks.h"
#include "tools/conversion/manifest.h"
#include "tools/options/shared_options.h"

namespace tagrid {

/// One of `count` equal parts of a manifest: lines index, index + count, and so on.
struct Shard {
  std::size_t index = 0, count = 1;
};
std::vector<ManifestLine> lines_of(Shard shard, const std::vector<ManifestLine>& lines);

struct ConversionOptions {
  std::string output_dir;
  bool overwrite = false;          ///< outputs that exist
  bool skip_done = false;          ///< what a record says was done before
  bool trust_description = false;  ///< that the options say how headerless samples lie, if originals go
  RunOptions run;                  ///< threads and memory: of each rank
};

/// What came of the lines, and bytes of those that were encoded or removed.
struct ConversionSums {
  std::uint64_t files = 0, ok = 0, skipped = 0, removed = 0, failed = 0, bytes_in = 0, bytes_out = 0;
};

/// Encodes the volumes of `lines`, each by the next of all ranks that has nothing to do, and appends a record
/// of each to `results`. A line that fails is said and recorded, and the next one is done. Throws what goes
/// wrong besides, such as results that cannot be written. By rank 0; the others serve().
ConversionSums encode_lines(Ranks& ranks, const std::vector<ManifestLine>& lines,
                            const ConversionOptions& options, LineFile& results);
/// By the other ranks, where rank 0 ordered it: see serve().
void obey_conversion(Ranks& ranks, const Bytes& order);

/// Encodes nothing: removes the originals of those `lines` whose outputs are found good once more. `all` are
/// those of the manifest. Records and failures as with encode_lines(). By one rank.
ConversionSums remove_originals(const Ranks& ranks, const std::vector<ManifestLine>& lines,
                                const std::vector<ManifestLine>& all, const ConversionOptions& options,
                                LineFile& results);

}  // namespace tagrid
