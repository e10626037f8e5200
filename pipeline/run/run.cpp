#include "pipeline/run/run.h"

#include <stdexcept>

#include "io/files/errors.h"
#include "io/files/output_file.h"
#include "io/formats/open_volume.h"
#include "io/samples/spooled.h"
#include "pipeline/decode/row_decoder.h"
#include "pipeline/decode/row_output.h"
#include "pipeline/encode/input_slices.h"
#include "pipeline/encode/row_encoder.h"
#include "pipeline/memory/plan.h"
#include "pipeline/parts/decode_parts.h"
#include "pipeline/parts/encode_parts.h"
#include "pipeline/parts/verify_parts.h"
#include "pipeline/parts/work_orders.h"
#include "pipeline/region/decode_region.h"
#include "pipeline/verify/verifier.h"

namespace tagrid {
namespace {

// True if parts can be read and written independently: from a file to a file.
bool parts_are_possible(const std::string& input, const std::string& output) {
  return attributes_of(input).has_value() && is_regular_output(output);
}

FinishedEncode encode_at_once(const EncodeRun& run, const Resources& resources) {
  check_output(run.output, run.overwrite);
  std::unique_ptr<VolumeSource> volume = open_volume(run.input, run.source);
  for (const std::string& file : volume->files()) refuse_same_file(file, run.output);
  // Checked before anything is read: a limit that cannot be kept is reported at once.
  const EncodePlan plan = plan_encoding(parameters_but_scale(run.options, volume->info()), resources,
                                        volume->traits().any_rows, volume->traits().memory);
  EncodeResult result;
  result.memory = plan.memory;
  const bool reads_range = takes_range_from_data(run.options, *volume);
  result.header = {resolve(run.options, *volume), volume->info().nrrd_fields};
  const CodingParameters& parameters = result.header.parameters;
  const OutputFileOptions like = {.like = attributes_of(volume->files().back())};
  const auto file = std::make_shared<OutputFile>(run.output, run.overwrite, like);
  TagWriter writer(*file, result.header);

  if (plan.spooled) volume = spooled(std::move(volume), resources.spool);
  RowEncoder encoder(parameters, plan, slices_of(*volume));
  volume->stop_when(encoder.failed());
  const BrickRows all = BrickRows::all(parameters.bricks());
  encoder.encode(all, writer,
                 watch_for(run.progress, sample_bytes(parameters.dims, parameters.type).value()));
  writer.finish();
  result.index = writer.index();
  result.bytes_in = volume->bytes_read();
  result.times_read = times_read(parameters, plan, {all}) + plan.spooled + reads_range;
  result.file_bytes = file->position();
  result.temporary = file->temporary();
  return {std::move(result), file};
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
  if (!run.region.is_all()) return decode_region(run, resources);
  const bool in_parts =
      ranks.count() > 1 && run.format.any_order && parts_are_possible(run.input, run.output);
  TagReader reader(run.input);
  if (in_parts) reader.read_index();
  const CodingParameters& parameters = reader.parameters();
  const VolumeInfo info = volume_info_of(reader.header());
  const bool any_order = run.format.any_order && is_regular_output(run.output);
  const DecodePlan plan = plan_decoding(
      parameters, resources, any_order ? DecodeUse::write : DecodeUse::stream, run.format.memory(info));
  const auto sink = open_output(run, info, parameters, in_parts);
  if (in_parts) {
    const VolumeSink::Place place = sink->place();
    const DecodeOrder order{run.input, place.file, place.name, place.start, run.resources};
    send_order(ranks, order);
    decode_parts(ranks, order, run.progress);
    sink->samples_were_placed();
  } else {
    RowOutput output(*sink, plan.spooled ? resources.spool : "", run.output);
    RowDecoder(reader, plan.budget)
        .decode(
            BrickRows::all(parameters.bricks()), [&](const DecodedRows& rows) { output.write(rows); },
            watch_for(run.progress, sample_bytes(parameters.dims, parameters.type).value()));
  }
  return {{reader.header(), reader.index(), reader.sizes().file, sink->bytes_written(), plan.memory,
           vdb_summary(*sink)},
          sink};
}

VerifyResult verify_file(Ranks& ranks, const VerifyRun& run) {
  auto verifier =
      std::make_unique<Verifier>(run.input, run.original, run.source, of_this_rank(ranks, run.resources));
  if (ranks.count() == 1 || !verifier->any_order()) return verify_all(*verifier, run.progress);
  const VerifyOrder order{run.input, run.original, run.source, run.resources};
  send_order(ranks, order);
  return verify_parts(ranks, order, std::move(verifier), run.progress);
}

void verify_encoding(const std::string& input, const SourceDescription& source, const std::string& encoded,
                     const Resources& resources) {
  try {
    Ranks alone;
    verify_file(alone, {.input = encoded, .original = input, .source = source, .resources = resources});
  } catch (const BrokenInput& broken) {
    throw std::runtime_error(std::string(broken.what()) + "; the input was kept");
  }
}

}  // namespace tagrid
