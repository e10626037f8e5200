// Encodes rows of bricks, from any source of samples to any sink of bricks.
#pragma once

#include <atomic>
#include <functional>
#include <vector>

#include "io/tag/blocks.h"
#include "pipeline/grid/slices.h"
#include "pipeline/memory/plan.h"
#include "pipeline/progress/progress.h"
#include "pipeline/threads/until_it_fails.h"
#include "stages/grid/box.h"
#include "stages/grid/brick_rows.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// Encodes the bricks of a volume according to a plan: all at once, or one part after the other.
class RowEncoder {
 public:
  /// Reads complete rows of one slice. Slices come in the order of z.
  using ReadSlice = std::function<SliceSamples(const Box& rows)>;

  /// `parameters` must outlive the encoder.
  RowEncoder(const CodingParameters& parameters, EncodePlan plan, ReadSlice read_slice);

  /// Encodes `rows` into `sink`. Throws the exceptions of reading, of the sink and of `watch`. If several
  /// fail, the exception of the sink is thrown.
  void encode(const BrickRows& rows, BrickSink& sink, const Watch& watch);
  /// Becomes true when a sink fails. A source that waits for samples may then give up.
  const std::atomic<bool>& failed() const { return output_works_.failed(); }

 private:
  const CodingParameters& parameters_;
  EncodePlan plan_;
  ReadSlice read_slice_;
  UntilItFails output_works_;
};

/// The samples that are read to encode `rows`, box after box; of each box, slice after slice.
std::vector<Box> samples_in_order(const CodingParameters& parameters, const EncodePlan& plan,
                                  const BrickRows& rows);

/// How often a sample of a volume is read, on average, to encode all `parts`.
double times_read(const CodingParameters& parameters, const EncodePlan& plan,
                  const std::vector<BrickRows>& parts);

}  // namespace tagrid
