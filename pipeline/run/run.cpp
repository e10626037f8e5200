#include "pipeline/run/run.h"

#include <stdexcept>

#include "io/files/errors.h"
#include "pipeline/decode/row_decoder.h"
#include "pipeline/decode/row_output.h"
#include "pipeline/encode/input_slices.h"
#include "pipeline/encode/row_encoder.h"
#include "pipeline/memory/plan.h"
#include "pipeline/verify/verify.h"

namespace tagrid {

EncodeResult encode_volume(const std::string& input, const SourceDescription& source,
                           const std::string& output, bool overwrite, const EncodeOptions& options,
                           const Resources& resources, const Progress& progress,
                           const BeforeNaming<EncodeResult>& before_naming) {
  options.validate();
  refuse_same_file(input, output);
  check_output(output, overwrite);
  VolumeReader reader = open_volume(input, source);
  for (const std::string& file : reader.files()) refuse_same_file(file, output);
  // Before anything is read: a limit that cannot be kept is found at once.
  const EncodePlan plan = plan_encoding(parameters_but_scale(options, reader.info()), resources,
                                        reader.random_access(), reader.memory());
  EncodeResult result;
  result.memory = plan.memory;
  const bool reads_range = takes_range_from_data(options, reader);
  result.header = {resolve(options, reader), reader.info().nrrd_fields};
  const CodingParameters& parameters = result.header.parameters;
  OutputFile file(output, overwrite, {.like = attributes_of(reader.files().back())});
  TagWriter writer(file, result.header);

  if (plan.spooled) reader.spool(resources.spool);
  RowEncoder encoder(parameters, plan, slices_of(reader));
  reader.stop_when(encoder.failed());
  const BrickRows all = BrickRows::all(parameters.bricks());
  encoder.encode(all, writer, watch_for(progress, sample_bytes(parameters.dims, parameters.type).value()));
  writer.finish();
  result.index = writer.index();
  result.bytes_in = reader.bytes_read();
  result.times_read = times_read(parameters, plan, {all}) + plan.spooled + reads_range;
  result.file_bytes = file.position();
  result.temporary = file.temporary();
  if (before_naming) before_naming(result);
  file.commit();
  return result;
}

DecodeResult decode_volume(const std::string& input, const std::string& output, VolumeFormat format,
                           bool overwrite, const Resources& resources, const Progress& progress,
                           const BeforeNaming<DecodeResult>& before_naming, const VdbOptions& vdb) {
  refuse_same_file(input, output);
  refuse_same_file(input, samples_path(output, format));
  TagReader reader(input);
  const CodingParameters& parameters = reader.parameters();
  const VolumeInfo info = volume_info_of(reader.header());
  const bool any_order = format != VolumeFormat::vdb && is_regular_output(output);
  const DecodePlan plan =
      plan_decoding(parameters, resources, any_order ? DecodeUse::write : DecodeUse::stream,
                    format == VolumeFormat::vdb ? memory_of_vdb_writer(info) : 0);
  VdbOptions grid = vdb;
  grid.max_error = parameters.max_error >= 0 ? std::optional(parameters.max_error) : std::nullopt;
  VolumeWriter writer = open_volume_writer(output, format, info, overwrite, attributes_of(input), grid);

  RowOutput row_output(writer, plan.spooled ? resources.spool : "", output);
  RowDecoder(reader, plan.budget)
      .decode(
          BrickRows::all(parameters.bricks()), [&](const DecodedRows& rows) { row_output.write(rows); },
          watch_for(progress, sample_bytes(parameters.dims, parameters.type).value()));
  const DecodeResult result = {reader.header(),        reader.index(), reader.sizes().file,
                               writer.bytes_written(), plan.memory,    writer.vdb()};
  if (before_naming) before_naming(result);
  writer.commit();
  return result;
}

void verify_encoding(const std::string& input, const SourceDescription& source, const std::string& encoded,
                     const Resources& resources) {
  try {
    verify_file(encoded, input, source, resources);
  } catch (const BrokenInput& broken) {
    throw std::runtime_error(std::string(broken.what()) + "; the input was kept");
  }
}

}  // namespace tagrid
