#include "pipeline/decode/graph.h"

#include <oneapi/tbb/flow_graph.h>

#include <memory>

#include "io/errors/errors.h"
#include "pipeline/threads/node_times.h"
#include "pipeline/threads/threads.h"

namespace tagrid {
namespace {

namespace flow = oneapi::tbb::flow;

using CodedBrick = std::shared_ptr<const BrickBytes>;
using Brick = std::shared_ptr<DecodedBrick>;

void build_and_run(const CodingParameters& parameters, const BrickRows& rows, const DecodeBudget& budget,
                   const DecodeStreams& streams) {
  const bool keep = static_cast<bool>(streams.inspect_brick);
  const std::int64_t first_brick = rows.first_brick(parameters.bricks());
  std::int64_t bricks_left = rows.count(parameters.bricks());
  DecodedRows gathered(parameters, rows, budget.rows, streams.sample_bytes);

  using Write = flow::multifunction_node<Brick, std::tuple<int>>;

  flow::graph graph;
  flow::input_node<CodedBrick> read(graph, [&](oneapi::tbb::flow_control& control) -> CodedBrick {
    if (streams.before_reading && bricks_left > 0) streams.before_reading();
    const TimeOfNode time(Node::read_brick);
    auto bytes = std::make_shared<BrickBytes>();
    if (bricks_left == 0 || !streams.bricks.next(*bytes))
      control.stop();
    else
      --bricks_left;
    return bytes;
  });
  flow::limiter_node<CodedBrick, int> bricks(graph, static_cast<std::size_t>(budget.bricks_in_flight));
  flow::function_node<CodedBrick, Brick> decode(
      graph, static_cast<std::size_t>(budget.threads), [&](const CodedBrick& brick) {
        const TimeOfNode time(Node::decode);
        auto decoded = std::make_shared<DecodedBrick>(decode_block(
            *brick, parameters, streams.bricks.name, keep ? Wanted::samples_and_grid : Wanted::samples));
        if (streams.change_samples) streams.change_samples(*decoded);
        if (streams.brick_done) streams.brick_done(decoded->id);
        return decoded;
      });
  flow::sequencer_node<Brick> in_order(
      graph, [&](const Brick& brick) { return static_cast<std::size_t>(brick->id - first_brick); });
  Write write(graph, flow::serial, [&](const Brick& brick, Write::output_ports_type& out) {
    const TimeOfNode time(Node::write_rows);
    if (keep) streams.inspect_brick(*brick);
    gathered.add(std::move(brick->samples));
    std::get<0>(out).try_put(1);
    if (!gathered.complete()) return;
    if (streams.write_rows) streams.write_rows(gathered);
    gathered.begin_next();
  });

  flow::make_edge(read, bricks);
  flow::make_edge(bricks, decode);
  flow::make_edge(decode, in_order);
  flow::make_edge(in_order, write);
  flow::make_edge(flow::output_port<0>(write), bricks.decrementer());

  run_graph(graph, read);
}

}  // namespace

void run_decode_graph(const CodingParameters& parameters, const BrickRows& rows, const DecodeBudget& budget,
                      const DecodeStreams& streams) {
  Threads(budget.threads).run([&] { build_and_run(parameters, rows, budget, streams); });
}

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
    try {
      write(decoded);
    } catch (...) {
      failure_ = std::current_exception();
      failed_ = true;
      throw;
    }
    watch.done(decoded.bytes());
  };
  try {
    run_decode_graph(parameters_, rows, budget_, streams);
  } catch (...) {
    // A reader that gave up because of the output may have thrown first.
    if (failed_) std::rethrow_exception(failure_);
    throw;
  }
}

DecodedBrick decode_block(const BrickBytes& block, const CodingParameters& parameters,
                          const std::string& name, Wanted wanted, std::int64_t slices) {
  DecodedBrick brick;
  const Status status =
      decode_brick({block.activity, block.values}, parameters, {block.id, wanted, slices}, brick);
  if (!status.ok())
    throw broken_input_of((name.empty() ? "" : name + ": ") + "brick " + std::to_string(block.id), status);
  return brick;
}

}  // namespace tagrid
