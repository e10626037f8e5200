#include "pipeline/run/run.h"

#include <stdexcept>

#include "io/files/errors.h"
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

// Whether parts can be read and written each by itself: from a file to a file.
bool parts_are_possible(const std::string& input, const std::string& output) {
  return attributes_of(input).has_value() && is_regular_output(output);
}

FinishedEncode encode_at_once(const EncodeRun& run, const Resources& resources) {
  check_output(run.output, run.overwrite);
  VolumeReader reader = open_volume(run.input, run.source);
  for (const std::string& file : reader.files()) refuse_same_file(file, run.output);
  // Before anything is read: a limit that cannot be kept is found at once.
  const EncodePlan plan = plan_encoding(parameters_but_scale(run.options, reader.info()), resources,
                                        reader.random_access(), reader.memory());
  EncodeResult result;
  result.memory = plan.memory;
  const bool reads_range = takes_range_from_data(run.options, reader);
  result.header = {resolve(run.options, reader), reader.info().nrrd_fields};
  const CodingParameters& parameters = result.header.parameters;
  const OutputFileOptions like = {.like = attributes_of(reader.files().back())};
  const auto file = std::make_shared<OutputFile>(run.output, run.overwrite, like);
  TagWriter writer(*file, result.header);

  if (plan.spooled) reader.spool(resources.spool);
  RowEncoder encoder(parameters, plan, slices_of(reader));
  reader.stop_when(encoder.failed());
  const BrickRows all = BrickRows::all(parameters.bricks());
  encoder.encode(all, writer,
                 watch_for(run.progress, sample_bytes(parameters.dims, parameters.type).value()));
  writer.finish();
  result.index = writer.index();
  result.bytes_in = reader.bytes_read();
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
  const bool is_vdb = run.format == VolumeFormat::vdb;
  const bool in_parts = ranks.count() > 1 && !is_vdb && parts_are_possible(run.input, run.output);
  TagReader reader(run.input);
  if (in_parts) reader.read_index();
  const CodingParameters& parameters = reader.parameters();
  const VolumeInfo info = volume_info_of(reader.header());
  const bool any_order = !is_vdb && is_regular_output(run.output);
  const DecodePlan plan =
      plan_decoding(parameters, resources, any_order ? DecodeUse::write : DecodeUse::stream,
                    is_vdb ? memory_of_vdb_writer(info) : 0);
  const auto writer = open_output(run, info, parameters, in_parts);
  if (in_parts) {
    const DecodeOrder order{run.input, writer->temporary(), samples_path(run.output, run.format),
                            writer->samples_start(), run.resources};
    send_order(ranks, order);
    decode_parts(ranks, order, run.progress);
    writer->samples_were_placed();
  } else {
    RowOutput output(*writer, plan.spooled ? resources.spool : "", run.output);
    RowDecoder(reader, plan.budget)
        .decode(
            BrickRows::all(parameters.bricks()), [&](const DecodedRows& rows) { output.write(rows); },
            watch_for(run.progress, sample_bytes(parameters.dims, parameters.type).value()));
  }
  return {{reader.header(), reader.index(), reader.sizes().file, writer->bytes_written(), plan.memory,
           writer->vdb()},
          writer};
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
