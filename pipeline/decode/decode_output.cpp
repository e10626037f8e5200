#include "pipeline/decode/decode_output.h"

#include <fmt/format.h>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "pipeline/memory/of_writer.h"

namespace tagrid {

DecodeOutput::DecodeOutput(const DecodeRun& run, const VolumeInfo& of_samples, const WrittenNumbers& numbers,
                           const CodingParameters& parameters, bool others_write)
    : run_(run), info_(numbers.info(of_samples)) {
  options_.files = {.overwrite = run.overwrite,
                    .like = attributes_of(run.input),
                    .spool = run.resources.spool,
                    .others_write = others_write};
  options_.wishes = run.wishes;
  options_.first_memory = first_memory_of_programs(run.resources.memory);
  // A value that stands for lost samples can be off by any amount.
  if (parameters.max_error >= 0 && !run.fill)
    options_.wishes["max-error"] = fmt::format("{}", numbers.error_in_values(parameters.max_error));
}

WriterProgram DecodeOutput::program() const { return {run_.format.writer, run_.format.writer_keeps_volume}; }

void DecodeOutput::open() {
  if (!sink_) sink_ = create_volume(run_.format, run_.output, info_, options_);
}

std::uint64_t DecodeOutput::memory_of_program() {
  if (run_.format.writer.empty()) return 0;
  open();
  return sink_->memory();
}

std::uint64_t DecodeOutput::memory() { return run_.format.memory(info_) + memory_of_program(); }

bool DecodeOutput::any_order() const { return run_.format.any_order && is_regular_output(run_.output); }

void DecodeOutput::refuse(const MemoryLimit& limit) {
  const std::uint64_t bytes = memory_of_program();
  if (bytes == 0) throw limit;
  throw_for_writer(limit, program(), bytes);
}

std::shared_ptr<VolumeSink> DecodeOutput::begin() {
  require_memory_of_writer(program(), memory_of_program(), run_.resources);
  open();
  return sink_;
}

}  // namespace tagrid
