#include "pipeline/decode/decode_run.h"

namespace tagrid {

bool WantedRegion::is_all() const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (low[axis] || high[axis]) return false;
  return step == 1;
}

std::shared_ptr<VolumeSink> open_output(const DecodeRun& run, const VolumeInfo& info,
                                        const CodingParameters& parameters, bool others_write) {
  VdbOptions grid = run.vdb;
  grid.max_error = parameters.max_error >= 0 ? std::optional(parameters.max_error) : std::nullopt;
  const SinkOptions files = {
      .overwrite = run.overwrite, .like = attributes_of(run.input), .others_write = others_write};
  return run.format.create(run.output, info, {.files = files, .vdb = grid});
}

}  // namespace tagrid
