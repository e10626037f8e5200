// The settings of an encoding of one volume, in the units of its samples, as far as its header gives them.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/volume/volume_source.h"
#include "pipeline/job/options.h"
#include "stages/sample/coding_parameters.h"

namespace tagrid {

/// The edge of bricks in root cubes of this size, if none is given and nothing is transformed.
constexpr int usual_brick_edge(int cube_size) { return std::max(2, 64 / cube_size); }

/// The value range for which grids of integers of 8 and 16 bits are made, if no other is asked for. {0, 0} for other
/// types, whose range follows from the samples.
std::pair<double, double> usual_range(SampleType type);

/// The options of an encoding, resolved for one volume before a sample is read. Two encodings are the same if
/// these are: where a step of the samples is 1, errors of 0.9 and of 0.1 are both none.
struct ResolvedOptions {
  EncodeOptions options;  ///< bounds, range and scale are those of samples, not of values
  /// Complete, unless `range_from_data` or options.error_rule say what only the samples tell.
  CodingParameters parameters;
  int volumes = 1;               ///< in the file
  std::vector<int> overviews;    ///< their factors
  bool range_from_data = false;  ///< the value range and the field scale follow from the samples
  Metadata metadata;             ///< that the file keeps
  std::string reason_of_bound;   ///< how a bound of samples follows from that of values; "" if it is the same
  std::string volume;            ///< its name, for messages

  /// The edge of bricks that are not transformed, in root cubes.
  int usual_edge() const { return options.brick_edge.value_or(usual_brick_edge(parameters.cube_size)); }
};

/// Throws UsageError if the volume does not allow the options, or if the scale of bounded values is unknown.
ResolvedOptions in_samples(const EncodeOptions& options, const SourceFacts& source);

/// The settings of an encoding by name, as text, for messages and to compare two runs.
std::vector<std::pair<std::string, std::string>> in_words(const CodingParameters& parameters);

/// The options with this largest error of samples. Throws UsageError if the other options do not allow it.
/// `transform_step`: see CodingParameters; if it is 0, bricks are of the usual size, unless their size was given.
ResolvedOptions with_bound(ResolvedOptions options, std::optional<double> max_error,
                           double transform_step = 0, const FilterWeights& filter = {});

/// The parameters for this range of the samples. Throws UsageError if the volume does not allow it.
CodingParameters with_range(const ResolvedOptions& options, std::pair<double, double> range);

}  // namespace tagrid
