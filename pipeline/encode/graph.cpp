#include "pipeline/encode/graph.h"

#include <oneapi/tbb/flow_graph.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <variant>

#include "pipeline/threads/node_times.h"
#include "pipeline/threads/threads.h"
#include "stages/brick/closed_samples.h"
#include "stages/brick/codec.h"
#include "stages/brick/sample_statistics.h"
#include "stages/criterion/marking.h"
#include "stages/mesh/mesh_error.h"

namespace tagrid {
namespace {

namespace flow = oneapi::tbb::flow;

// The input for measuring the error of the mesh in a brick.
struct MeshedBrick {
  SubdividedBrick of;
  std::vector<std::byte> values;  // of the mesh, in the brick's closed box; empty: the original samples
};

struct EncodedBrick {
  std::int64_t id = 0;
  std::shared_ptr<BrickCode> code;
  std::shared_ptr<MeshedBrick> mesh;  // only if its error has to be measured
};

EncodedBrick encode_one(SubdividedBrick brick, const CodingParameters& parameters, bool needs_sums) {
  EncodedBrick encoded{parameters.bricks().id(brick.brick), std::make_shared<BrickCode>(), {}};
  const BrickSamples samples = gather(brick.slices, parameters.domain().volume(), parameters.type,
                                      samples_to_encode(parameters, brick.brick));
  if (needs_sums) encoded.code->filter_sums.emplace();
  encode_brick(samples, brick.active, parameters, brick.brick, *encoded.code);
  if (parameters.mesh_error >= 0)
    encoded.mesh = std::make_shared<MeshedBrick>(MeshedBrick{std::move(brick), {}});
  return encoded;
}

// Moves the decoded values to the mesh, completed from the bricks below if `closed`. Bricks come in order.
void take_mesh_values(EncodedBrick& encoded, const CodingParameters& parameters, ClosedSamples* closed) {
  if (closed)
    encoded.mesh->values = closed->complete(encoded.mesh->of.brick, encoded.code->decoded);
  else if (parameters.mode == FileMode::grid)
    encoded.mesh->values = std::move(encoded.code->decoded);
  encoded.code->decoded = {};
}

// Sets the error of the mesh, and frees the input for it.
void measure_mesh(EncodedBrick& encoded, const CodingParameters& parameters) {
  const SubdividedBrick& brick = encoded.mesh->of;
  const BrickSamples original =
      gather(brick.slices, parameters.domain().volume(), parameters.type, brick.active.box());
  encoded.code->statistics.mesh_error =
      measure_mesh(original, encoded.mesh->values, brick.active, parameters, brick.brick);
  check_bound(encoded.code->statistics, parameters);
  encoded.mesh.reset();
}

// What one run of the graph works with.
struct Run {
  SliceSource& slices;
  BrickSink* bricks;        // nullptr: bricks below those that are written
  StripSums* sums;          // nullptr: none
  ClosedSamples* closed;    // nullptr: the mesh needs no bricks below
  FilterSums* filter_sums;  // nullptr: nowhere
  Watch& watch;
  SinkFailure failure = {};
};

void hand_over(Run& run, std::int64_t id, BrickCode& code, std::size_t sample_bytes) {
  if (run.filter_sums != nullptr) run.filter_sums->add(*code.filter_sums);
  try {
    run.bricks->write_brick({id, std::move(code.activity), std::move(code.values)}, code.statistics);
  } catch (...) {
    run.failure.keep();
    run.slices.stop();
    throw;
  }
  run.watch.done(code.statistics.samples * sample_bytes);
}

void build_and_run(const CodingParameters& parameters, const BrickRows& rows, const EncodeBudget& budget,
                   Run& run) {
  GridSchedule schedule = schedule_of_encoding(parameters, rows);
  const auto workers = static_cast<std::size_t>(budget.threads);
  const std::int64_t first_brick = rows.first_brick(parameters.bricks()),
                     layer_bricks = rows.layer_count(parameters.bricks());
  Box next_rows = schedule.samples();
  next_rows.high.z = next_rows.low.z;

  using Arrival = std::variant<SliceSamples, MarkedTile>;
  using Schedule = flow::multifunction_node<Arrival, std::tuple<MarkJob, BrickJob>>;
  using Write = flow::multifunction_node<EncodedBrick, std::tuple<int, int>>;

  flow::graph graph;
  flow::input_node<Arrival> read(graph, [&](oneapi::tbb::flow_control& control) -> Arrival {
    if (next_rows.low.z > schedule.samples().high.z) {
      control.stop();
      return {};
    }
    run.watch.before_reading();
    const TimeOfNode time(Node::read_slice);
    const Box box = parameters.domain().samples_at(next_rows);
    SliceSamples slice = run.slices.read(box);
    if (run.sums != nullptr) run.sums->add_slice(box, slice.get());
    ++next_rows.low.z, ++next_rows.high.z;
    return slice;
  });
  flow::limiter_node<Arrival, int> slices(
      graph, static_cast<std::size_t>(schedule.slices_needed() + budget.slices_ahead));
  Schedule plan(graph, flow::serial, [&](const Arrival& arrival, Schedule::output_ports_type& out) {
    const TimeOfNode time(Node::plan);
    const auto* slice = std::get_if<SliceSamples>(&arrival);
    GridSchedule::Work work =
        slice ? schedule.add_slice(*slice) : schedule.add_marks(std::get<MarkedTile>(arrival));
    for (MarkJob& job : work.tiles) std::get<0>(out).try_put(std::move(job));
    for (BrickJob& job : work.bricks) std::get<1>(out).try_put(std::move(job));
  });
  flow::function_node<MarkJob, Arrival> curvature(graph, workers, [&](const MarkJob& job) -> Arrival {
    const TimeOfNode time(Node::curvature);
    return mark(job, parameters, schedule);
  });
  flow::queue_node<BrickJob> ready(graph);
  flow::limiter_node<BrickJob, int> bricks(graph, static_cast<std::size_t>(budget.bricks_in_flight));
  flow::function_node<BrickJob, SubdividedBrick> subdivide_node(graph, workers, [&](const BrickJob& job) {
    const TimeOfNode time(Node::subdivide);
    return subdivide(job, parameters);
  });
  flow::function_node<SubdividedBrick, EncodedBrick> encode_node(graph, workers, [&](SubdividedBrick brick) {
    const TimeOfNode time(Node::encode);
    EncodedBrick encoded = encode_one(std::move(brick), parameters, run.filter_sums != nullptr);
    if (run.bricks != nullptr) run.watch.brick_done(encoded.id);
    return encoded;
  });
  const auto place = [&](const EncodedBrick& brick) {
    return static_cast<std::size_t>(brick.id - first_brick);
  };
  flow::sequencer_node<EncodedBrick> in_order(graph, place);
  flow::function_node<EncodedBrick, EncodedBrick> complete(graph, flow::serial, [&](EncodedBrick brick) {
    const TimeOfNode time(Node::complete_mesh);
    take_mesh_values(brick, parameters, run.closed);
    return brick;
  });
  flow::function_node<EncodedBrick, EncodedBrick> measure_node(graph, workers, [&](EncodedBrick brick) {
    const TimeOfNode time(Node::measure_mesh);
    if (run.bricks != nullptr) measure_mesh(brick, parameters);
    return brick;
  });
  flow::sequencer_node<EncodedBrick> in_order_again(graph, place);
  Write write(graph, flow::serial, [&](const EncodedBrick& brick, Write::output_ports_type& out) {
    const TimeOfNode time(Node::write_brick);
    if (run.bricks != nullptr) hand_over(run, brick.id, *brick.code, size_of(parameters.type));
    std::get<0>(out).try_put(1);
    const std::int64_t done = brick.id - first_brick + 1;
    if (done % layer_bricks == 0)
      std::get<1>(out).try_put(
          static_cast<int>(schedule.slices_released_by(rows.z_low + done / layer_bricks - 1)));
  });

  flow::make_edge(read, slices);
  flow::make_edge(slices, plan);
  flow::make_edge(flow::output_port<0>(plan), curvature);
  flow::make_edge(curvature, plan);
  flow::make_edge(flow::output_port<1>(plan), ready);
  flow::make_edge(ready, bricks);
  flow::make_edge(bricks, subdivide_node);
  flow::make_edge(subdivide_node, encode_node);
  flow::make_edge(encode_node, in_order);
  if (parameters.mesh_error >= 0) {
    flow::make_edge(in_order, complete);
    flow::make_edge(complete, measure_node);
    flow::make_edge(measure_node, in_order_again);
    flow::make_edge(in_order_again, write);
  } else {
    flow::make_edge(in_order, write);
  }
  flow::make_edge(flow::output_port<0>(write), bricks.decrementer());
  flow::make_edge(flow::output_port<1>(write), slices.decrementer());

  run_graph(graph, read);
}

}  // namespace

GridSchedule schedule_of_encoding(const CodingParameters& parameters, const BrickRows& rows) {
  return {parameters, rows, parameters.counts_points() ? std::optional(mark_halo(parameters)) : std::nullopt};
}

std::vector<BrickRows> rows_to_encode(const CodingParameters& parameters, const BrickRows& rows) {
  std::vector<BrickRows> all;
  if (mesh_needs_bricks_below(parameters)) all = rows_below(rows);
  all.push_back(rows);
  return all;
}

void encode(const EncodeJob& job, std::span<const BrickRows> stretches, SliceSource& slices,
            BrickSink& bricks, Watch& watch, SumsSink* sums) {
  const CodingParameters& parameters = job.parameters();
  Run run{slices, &bricks, nullptr, nullptr, job.filter_sums, watch};
  const auto encode_strip = [&](const BrickRows& strip) {
    std::optional<StripSums> of_strip;
    if (sums != nullptr) run.sums = &of_strip.emplace(parameters, strip, *sums);
    std::optional<ClosedSamples> closed;
    if (mesh_needs_bricks_below(parameters)) run.closed = &closed.emplace(parameters, strip);
    Run below{slices, nullptr, nullptr, run.closed, nullptr, watch};
    for (const BrickRows& encoded : rows_to_encode(parameters, strip))
      build_and_run(parameters, encoded, job.plan.budget, encoded == strip ? run : below);
  };
  Threads threads(job.plan.budget.threads);
  try {
    threads.run([&] {
      for (const BrickRows& rows : stretches)
        for (const BrickRows& strip : job.plan.strips(parameters.bricks(), rows)) encode_strip(strip);
    });
  } catch (...) {
    run.failure.rethrow();
  }
}

void encode(const EncodeJob& job, const BrickRows& rows, SliceSource& slices, BrickSink& bricks, Watch& watch,
            SumsSink* sums) {
  encode(job, std::span(&rows, 1), slices, bricks, watch, sums);
}

std::vector<Box> samples_in_order(const CodingParameters& parameters, const EncodePlan& plan,
                                  const BrickRows& rows) {
  std::vector<Box> boxes;
  for (const BrickRows& strip : plan.strips(parameters.bricks(), rows))
    for (const BrickRows& encoded : rows_to_encode(parameters, strip))
      boxes.push_back(parameters.domain().samples_at(schedule_of_encoding(parameters, encoded).samples()));
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
