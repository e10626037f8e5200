#include "pipeline/decode_parts.h"

#include <algorithm>
#include <bit>
#include <memory>

#include "io/errors.h"
#include "io/little_endian.h"
#include "io/placed_file.h"
#include "pipeline/memory_plan.h"
#include "pipeline/parts.h"
#include "pipeline/until_it_fails.h"
#include "pipeline/work_orders.h"

namespace tagrid {
namespace {

// The file and the volume as this rank sees them.
class PartDecoder {
 public:
  explicit PartDecoder(const DecodeOrder& order)
      : start_(order.start),
        reader_(order.input),
        file_(order.file, order.name),
        parts_(parts_of(reader_.parameters().bricks())),
        plan_(plan_decoding(reader_.parameters(), of_this_rank(order.resources))) {
    reader_.read_index();
  }

  std::int64_t count() const { return static_cast<std::int64_t>(parts_.size()); }

  void decode(std::int64_t part, SharedWork& shared) {
    const CodingParameters& parameters = reader_.parameters();
    const BrickRows& rows = parts_[static_cast<std::size_t>(part)];
    std::int64_t left = rows.count(parameters.bricks());
    reader_.seek_brick(rows.first_brick(parameters.bricks()));
    UntilItFails output_works;
    DecodeStreams streams;
    streams.name = reader_.name();
    streams.read_brick = [&](BrickBytes& brick) {
      if (shared.stop) throw Stopped();
      return left-- > 0 && reader_.read_brick(brick);
    };
    streams.write_rows = [&](const DecodedRows& decoded) {
      decoded.for_each_part([&](std::int64_t first, std::span<const std::byte> samples) {
        output_works.run([&] { write(first, samples); });
        shared.done += static_cast<std::int64_t>(samples.size());
      });
    };
    output_works.rethrow_after([&] { run_decode_graph(parameters, rows, plan_.budget, streams); });
  }

  void finish() { file_.finish(); }

 private:
  void write(std::int64_t first, std::span<const std::byte> samples) {
    const std::size_t size = size_of(reader_.parameters().type);
    const std::uint64_t place = start_ + static_cast<std::uint64_t>(first) * size;
    if constexpr (std::endian::native == std::endian::little) {
      file_.write_at(place, samples);
    } else {
      std::vector<std::byte> swapped(samples.begin(), samples.end());
      swap_bytes_of_samples(swapped.data(), swapped.size() / size, size);
      file_.write_at(place, swapped);
    }
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
  std::exception_ptr failure;
  try {
    decoder = std::make_unique<PartDecoder>(order);
  } catch (...) {
    failure = std::current_exception();
  }
  agree(ranks, failure);
  SharedWork shared;
  shared.count = decoder->count();
  shared.work = [&](std::int64_t part) { decoder->decode(part, shared); };
  if (progress)
    shared.look = [&](const SharedNumbers& numbers) { progress(static_cast<std::uint64_t>(numbers.done)); };
  share_out(ranks, shared);
  try {
    decoder->finish();
  } catch (...) {
    failure = std::current_exception();
  }
  agree(ranks, failure);
}

DecodeResult decode_by_ranks(Ranks& ranks, const std::string& input, const std::string& output,
                             VolumeFormat format, bool overwrite, const Resources& resources,
                             const Progress& progress, const BeforeNaming<DecodeResult>& before_naming) {
  refuse_same_file(input, output);
  refuse_same_file(input, samples_path(output, format));
  TagReader reader(input);
  const CodingParameters& parameters = reader.parameters();
  reader.read_index();
  VolumeInfo info;
  info.dims = parameters.dims;
  info.type = parameters.type;
  info.nrrd_fields = reader.header().nrrd_fields;
  info.geometry = geometry_of(info.nrrd_fields);
  const std::uint64_t memory = plan_decoding(parameters, of_this_rank(resources)).memory;
  VolumeWriter writer = open_volume_writer(output, format, info, overwrite, attributes_of(input), {}, true);
  const std::uint64_t total = sample_bytes(parameters.dims, parameters.type).value();
  const DecodeOrder order{input, writer.temporary(), samples_path(output, format), writer.samples_start(),
                          resources};
  send_order(ranks, order);
  decode_parts(ranks, order, [&](std::uint64_t done) {
    if (progress) progress(std::min(done, total), total);
  });
  writer.samples_were_placed();
  const DecodeResult result = {reader.header(),        reader.index(), reader.sizes().file,
                               writer.bytes_written(), memory,         {}};
  if (before_naming) before_naming(result);
  writer.commit();
  return result;
}

}  // namespace tagrid
