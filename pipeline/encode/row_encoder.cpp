#include "pipeline/encode/row_encoder.h"

#include <utility>

#include "pipeline/encode/graph.h"

namespace tagrid {

RowEncoder::RowEncoder(const CodingParameters& parameters, EncodePlan plan, ReadSlice read_slice)
    : parameters_(parameters), plan_(std::move(plan)), read_slice_(std::move(read_slice)) {}

void RowEncoder::encode(const BrickRows& rows, BrickSink& sink, const Watch& watch) {
  EncodeStreams streams;
  streams.before_reading = watch.before_reading;
  streams.read_slice = read_slice_;
  streams.write_brick = [&](std::int64_t id, BrickCode code) {
    output_works_.run([&] {
      sink.write_brick({id, std::move(code.activity), std::move(code.values)}, code.statistics);
    });
    watch.done(code.statistics.samples * size_of(parameters_.type));
  };
  output_works_.rethrow_after([&] {
    for (const BrickRows& strip : plan_.strips(parameters_.bricks(), rows))
      run_encode_graph(parameters_, strip, plan_.budget, streams);
  });
}

std::vector<Box> samples_in_order(const CodingParameters& parameters, const EncodePlan& plan,
                                  const BrickRows& rows) {
  std::vector<Box> boxes;
  for (const BrickRows& strip : plan.strips(parameters.bricks(), rows))
    for (const BrickRows& encoded : rows_to_encode(parameters, strip))
      boxes.push_back(schedule_of_encoding(parameters, encoded).samples());
  return boxes;
}

double times_read(const CodingParameters& parameters, const EncodePlan& plan,
                  const std::vector<BrickRows>& parts) {
  double samples = 0;
  for (const BrickRows& part : parts)
    for (const Box& box : samples_in_order(parameters, plan, part))
      samples += static_cast<double>(box.count());
  return samples / static_cast<double>(parameters.domain().volume().count());
}

}  // namespace tagrid
