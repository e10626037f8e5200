#include "pipeline/decode_graph.h"

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <memory>
#include <vector>

#include "io/errors.h"
#include "stages/brick_codec.h"

namespace tagrid {
namespace {

namespace flow = oneapi::tbb::flow;

using CodedBrick = std::shared_ptr<const BrickBytes>;
using Brick = std::shared_ptr<DecodedBrick>;

template <class T>
std::vector<std::byte> bytes_of(const std::vector<T>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

Brick decode_one(const CodingParameters& parameters, const BrickBytes& brick, const std::string& name,
                 bool keep) {
  const Index3 position = parameters.bricks().position(brick.id);
  auto decoded = std::make_shared<DecodedBrick>();
  decoded->id = brick.id;
  const bool values_first = activity_follows_values(parameters);
  Status status;
  with_sample_type(parameters.type, [&](auto type) {
    using T = decltype(type);
    std::vector<T> samples, points;
    const auto decode_activity = [&] {
      status = decode_brick_activity<T>(brick.activity, samples, parameters, position, decoded->active);
    };
    if (!values_first) decode_activity();
    if (!status.ok()) return;
    status = decode_brick_values<T>(brick.values, decoded->active, parameters, position, samples, points);
    if (!status.ok()) return;
    // Who wants samples alone has no use for the grid.
    if (values_first && keep) decode_activity();
    decoded->samples = bytes_of(samples);
    if (keep) decoded->points = bytes_of(points);
  });
  if (!status.ok())
    throw BrokenInput((name.empty() ? "" : name + ": ") + "brick " + std::to_string(brick.id) + ": " +
                      status.what());
  if (!keep) decoded->active = LatticeBits();
  return decoded;
}

void build_and_run(const CodingParameters& parameters, int threads, const DecodeStreams& streams) {
  const std::int64_t layer_bricks = parameters.bricks().layer_count();
  const bool keep = static_cast<bool>(streams.inspect_brick);
  DecodedLayer layer(parameters);

  using Write = flow::multifunction_node<Brick, std::tuple<int>>;

  flow::graph graph;
  flow::input_node<CodedBrick> read(graph, [&](oneapi::tbb::flow_control& control) -> CodedBrick {
    auto bytes = std::make_shared<BrickBytes>();
    if (!streams.read_brick(*bytes)) control.stop();
    return bytes;
  });
  flow::limiter_node<CodedBrick, int> budget(graph, static_cast<std::size_t>(2 * layer_bricks));
  flow::function_node<CodedBrick, Brick> decode(
      graph, static_cast<std::size_t>(threads), [&](const CodedBrick& brick) {
        Brick decoded = decode_one(parameters, *brick, streams.name, keep);
        if (streams.brick_done) streams.brick_done(decoded->id);
        return decoded;
      });
  flow::sequencer_node<Brick> in_order(
      graph, [](const Brick& brick) { return static_cast<std::size_t>(brick->id); });
  Write write(graph, flow::serial, [&](const Brick& brick, Write::output_ports_type& out) {
    if (keep) streams.inspect_brick(*brick);
    layer.add(std::move(brick->samples));
    if (!layer.complete()) return;
    streams.write_layer(layer);
    layer.begin_next();
    std::get<0>(out).try_put(static_cast<int>(layer_bricks));
  });

  flow::make_edge(read, budget);
  flow::make_edge(budget, decode);
  flow::make_edge(decode, in_order);
  flow::make_edge(in_order, write);
  flow::make_edge(flow::output_port<0>(write), budget.decrementer());

  read.activate();
  graph.wait_for_all();
}

}  // namespace

void run_decode_graph(const CodingParameters& parameters, int threads, const DecodeStreams& streams) {
  const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                          static_cast<std::size_t>(threads));
  oneapi::tbb::task_arena arena(threads);
  arena.execute([&] { build_and_run(parameters, threads, streams); });
}

}  // namespace tagrid
