// Encodes rows of bricks: the flow graph that turns slices into bricks.
#pragma once

#include <span>
#include <vector>

#include "io/tag/blocks.h"
#include "pipeline/grid/schedule.h"
#include "pipeline/job/job.h"
#include "pipeline/memory/plan.h"
#include "pipeline/overview/sums.h"
#include "pipeline/progress/progress.h"
#include "pipeline/slices/slice_source.h"
#include "stages/grid/box.h"
#include "stages/grid/brick_grid.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// The stretches of rows that must be encoded for `rows`, which is the last of them.
std::vector<BrickRows> rows_to_encode(const CodingParameters& parameters, const BrickRows& rows);

/// The schedule for one of these stretches.
GridSchedule schedule_of_encoding(const CodingParameters& parameters, const BrickRows& rows);

/// Encodes `rows` of the bricks of a job, strip by strip as its plan says, and returns when the last brick has
/// been written. Bricks do not depend on the plan. They come to `bricks` in the order of their numbers, and
/// slices are read in the order of z, strip after strip. If the mesh has a bound, its error is measured along
/// the way. If its values on the low faces depend on the coding of bricks below, those are encoded first and
/// not written. `sums` takes the sums of the blocks that belong to the rows, unless it is nullptr. Throws the
/// exceptions of `slices`, `bricks`, `watch` and `sums`; that of `bricks` if several fail.
void encode(const EncodeJob& job, const BrickRows& rows, SliceSource& slices, BrickSink& bricks, Watch& watch,
            SumsSink* sums = nullptr);
/// The same for stretches of rows, one after the other.
void encode(const EncodeJob& job, std::span<const BrickRows> stretches, SliceSource& slices,
            BrickSink& bricks, Watch& watch, SumsSink* sums = nullptr);

/// The samples that are read to encode `rows`, box after box; of each box, slice after slice.
std::vector<Box> samples_in_order(const CodingParameters& parameters, const EncodePlan& plan,
                                  const BrickRows& rows);

/// How often a sample of a volume is read, on average, to encode all `parts`.
double times_read(const CodingParameters& parameters, const EncodePlan& plan,
                  const std::vector<BrickRows>& parts);

}  // namespace tagrid
