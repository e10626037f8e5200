#include "io/files/open_source.h"
#include "pipeline/decode/decode_run.h"

#include <fmt/format.h>

#include <cmath>

#include "io/errors/errors.h"
#include "io/files/file_attributes.h"
#include "io/metadata/loss.h"
#include "io/tag/bricks.h"
#include "io/tag/members.h"

namespace tagrid {

std::shared_ptr<const ByteSource> source_of(const DecodeRun& run) {
  std::shared_ptr<const ByteSource> file = open_source(run.input);
  if (run.volume) file = volume_in(std::move(file), *run.volume);
  return run.overview == 0 ? file : overview_in(TagBricks(std::move(file)), run.overview);
}

VolumeInfo with_loss_of(VolumeInfo samples, const CodingParameters& parameters) {
  if (parameters.is_exact()) return samples;
  const double error = parameters.max_error * std::abs(samples.metadata.rescale_of_bounds().slope);
  add_loss(parameters.max_error < 0 ? "tagrid, without a bound"
                                    : fmt::format("tagrid, maximum error {:.6g}", error),
           samples.metadata);
  return samples;
}

KnownFacts known_facts(const TagBricks& file, const WrittenNumbers& numbers) {
  KnownFacts known;
  const CodingParameters& parameters = file.parameters();
  if (parameters.max_error >= 0) known.max_error = numbers.error_in_values(parameters.max_error);
  const Statistics& total = file.index().total;
  known.achieved_error = numbers.error_in_values(total.max_error);
  if (total.low <= total.high) known.range = numbers.range_in_values(total.low, total.high);
  for (const Member& member : file.index().members)
    if (member.is_overview())
      known.levels.push_back({member.factor, overview_dims(parameters.dims, member.factor)});
  return known;
}

namespace {

/// Of a pipe, the index comes too late.
KnownFacts known_facts(const DecodeRun& run, const WrittenNumbers& numbers,
                       const CodingParameters& parameters) {
  const bool is_file = run.input != "-" && is_regular_input(run.input);
  if (run.region.is_all() && !run.fill && is_file) return known_facts(TagBricks(source_of(run)), numbers);
  KnownFacts known;
  if (parameters.max_error >= 0 && !run.fill) known.max_error = numbers.error_in_values(parameters.max_error);
  return known;
}

}  // namespace

DecodeOutput::DecodeOutput(const DecodeRun& run, const VolumeInfo& of_samples, const WrittenNumbers& numbers,
                           const CodingParameters& parameters, bool others_write)
    : run_(run), info_(numbers.info(with_loss_of(of_samples, parameters))) {
  options_.files = {.overwrite = run.overwrite,
                    .like = attributes_of(run.input),
                    .spool = run.resources.spool,
                    .others_write = others_write};
  options_.wishes = run.wishes;
  options_.first_memory = first_memory_of_programs(run.resources.memory);
  // A value that stands for lost samples can be off by any amount.
  if (parameters.max_error >= 0 && !run.fill)
    options_.wishes["max-error"] = fmt::format("{}", numbers.error_in_values(parameters.max_error));
  if (run.format.writes.has_levels) options_.known = known_facts(run, numbers, parameters);
}

WriterProgram DecodeOutput::program() const {
  return {run_.format.writes.program, run_.format.writes.holds_volume};
}

void DecodeOutput::open() {
  if (!sink_) sink_ = create_volume(run_.format, run_.output, info_, options_);
}

std::uint64_t DecodeOutput::memory_of_program() {
  if (run_.format.writes.program.empty()) return 0;
  open();
  return sink_->memory();
}

bool DecodeOutput::any_order() const {
  return run_.format.writes.any_order && is_regular_output(run_.output);
}

std::shared_ptr<VolumeSink> DecodeOutput::begin() {
  require_memory_of_writer(program(), memory_of_program(), run_.resources);
  open();
  return sink_;
}

RowOutput::RowOutput(VolumeSink& sink, const std::optional<std::string>& spool_folder,
                     const std::string& name, std::int64_t first)
    : sink_(sink), first_(first) {
  if (spool_folder) spool_.emplace(SpoolFile::in(*spool_folder, name));
}

void RowOutput::write(const DecodedRows& rows) {
  if (spool_) return through_spool(rows, *spool_);
  const auto write = [&](std::int64_t at, std::span<const std::byte> samples) {
    sink_.write_samples(first_ + at, samples);
  };
  if (!sink_.at_once()) return rows.for_each_part(write);
  rows.for_each_part_at_once(write);
}

void RowOutput::through_spool(const DecodedRows& rows, SpoolFile& spool) {
  const std::size_t size = size_of(sink_.info().type);
  const std::int64_t layer_start = rows.first_of_layer();
  rows.for_each_part([&](std::int64_t first, std::span<const std::byte> samples) {
    spool.write_at(static_cast<std::uint64_t>(first - layer_start) * size, samples);
  });
  if (!rows.end_layer()) return;
  spool.read_back([&](std::span<std::byte> part) { sink_.write_slices(part); });
  spool.clear();
}

}  // namespace tagrid
