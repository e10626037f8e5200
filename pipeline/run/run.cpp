#include "pipeline/run/run.h"

#include <stdexcept>

#include "io/files/errors.h"
#include "io/files/output_file.h"
#include "io/formats/open_volume.h"
#include "io/samples/spooled.h"
#include "pipeline/decode/graph.h"
#include "pipeline/decode/row_output.h"
#include "pipeline/encode/graph.h"
#include "pipeline/encode/input_slices.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/until_it_fails.h"
#include "pipeline/verify/verify.h"

namespace tagrid {

EncodeResult encode_volume(const std::string& input, const SourceDescription& source,
                           const std::string& output, bool overwrite, const EncodeOptions& options,
                           const Resources& resources, const Progress& progress,
                           const BeforeNaming<EncodeResult>& before_naming) {
  options.validate();
  refuse_same_file(input, output);
  check_output(output, overwrite);
  std::unique_ptr<VolumeSource> volume = open_volume(input, source);
  for (const std::string& file : volume->files()) refuse_same_file(file, output);
  // Before anything is read: a limit that cannot be kept is found at once.
  const EncodePlan plan = plan_encoding(parameters_but_scale(options, volume->info()), resources,
                                        volume->traits().any_rows, volume->traits().memory);
  EncodeResult result;
  result.memory = plan.memory;
  result.header = {resolve(options, *volume), volume->info().nrrd_fields};
  const CodingParameters& parameters = result.header.parameters;
  OutputFile file(output, overwrite, {.like = attributes_of(volume->files().back())});
  TagWriter writer(file, result.header);

  const std::uint64_t total = sample_bytes(parameters.dims, parameters.type).value();
  std::uint64_t done = 0;
  UntilItFails output_works;
  volume->stop_when(output_works.failed());
  const int times_read = plan.spooled + takes_range_from_data(options, *volume);
  if (plan.spooled) volume = spooled(std::move(volume), resources.spool);
  double samples_read = static_cast<double>(total) * times_read;
  EncodeStreams streams;
  streams.read_slice = [&](const Box& rows) {
    SliceSamples slice = read_input_slice(*volume, rows);
    samples_read += static_cast<double>(rows.count()) * static_cast<double>(size_of(parameters.type));
    return slice;
  };
  streams.write_brick = [&](std::int64_t id, BrickCode code) {
    done += code.statistics.samples * size_of(parameters.type);
    output_works.run([&] {
      writer.write_brick({id, std::move(code.activity), std::move(code.values)}, code.statistics);
    });
    if (progress) progress(done, total);
  };
  output_works.rethrow_after([&] {
    for (const BrickRows& strip : plan.strips(parameters.bricks(), BrickRows::all(parameters.bricks())))
      run_encode_graph(parameters, strip, plan.budget, streams);
  });
  writer.finish();
  result.index = writer.index();
  result.bytes_in = volume->bytes_read();
  result.times_read = samples_read / static_cast<double>(total);
  result.file_bytes = file.position();
  result.temporary = file.temporary();
  if (before_naming) before_naming(result);
  file.commit();
  return result;
}

DecodeResult decode_volume(const std::string& input, const std::string& output, const Format& format,
                           bool overwrite, const Resources& resources, const Progress& progress,
                           const BeforeNaming<DecodeResult>& before_naming, const VdbOptions& vdb) {
  refuse_same_file(input, output);
  refuse_same_file(input, samples_path(output, format));
  TagReader reader(input);
  const CodingParameters& parameters = reader.parameters();
  const VolumeInfo info = volume_info_of(reader.header());
  const bool any_order = format.any_order && is_regular_output(output);
  const DecodePlan plan = plan_decoding(
      parameters, resources, any_order ? DecodeUse::write : DecodeUse::stream, format.memory(info));
  VdbOptions grid = vdb;
  grid.max_error = parameters.max_error >= 0 ? std::optional(parameters.max_error) : std::nullopt;
  const auto sink = format.create(
      output, info, {.files = {.overwrite = overwrite, .like = attributes_of(input)}, .vdb = grid});

  const std::uint64_t total = sample_bytes(parameters.dims, parameters.type).value();
  std::uint64_t done = 0;
  UntilItFails output_works;
  reader.stop_when(output_works.failed());
  DecodeStreams streams;
  streams.name = reader.name();
  streams.read_brick = [&](BrickBytes& brick) { return reader.read_brick(brick); };
  RowOutput row_output(*sink, plan.spooled ? resources.spool : "", output);
  streams.write_rows = [&](const DecodedRows& rows) {
    output_works.run([&] { row_output.write(rows); });
    done += rows.bytes();
    if (progress) progress(done, total);
  };
  output_works.rethrow_after(
      [&] { run_decode_graph(parameters, BrickRows::all(parameters.bricks()), plan.budget, streams); });
  const DecodeResult result = {reader.header(),       reader.index(), reader.sizes().file,
                               sink->bytes_written(), plan.memory,    vdb_summary(*sink)};
  if (before_naming) before_naming(result);
  sink->commit();
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
