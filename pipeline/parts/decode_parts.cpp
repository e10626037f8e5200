#include "pipeline/parts/decode_parts.h"

#include <algorithm>
#include <memory>

#include "io/bytes/little_endian.h"
#include "io/files/errors.h"
#include "io/files/placed_file.h"
#include "pipeline/memory/plan.h"
#include "pipeline/memory/until_it_fails.h"
#include "pipeline/parts/parts.h"
#include "pipeline/parts/work_orders.h"

namespace tagrid {
namespace {

// The file and the volume as this rank sees them.
class PartDecoder {
 public:
  PartDecoder(const Ranks& ranks, const DecodeOrder& order)
      : start_(order.start),
        reader_(order.input),
        file_(order.file, order.name),
        parts_(parts_of(reader_.parameters().bricks())),
        plan_(plan_decoding(reader_.parameters(), of_this_rank(ranks, order.resources))) {
    reader_.read_index();
  }

  std::int64_t count() const { return static_cast<std::int64_t>(parts_.size()); }

  void decode(std::int64_t part, SharedWork& shared) {
    const CodingParameters& parameters = reader_.parameters();
    const BrickRows& rows = parts_[static_cast<std::size_t>(part)];
    reader_.seek_brick(rows.first_brick(parameters.bricks()));
    UntilItFails output_works;
    DecodeStreams streams;
    streams.name = reader_.name();
    streams.read_brick = [&](BrickBytes& brick) {
      if (shared.stop) throw Stopped();
      return reader_.read_brick(brick);
    };
    streams.write_rows = [&](const DecodedRows& decoded) {
      decoded.for_each_part([&](std::int64_t first, std::span<const std::byte> samples) {
        output_works.run([&] { write(first, samples); });
        shared.add_done(static_cast<std::int64_t>(samples.size()));
      });
    };
    output_works.rethrow_after([&] { run_decode_graph(parameters, rows, plan_.budget, streams); });
  }

  void finish() { file_.finish(); }

 private:
  void write(std::int64_t first, std::span<const std::byte> samples) {
    const std::size_t size = size_of(reader_.parameters().type);
    std::vector<std::byte> swapped;
    file_.write_at(start_ + static_cast<std::uint64_t>(first) * size,
                   little_endian_samples(samples, size, swapped));
  }

  std::uint64_t start_;
  TagReader reader_;
  PlacedFile file_;
  std::vector<BrickRows> parts_;
  DecodePlan plan_;
};

}  // namespace

void decode_parts(Ranks& ranks, const DecodeOrder& order, const DoneBytes& progress) {
  std::unique_ptr<PartDecoder> decoder;
  all_do(ranks, [&] { decoder = std::make_unique<PartDecoder>(ranks, order); });
  SharedWork shared;
  shared.count = decoder->count();
  shared.work = [&](std::int64_t part) { decoder->decode(part, shared); };
  if (progress)
    shared.look = [&](const SharedNumbers& numbers) { progress(static_cast<std::uint64_t>(numbers.done)); };
  share_out(ranks, shared);
  all_do(ranks, [&] { decoder->finish(); });
}

DecodeResult decode_by_ranks(Ranks& ranks, const std::string& input, const std::string& output,
                             const Format& format, bool overwrite, const Resources& resources,
                             const Progress& progress, const BeforeNaming<DecodeResult>& before_naming) {
  refuse_same_file(input, output);
  refuse_same_file(input, samples_path(output, format));
  TagReader reader(input);
  const CodingParameters& parameters = reader.parameters();
  reader.read_index();
  const VolumeInfo info = volume_info_of(reader.header());
  const std::uint64_t memory = plan_decoding(parameters, of_this_rank(ranks, resources)).memory;
  const auto sink = format.create(
      output, info,
      {.files = {.overwrite = overwrite, .like = attributes_of(input), .others_write = true}, .vdb = {}});
  const std::uint64_t total = sample_bytes(parameters.dims, parameters.type).value();
  const VolumeSink::Place place = sink->place();
  const DecodeOrder order{input, place.file, place.name, place.start, resources};
  send_order(ranks, order);
  decode_parts(ranks, order, [&](std::uint64_t done) {
    if (progress) progress(std::min(done, total), total);
  });
  sink->samples_were_placed();
  const DecodeResult result = {reader.header(),       reader.index(), reader.sizes().file,
                               sink->bytes_written(), memory,         {}};
  if (before_naming) before_naming(result);
  sink->commit();
  return result;
}

}  // namespace tagrid
