// Decodes rows of bricks of a .tag file for any consumer of samples.
#pragma once

#include <functional>

#include "io/tag/file.h"
#include "pipeline/decode/decoded_rows.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/resources.h"
#include "pipeline/memory/until_it_fails.h"
#include "stages/grid/brick_rows.h"

namespace tagrid {

/// Decodes the bricks of a file: all at once, or one part after the other.
class RowDecoder {
 public:
  /// `reader` must outlive the decoder, and must not be read after it. A reader that waits gives up if
  /// samples cannot be written.
  RowDecoder(TagReader& reader, const DecodeBudget& budget);

  /// Decodes `rows`; `reader` must be at their first brick. Passes rows to `write` in the order of their
  /// bricks. Throws the exceptions of reading, `write` and `watch`. If several fail, the exception of `write`
  /// is thrown.
  void decode(const BrickRows& rows, const std::function<void(const DecodedRows&)>& write,
              const Watch& watch);

 private:
  TagReader& reader_;
  DecodeBudget budget_;
  UntilItFails output_works_;
};

}  // namespace tagrid
