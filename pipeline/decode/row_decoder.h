// Rows of bricks of a .tag file, decoded into whatever takes samples.
#pragma once

#include <functional>

#include "io/tag/file.h"
#include "pipeline/decode/decoded_rows.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/resources.h"
#include "pipeline/memory/until_it_fails.h"
#include "stages/grid/brick_rows.h"

namespace tagrid {

/// Decodes the bricks of a file: all of them, or one part of them after the other.
class RowDecoder {
 public:
  /// `reader` outlives the decoder, and is not read after it. A reader that waits gives up when samples
  /// cannot be written.
  RowDecoder(TagReader& reader, const DecodeBudget& budget);

  /// Decodes `rows`; their first brick is the one that the reader gives next. Rows go to `write` in the order
  /// of their bricks. Throws what reading, `write` and `watch` throw; what `write` throws counts where several
  /// do.
  void decode(const BrickRows& rows, const std::function<void(const DecodedRows&)>& write,
              const Watch& watch);

 private:
  TagReader& reader_;
  DecodeBudget budget_;
  UntilItFails output_works_;
};

}  // namespace tagrid
