#include "pipeline/parts/work_orders.h"

#include <memory>

#include "io/bytes/little_endian.h"
#include "io/files/placed_file.h"
#include "io/tag/bricks.h"
#include "pipeline/decode/graph.h"
#include "pipeline/memory/plan.h"
#include "pipeline/parts/part_work.h"

namespace tagrid {
namespace {

// The file and the output volume, as opened by this rank.
class PartDecoder {
 public:
  PartDecoder(const Ranks& ranks, const DecodeOrder& order)
      : start_(order.start),
        tag_(std::make_shared<FileSource>(order.input)),
        file_(order.file, order.name),
        sample_bytes_(size_of(order.numbers.type(parameters().type))),
        parts_(parts_of(parameters().bricks())),
        decoder_(parameters(),
                 plan_decoding(parameters(), of_this_rank(ranks, order.resources), DecodeUse::write, 0,
                               order.numbers.value_bytes())
                     .budget,
                 order.numbers) {}

  const CodingParameters& parameters() const { return tag_.parameters(); }
  std::int64_t count() const { return static_cast<std::int64_t>(parts_.size()); }

  void decode(std::int64_t part, const Watch& watch) {
    const BrickRows& rows = parts_[static_cast<std::size_t>(part)];
    decoder_.decode(
        rows, tag_.bricks_from(rows.first_brick(parameters().bricks())),
        [&](const DecodedRows& decoded) {
          decoded.for_each_part(
              [&](std::int64_t first, std::span<const std::byte> samples) { write(first, samples); });
        },
        watch);
  }

  void finish() { file_.finish(); }

 private:
  void write(std::int64_t first, std::span<const std::byte> samples) {
    std::vector<std::byte> swapped;
    file_.write_at(start_ + static_cast<std::uint64_t>(first) * sample_bytes_,
                   little_endian_samples(samples, sample_bytes_, swapped));
  }

  std::uint64_t start_;
  TagBricks tag_;
  PlacedFile file_;
  std::size_t sample_bytes_;  ///< as written
  std::vector<BrickRows> parts_;
  RowDecoder decoder_;
};

}  // namespace

void decode_parts(Ranks& ranks, const DecodeOrder& order, const Progress& progress) {
  std::unique_ptr<PartDecoder> decoder;
  all_do(ranks, [&] { decoder = std::make_unique<PartDecoder>(ranks, order); });
  SharedWork shared;
  shared.count = decoder->count();
  shared.work = [&](std::int64_t part) { decoder->decode(part, watch_of(shared)); };
  CodingParameters written = decoder->parameters();
  written.type = order.numbers.type(written.type);
  shared.look = look_for(progress, written);
  share_out(ranks, shared);
  all_do(ranks, [&] { decoder->finish(); });
}

}  // namespace tagrid
