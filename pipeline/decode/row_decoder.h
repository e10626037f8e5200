// Decodes rows of bricks of a .tag file for any consumer of samples.
#pragma once

#include <functional>
#include <utility>

#include "io/tag/blocks.h"
#include "pipeline/decode/decoded_rows.h"
#include "pipeline/decode/values.h"
#include "pipeline/memory/resources.h"
#include "pipeline/progress/progress.h"
#include "pipeline/threads/until_it_fails.h"
#include "stages/grid/brick_rows.h"

namespace tagrid {

/// Decodes the bricks of a file: all at once, or one part after the other.
class RowDecoder {
 public:
  /// Rows have `numbers`.
  RowDecoder(const CodingParameters& parameters, const DecodeBudget& budget, WrittenNumbers numbers = {})
      : parameters_(parameters), budget_(budget), numbers_(std::move(numbers)) {}

  /// Becomes true if samples cannot be written, so that a reader that waits can give up.
  const std::atomic<bool>& failed() const { return output_works_.failed(); }

  /// Decodes `rows`; `bricks` must give the first of them first. Passes rows to `write` in the order of their
  /// bricks. Throws the exceptions of reading, `write` and `watch`. If several fail, the exception of `write`
  /// is thrown.
  void decode(const BrickRows& rows, const BrickStream& bricks,
              const std::function<void(const DecodedRows&)>& write, const Watch& watch);

 private:
  CodingParameters parameters_;
  DecodeBudget budget_;
  WrittenNumbers numbers_;
  UntilItFails output_works_;
};

}  // namespace tagrid
