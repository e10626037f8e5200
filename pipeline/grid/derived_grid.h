// The grid of samples in memory, for files that store none: computed as the encoder computes those that it stores.
#pragma once

#include <functional>
#include <vector>

#include "pipeline/grid/schedule.h"
#include "pipeline/grid/slices.h"
#include "stages/grid/brick_rows.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// Computes the activity of bricks from slices, which come in the order of z. Marks and bricks are computed on the
/// threads of the arena that adds the slices; the result does not depend on their number.
class DerivedGrid {
 public:
  /// Takes the bricks in the order of their numbers, one at a time. `slices` have the samples of the closed box of the
  /// brick, as far as the volume reaches.
  using Take = std::function<void(const SubdividedBrick& brick)>;

  /// For the bricks of `rows`. `parameters` must outlive the object.
  DerivedGrid(const CodingParameters& parameters, const BrickRows& rows, Take take);

  /// The samples that must be added: slices low.z .. high.z, and of each slice the rows low.y .. high.y.
  const Box& samples() const { return schedule_.samples(); }
  /// The stretches of rows of bricks that own these samples, in the order in which their samples must be added.
  std::vector<BrickRows> stretches() const;
  void add_slice(SliceSamples slice);

 private:
  void subdivide_all(const std::vector<BrickJob>& jobs);

  const CodingParameters& parameters_;
  GridSchedule schedule_;
  Take take_;
};

}  // namespace tagrid
