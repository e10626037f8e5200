// The work of `convert`: volumes of a manifest, one after the other, each by the whole pipeline.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "io/line_file.h"
#include "tools/manifest.h"
#include "tools/shared_options.h"

namespace tagrid {

/// Hands out the index of the next line to be done, or nothing when there is none left. Which lines, and in
/// which order, is up to it: the shards of a manifest, or processes that draw from one counter.
using NextLine = std::function<std::optional<std::size_t>()>;

/// One of `count` equal parts of a manifest: lines index, index + count, and so on.
struct Shard {
  std::size_t index = 0, count = 1;
};
NextLine lines_of(Shard shard, std::size_t lines);

struct ConversionOptions {
  std::string output_dir;
  bool overwrite = false;        ///< outputs that exist
  bool skip_done = false;        ///< what a record says was done before
  bool remove_verified = false;  ///< nothing is encoded: originals of verified outputs are removed
  RunOptions run;
};

/// What came of the lines, and bytes of those that were encoded or removed.
struct ConversionSums {
  std::uint64_t files = 0, ok = 0, skipped = 0, removed = 0, failed = 0, bytes_in = 0, bytes_out = 0;
};

/// Does the lines that `next` hands out, and appends a record of each to `results`. A line that fails is said
/// and recorded, and the next one is done. Throws what goes wrong besides, such as results that cannot be
/// written.
ConversionSums convert_lines(const std::vector<ManifestLine>& lines, const NextLine& next,
                             const ConversionOptions& options, LineFile& results);

}  // namespace tagrid
