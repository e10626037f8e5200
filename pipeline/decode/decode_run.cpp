#include "pipeline/decode/decode_run.h"

namespace tagrid {

bool WantedRegion::is_all() const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (low[axis] || high[axis]) return false;
  return step == 1;
}

std::shared_ptr<VolumeWriter> open_output(const DecodeRun& run, const VolumeInfo& info,
                                          const CodingParameters& parameters, bool others_write) {
  VdbOptions grid = run.vdb;
  grid.max_error = parameters.max_error >= 0 ? std::optional(parameters.max_error) : std::nullopt;
  return std::make_shared<VolumeWriter>(open_volume_writer(run.output, run.format, info, run.overwrite,
                                                           attributes_of(run.input), grid, others_write));
}

}  // namespace tagrid
