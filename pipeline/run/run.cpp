#include "pipeline/run/run.h"

#include <stdexcept>
#include <utility>

#include "io/files/errors.h"
#include "io/files/output_file.h"
#include "io/files/unchanged_files.h"
#include "io/formats/open_volume.h"
#include "io/nrrd/geometry.h"
#include "io/samples/spooled.h"
#include "io/tag/bricks.h"
#include "io/tag/file.h"
#include "pipeline/decode/row_decoder.h"
#include "pipeline/decode/row_output.h"
#include "pipeline/encode/row_encoder.h"
#include "pipeline/encode/slices_ahead.h"
#include "pipeline/estimate/plain_bound.h"
#include "pipeline/memory/of_writer.h"
#include "pipeline/memory/plan.h"
#include "pipeline/parts/decode_parts.h"
#include "pipeline/parts/encode_parts.h"
#include "pipeline/parts/verify_parts.h"
#include "pipeline/parts/work_orders.h"
#include "pipeline/region/decode_region.h"
#include "pipeline/restore/restore.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {
namespace {

// True if parts can be read and written independently: from a file or a folder to a file.
bool parts_are_possible(const std::string& input, const std::string& output) {
  return is_file_or_folder(input) && is_regular_output(output);
}

FinishedEncode encode_at_once(const EncodeRun& run, const Resources& resources) {
  check_output(run.output, run.overwrite);
  std::unique_ptr<VolumeSource> volume = open_volume(run.input, run.source);
  for (const std::string& file : volume->files()) refuse_same_file(file, run.output);
  const UnchangedFiles files(volume->files());
  // Checked before anything is read: a limit that cannot be kept is reported at once.
  const SourceTraits& traits = volume->traits();
  const auto [options, reason] = for_samples(run.options, volume->facts());
  const EncodePlan plan =
      plan_encoding(parameters_but_scale(options, volume->info()), resources, traits.any_rows,
                    traits.memory + memory_of_files(run, *volume), original_access(run, *volume));
  EncodeResult result;
  result.memory = plan.memory;
  const bool copied = options.error_rule && !traits.any_rows && !resources.spool.empty();
  if (copied) volume = spooled(std::move(volume), resources.spool);
  const PlainBound plain = with_plain_bound(options, *volume, plan.budget.threads, run.searching);
  result.warnings = all_warnings(volume->facts());
  result.lossy_source = text_of_key(volume->info().nrrd_fields, lossy_source_key);
  result.reason_of_bound = plain.reason.empty() ? reason : plain.reason;
  const bool reads_range = takes_range_from_data(plain.options, *volume);
  result.header = {resolve(plain.options, *volume), kept_fields(plain.options, volume->info())};
  const CodingParameters& parameters = result.header.parameters;
  const OutputFileOptions like = {.like = attributes_of(volume->files().back())};
  const auto file = std::make_shared<OutputFile>(run.output, run.overwrite, like);
  TagWriter writer(*file, result.header);

  const bool spools = plan.spooled && !copied;
  if (spools) volume = spooled(std::move(volume), resources.spool);
  // Only programs give nothing but whole slices; they decode them while bricks are encoded.
  const std::int64_t layer = std::min(parameters.bricks().length(), parameters.dims.z);
  const std::int64_t count =
      volume->traits().whole_slices ? slices_beside(parameters, plan, resources, layer) : 0;
  result.memory += static_cast<std::uint64_t>(count) * volume->slice_bytes();
  SlicesAhead ahead(*volume, count);
  RowEncoder encoder(parameters, plan, [&](const Box& rows) { return ahead.read(rows); });
  ahead.stop_when(encoder.failed());
  const BrickRows all = BrickRows::all(parameters.bricks());
  encoder.encode(all, writer,
                 watch_for(run.progress, sample_bytes(parameters.dims, parameters.type).value()));
  ahead.end();
  const KeepingFiles kept = keep_source_files(
      *volume, parameters, run.keep_files && !plain.options.strip,
      [&](SourceFiles& source, bool exact) { look_at_contents(source, exact, plan.budget.threads); },
      [&](std::span<const std::byte> bytes) { writer.write_envelope(bytes); });
  result.why_not_restorable = kept.why_not_restorable;
  // Samples and other bytes must be those of the same files.
  if (run.keep_files) files.require();
  warn_of_touched(run, files, result);
  writer.finish();
  result.index = writer.index();
  result.bytes_in = volume->bytes_read();
  result.times_read =
      times_read(parameters, plan, {all}) + (spools || copied) + reads_range + kept.times_read;
  result.file_bytes = file->position();
  result.temporary = file->temporary();
  return {std::move(result), file};
}

DecodePlan plan_of(const DecodeRun& run, const CodingParameters& parameters, const VolumeInfo& info,
                   const WrittenNumbers& numbers, std::uint64_t of_writer, const Resources& resources) {
  const bool any_order = run.format.any_order && is_regular_output(run.output);
  const WriterProgram writer{run.format.writer, run.format.writer_keeps_volume};
  const DecodePlan plan = plan_with_writer(writer, of_writer, [&] {
    return plan_decoding(parameters, resources, any_order ? DecodeUse::write : DecodeUse::stream,
                         run.format.memory(info) + of_writer, numbers.value_bytes());
  });
  require_memory_of_writer(writer, of_writer, resources);
  return plan;
}

/// The index is at the end of a file. It is read only where something depends on it.
WrittenNumbers numbers_of_stream(const DecodeRun& run, const TagHeader& header) {
  if (!depends_on_range(run.format, run.numbers, header) || !is_regular_input(run.input))
    return written_numbers(run.format, run.numbers, header, nullptr);
  const TagBricks file(std::make_shared<FileSource>(run.input));
  return written_numbers(run.format, run.numbers, header, &file.index());
}

FinishedDecode decode_at_once(const DecodeRun& run, const Resources& resources) {
  TagReader reader(run.input);
  const CodingParameters& parameters = reader.parameters();
  const WrittenNumbers numbers = numbers_of_stream(run, reader.header());
  const VolumeInfo info = volume_info_of(reader.header());
  const auto [sink, plan] = open_planned(run, info, numbers, parameters, false, [&](std::uint64_t of_writer) {
    return plan_of(run, parameters, info, numbers, of_writer, resources);
  });
  RowOutput output(*sink, plan.spooled ? resources.spool : "", run.output);
  RowDecoder decoder(parameters, plan.budget, numbers);
  reader.stop_when(decoder.failed());
  decoder.decode(
      BrickRows::all(parameters.bricks()), reader.bricks(),
      [&](const DecodedRows& rows) { output.write(rows); },
      watch_for(run.progress, sample_bytes(parameters.dims, numbers.type(parameters.type)).value()));
  return {{reader.header(), reader.index(), reader.sizes().file, sink->bytes_written(), plan.memory,
           sink->facts(), sink->warnings(), numbers},
          sink};
}

FinishedDecode decode_to_parts(Ranks& ranks, const DecodeRun& run, const Resources& resources) {
  TagSummary file = summary_of(run.input);
  const CodingParameters& parameters = file.header.parameters;
  const VolumeInfo info = volume_info_of(file.header);
  const WrittenNumbers numbers = written_numbers(run.format, run.numbers, file.header, &file.index);
  const auto [sink, plan] = open_planned(run, info, numbers, parameters, true, [&](std::uint64_t of_writer) {
    return plan_of(run, parameters, info, numbers, of_writer, resources);
  });
  const VolumeSink::Place place = sink->place();
  const DecodeOrder order{run.input, place.file, place.name, place.start, numbers, run.resources};
  send_order(ranks, order);
  decode_parts(ranks, order, run.progress);
  sink->samples_were_placed();
  return {{std::move(file.header), std::move(file.index), file.sizes.file, sink->bytes_written(), plan.memory,
           sink->facts(), sink->warnings(), numbers},
          sink};
}

}  // namespace

FinishedEncode encode_volume(Ranks& ranks, const EncodeRun& run) {
  run.options.validate();
  refuse_same_file(run.input, run.output);
  if (run.resume || (ranks.count() > 1 && parts_are_possible(run.input, run.output)))
    return encode_in_parts(ranks, run);
  return encode_at_once(run, of_this_rank(ranks, run.resources));
}

FinishedDecode decode_volume(Ranks& ranks, const DecodeRun& run) {
  refuse_same_file(run.input, run.output);
  refuse_same_file(run.input, samples_path(run.output, run.format));
  const Resources resources = of_this_rank(ranks, run.resources);
  if (!run.region.is_all() || run.fill) return decode_region(run, resources);
  const bool in_parts =
      ranks.count() > 1 && run.format.any_order && parts_are_possible(run.input, run.output);
  return in_parts ? decode_to_parts(ranks, run, resources) : decode_at_once(run, resources);
}

VerifyResult verify_file(Ranks& ranks, const VerifyRun& run) {
  TagReader reader(run.input);
  const bool is_file = attributes_of(run.input).has_value();
  VerifySetup setup = verify_setup(reader.name(), reader.parameters(), run.original, run.source,
                                   of_this_rank(ranks, run.resources),
                                   is_file && run.resources.memory ? memory_of_envelope(run.input) : 0);
  const std::string fields_of_original = setup.fields_of_original;
  const bool has_scale = !setup.is_original_headerless;
  const auto verified = [&] {
    if (ranks.count() == 1 || !setup.any_order || !is_file)
      return verify_all(reader, std::move(setup), run.progress);
    const VerifyOrder order{run.input, run.original, run.source, run.resources};
    send_order(ranks, order);
    return verify_parts(ranks, order, std::move(setup), run.progress);
  };
  VerifyResult result = verified();
  if (!run.original.empty())
    result.geometry = compare_geometry(result.header.nrrd_fields, fields_of_original, has_scale);
  // Of a pipe, only the checksums of the envelope are checked.
  if (is_file) source_files_of(TagBricks(std::make_shared<FileSource>(run.input)));
  return result;
}

void verify_encoding(const std::string& input, const SourceDescription& source, const std::string& encoded,
                     const UnchangedFiles& files, const Resources& resources) {
  try {
    Ranks alone;
    const VerifyResult found =
        verify_file(alone, {.input = encoded, .original = input, .source = source, .resources = resources});
    if (!found.geometry.differences.empty())
      throw BrokenInput(encoded + ": " + found.geometry.differences.front());
    const TagBricks file(std::make_shared<FileSource>(encoded));
    if (file.sizes().envelope > 0) {
      const auto volume = open_volume(input, source);
      require_same(compare_source_files(file, *volume, resources.threads), volume->name());
    }
  } catch (const BrokenInput& broken) {
    files.require();
    if (const std::string touched = files.touched(); !touched.empty())
      throw BrokenInput(touched + ": was changed while it was being read");
    throw std::runtime_error(std::string(broken.what()) + "; the input was kept");
  }
  files.require();
}

}  // namespace tagrid
