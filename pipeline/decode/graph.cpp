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

void build_and_run(const DecodeJob& job, BrickSource& source, RowSink& sink, Watch& watch,
                   SinkFailure& failure) {
  const CodingParameters& parameters = job.parameters;
  const bool keep = sink.takes_bricks(), changes = job.numbers.are_values();
  const std::int64_t first_brick = job.rows.first_brick(parameters.bricks());
  std::int64_t bricks_left = job.rows.count(parameters.bricks());
  DecodedRows gathered(parameters, job.rows, job.budget.rows, job.numbers.value_bytes());

  using Write = flow::multifunction_node<Brick, std::tuple<int>>;

  flow::graph graph;
  flow::input_node<CodedBrick> read(graph, [&](oneapi::tbb::flow_control& control) -> CodedBrick {
    if (bricks_left > 0) watch.before_reading();
    const TimeOfNode time(Node::read_brick);
    auto bytes = std::make_shared<BrickBytes>();
    if (bricks_left == 0 || !source.read_brick(*bytes))
      control.stop();
    else
      --bricks_left;
    return bytes;
  });
  flow::limiter_node<CodedBrick, int> bricks(graph, static_cast<std::size_t>(job.budget.bricks_in_flight));
  flow::function_node<CodedBrick, Brick> decode(
      graph, static_cast<std::size_t>(job.budget.threads), [&](const CodedBrick& brick) {
        const TimeOfNode time(Node::decode);
        auto decoded = std::make_shared<DecodedBrick>(decode_block(
            *brick, parameters, source.name(), keep ? Wanted::samples_and_grid : Wanted::samples));
        if (changes) change_brick(job.numbers, parameters.bricks(), source.name(), *decoded);
        watch.brick_done(decoded->id);
        return decoded;
      });
  flow::sequencer_node<Brick> in_order(
      graph, [&](const Brick& brick) { return static_cast<std::size_t>(brick->id - first_brick); });
  Write write(graph, flow::serial, [&](const Brick& brick, Write::output_ports_type& out) {
    const TimeOfNode time(Node::write_rows);
    const std::size_t bytes = brick->samples.size();
    try {
      if (keep) sink.take(*brick);
      gathered.add(std::move(brick->samples));
      std::get<0>(out).try_put(1);
      if (gathered.complete()) sink.write(gathered);
    } catch (...) {
      failure.keep();
      source.stop();
      throw;
    }
    if (keep) watch.done(bytes);
    if (!gathered.complete()) return;
    if (!keep) watch.done(gathered.bytes());
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

void decode(const DecodeJob& job, BrickSource& bricks, RowSink& rows, Watch& watch) {
  SinkFailure failure;
  try {
    Threads(job.budget.threads).run([&] { build_and_run(job, bricks, rows, watch, failure); });
  } catch (...) {
    failure.rethrow();
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
