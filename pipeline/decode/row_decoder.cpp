#include "pipeline/decode/row_decoder.h"

#include "pipeline/decode/graph.h"

namespace tagrid {

void RowDecoder::decode(const BrickRows& rows, const BrickStream& bricks,
                        const std::function<void(const DecodedRows&)>& write, const Watch& watch) {
  DecodeStreams streams;
  streams.bricks = bricks;
  streams.before_reading = watch.before_reading;
  if (numbers_.are_values()) {
    streams.sample_bytes = numbers_.value_bytes();
    streams.change_samples = [&](DecodedBrick& brick) {
      change_brick(numbers_, parameters_.bricks(), bricks.name, brick);
    };
  }
  streams.write_rows = [&](const DecodedRows& decoded) {
    output_works_.run([&] { write(decoded); });
    watch.done(decoded.bytes());
  };
  output_works_.rethrow_after([&] { run_decode_graph(parameters_, rows, budget_, streams); });
}

}  // namespace tagrid
