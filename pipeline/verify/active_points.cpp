#include "pipeline/verify/verify.h"

#include <utility>

#include "io/files/file_attributes.h"
#include "pipeline/decode/graph.h"
#include "pipeline/grid/schedule.h"
#include "stages/brick/codec.h"

namespace tagrid {

Statistics count_active_points(TagReader& reader, const Resources& resources, const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  const DecodePlan plan = plan_decoding(parameters, resources, DecodeUse::mesh);
  ProgressWatch watch(progress, sample_bytes(parameters.dims, parameters.type).value());
  const BrickRows all = BrickRows::all(parameters.bricks());
  Statistics counted;
  DerivedGrid grid(parameters, all, [&](const SubdividedBrick& brick) {
    count_active(brick.active, parameters, brick.brick, counted);
  });
  RowsTo sink([&](const DecodedRows& decoded) {
    decoded.for_each_slice(grid.samples(), [&](SliceSamples slice) { grid.add_slice(std::move(slice)); });
  });
  decode({parameters, plan.budget, all}, reader, sink, watch);
  return counted;
}

TagSummary summary_with_levels(const std::string& path, const Resources& resources,
                               const Progress& progress) {
  // A pipe can be read only once.
  std::optional<Statistics> of_all;
  if (is_regular_input(path)) {
    TagSummary summary = summary_of(path);
    if (summary.header.parameters.counts_points()) return summary;
    of_all = summary.statistics;
  }
  TagReader reader(path);
  Statistics counted;
  const bool stored = reader.parameters().counts_points();
  if (stored)
    reader.read_to_end();
  else
    counted = count_active_points(reader, resources, progress);
  TagSummary summary = summary_of(reader);
  if (!stored) summary.index.total.active = counted.active;
  if (of_all) summary.statistics = of_all;
  return summary;
}

}  // namespace tagrid
