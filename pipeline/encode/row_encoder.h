// Rows of bricks, from whatever gives samples to whatever takes bricks.
#pragma once

#include <atomic>
#include <functional>
#include <vector>

#include "io/tag/blocks.h"
#include "pipeline/encode/slices.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/progress.h"
#include "pipeline/memory/until_it_fails.h"
#include "stages/grid/brick_rows.h"
#include "stages/volume/coding_parameters.h"

namespace tagrid {

/// Encodes the bricks of a volume as a plan says: all of them, or one part of them after the other.
class RowEncoder {
 public:
  /// Reads whole rows of one slice, of one z after the other.
  using ReadSlice = std::function<SliceSamples(const Box& rows)>;

  /// `parameters` outlive the encoder.
  RowEncoder(const CodingParameters& parameters, EncodePlan plan, ReadSlice read_slice);

  /// Encodes `rows` into `sink`. Throws what reading, the sink and `watch` throw; what the sink throws counts
  /// where several do.
  void encode(const BrickRows& rows, BrickSink& sink, const Watch& watch);
  /// Becomes true when a sink fails: a source that waits for samples may then give up.
  const std::atomic<bool>& failed() const { return output_works_.failed(); }

 private:
  const CodingParameters& parameters_;
  EncodePlan plan_;
  ReadSlice read_slice_;
  UntilItFails output_works_;
};

/// How often a sample of a volume is read to encode all `parts` of it, on average.
double times_read(const CodingParameters& parameters, const EncodePlan& plan,
                  const std::vector<BrickRows>& parts);

}  // namespace tagrid
