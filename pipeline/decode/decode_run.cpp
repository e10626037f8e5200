#include "pipeline/decode/decode_run.h"

#include <fmt/format.h>

#include <cmath>

namespace tagrid {

bool WantedRegion::is_all() const {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (low[axis] || high[axis]) return false;
  return step == 1;
}

std::shared_ptr<VolumeSink> open_output(const DecodeRun& run, const VolumeInfo& info,
                                        const WrittenNumbers& numbers, const CodingParameters& parameters,
                                        bool others_write) {
  WriteOptions options = {.files = {.overwrite = run.overwrite,
                                    .like = attributes_of(run.input),
                                    .spool = run.resources.spool,
                                    .others_write = others_write},
                          .wishes = run.wishes,
                          .first_memory = first_memory_of_programs(run.resources.memory)};
  // A value that stands for lost samples can be off by any amount.
  if (parameters.max_error >= 0 && !run.fill)
    options.wishes["max-error"] = fmt::format("{}", numbers.error_in_values(parameters.max_error));
  return create_volume(run.format, run.output, numbers.info(info), options);
}

}  // namespace tagrid
