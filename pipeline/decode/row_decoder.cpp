#include "pipeline/decode/row_decoder.h"

#include "pipeline/decode/graph.h"

namespace tagrid {

RowDecoder::RowDecoder(TagReader& reader, const DecodeBudget& budget) : reader_(reader), budget_(budget) {
  reader_.stop_when(output_works_.failed());
}

void RowDecoder::decode(const BrickRows& rows, const std::function<void(const DecodedRows&)>& write,
                        const Watch& watch) {
  DecodeStreams streams = streams_of(reader_);
  streams.read_brick = [&, read = streams.read_brick](BrickBytes& brick) {
    if (watch.before_reading) watch.before_reading();
    return read(brick);
  };
  streams.write_rows = [&](const DecodedRows& decoded) {
    output_works_.run([&] { write(decoded); });
    watch.done(decoded.bytes());
  };
  output_works_.rethrow_after([&] { run_decode_graph(reader_.parameters(), rows, budget_, streams); });
}

}  // namespace tagrid
