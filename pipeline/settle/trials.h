// Trial encodings: what a volume would take and lose.
#pragma once

#include <cstdint>
#include <map>
#include <tuple>
#include <vector>

#include "io/volume/volume_source.h"
#include "pipeline/memory/plan.h"
#include "pipeline/progress/progress.h"
#include "stages/grid/brick_grid.h"
#include "stages/sample/coding_parameters.h"
#include "stages/sample/filter_fit.h"

namespace tagrid {

struct Tried {
  double psnr = 0;  ///< in dB; infinite if nothing is lost
  double rmse = 0, max_error = 0;
  double bits = 0;  ///< of a sample, in the blocks of bricks without the grid
};

/// Encodes the voxels of a volume, or of a part of its rows of bricks that is spread over it, and counts what that
/// takes. Each encoding is made once.
class Trials {
 public:
  /// `plan`: for bricks of `parameters`. `usual_edge`: of bricks that are not transformed, and of those of a
  /// part, which has more rows of small bricks; not larger. `peak`: of the PSNR. `most_sampled`: about how many
  /// samples a part has. REQUIRES: source.traits().any_rows, and it outlives this object.
  Trials(VolumeSource& source, CodingParameters parameters, const EncodePlan& plan, int usual_edge,
         double peak, std::int64_t most_sampled, const Progress& progress);

  /// `step`: of a transform; 0: none. `sampled`: whether a part is enough.
  const Tried& of(double max_error, double step, bool sampled);

  /// Fits a filter to a part, encoded with this step. What is encoded from now on has it, where there is a transform.
  void fit_filter(double max_error, double step);
  void set_filter(const FilterWeights& weights);
  const FilterWeights& filter() const { return parameters_.filter; }

  /// How often a sample of the volume was read, on average.
  double times_read() const { return times_read_; }

 private:
  /// False for small volumes, which are their own samples.
  bool has_parts() const;
  /// All rows of each volume, or rows spread over them all.
  std::vector<std::vector<BrickRows>> rows_of_volumes(const BrickGrid& bricks, bool sampled) const;
  Tried encode(const CodingParameters& parameters, bool sampled, FilterSums* filter_sums = nullptr);

  VolumeSource& source_;
  CodingParameters parameters_;
  EncodePlan plan_;
  int usual_edge_;
  double peak_;
  std::int64_t most_sampled_;
  const Progress& progress_;
  std::map<std::tuple<double, double, bool>, Tried> earlier_;
  double times_read_ = 0;
};

}  // namespace tagrid
