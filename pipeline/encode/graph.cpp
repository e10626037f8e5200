#include "pipeline/encode/graph.h"

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <optional>
#include <span>
#include <variant>

#include "pipeline/encode/schedule.h"
#include "stages/brick/closed_samples.h"
#include "stages/marks/curvature.h"
#include "stages/marks/halo.h"
#include "stages/marks/heights.h"
#include "stages/marks/marking.h"
#include "stages/marks/mesh_criterion.h"
#include "stages/marks/subdivide.h"
#include "stages/mesh/mesh_error.h"

namespace tagrid {
namespace {

namespace flow = oneapi::tbb::flow;

struct SubdividedBrick {
  Index3 brick;
  SliceRange slices;
  LatticeBits active;
};

// What the error of the mesh in a brick follows from.
struct MeshedBrick {
  Index3 brick;
  SliceRange slices;
  LatticeBits active;
  std::vector<std::byte> values;  // of its closed box, as the mesh has them
};

struct EncodedBrick {
  std::int64_t id = 0;
  std::shared_ptr<BrickCode> code;
  std::shared_ptr<MeshedBrick> mesh;  // where its error has to be measured
};

// Values of the mesh on the low faces of a brick: without loss they are samples, and a grid stores them
// twice.
bool mesh_needs_bricks_below(const CodingParameters& parameters) {
  return parameters.mesh_error >= 0 && parameters.mesh_has_coded_values();
}

// From a job's slices and marks to the stage functions: what each worker does.
class Stages {
 public:
  Stages(const CodingParameters& parameters, const EncodeSchedule& schedule)
      : parameters_(parameters), schedule_(schedule) {}

  MarkedTile mark(const MarkJob& job) const {
    // Where all is air, or was cut away, there is nothing to mark: no box.
    auto marks = std::make_shared<LatticeBits>();
    with_sample_type(parameters_.type, [&](auto type) {
      using T = decltype(type);
      const Box cubes = schedule_.tile_box(job.tile);
      const auto samples = gathered<T>(job.slices, cubes.grown(mark_halo(parameters_)));
      // Of wide samples some are no numbers.
      if constexpr (!is_wide<T>)
        if (!border_is_marked_anyway() && all_equal(std::span<const T>(samples.values))) return;
      *marks = LatticeBits(schedule_.mark_box(job.tile));
      CurvatureField field;
      // Wide samples are made into heights, narrow ones are multiplied by the field scale late.
      if constexpr (is_wide<T>) {
        const std::vector<double> heights =
            heights_of<T>(samples.values, parameters_.range_low, parameters_.field_scale);
        evaluate_curvature(Samples<double>{samples.view.box, heights.data()}, cubes, 1, field);
        mark_curvature(field, parameters_.domain(), {parameters_.accuracy, 1, parameters_.max_level}, *marks);
      } else {
        evaluate_curvature(samples.view, cubes, parameters_.field_scale, field);
        mark_curvature(field, parameters_.domain(),
                       {parameters_.accuracy, parameters_.field_scale, parameters_.max_level}, *marks);
      }
      if (parameters_.bounds_interpolation())
        mark_mesh_error(samples.view, parameters_.domain(), mesh_bounds(parameters_), *marks);
    });
    return {job.tile, std::move(marks)};
  }

  SubdividedBrick subdivide_brick(const BrickJob& job) const {
    const Domain domain = parameters_.domain();
    const Box box = parameters_.bricks().closed_box(job.brick);
    LatticeBits marks(region_of_marks(box, domain));
    for (const auto& tile : job.marks) copy_bits(*tile, marks);
    return {job.brick, job.slices, subdivide(std::move(marks), box, domain)};
  }

  EncodedBrick encode(SubdividedBrick brick) const {
    auto code = std::make_shared<BrickCode>();
    with_sample_type(parameters_.type, [&](auto type) {
      using T = decltype(type);
      const auto samples = gathered<T>(brick.slices, samples_to_encode(parameters_, brick.brick));
      encode_brick(samples.view, brick.active, parameters_, brick.brick, *code);
    });
    EncodedBrick encoded{parameters_.bricks().id(brick.brick), std::move(code), {}};
    if (parameters_.mesh_error >= 0)
      encoded.mesh = std::make_shared<MeshedBrick>(
          MeshedBrick{brick.brick, std::move(brick.slices), std::move(brick.active), {}});
    return encoded;
  }

  void measure_mesh(EncodedBrick& encoded) const {
    if (!encoded.mesh) return;
    const MeshedBrick& mesh = *encoded.mesh;
    with_sample_type(parameters_.type, [&](auto type) {
      using T = decltype(type);
      const auto original = gathered<T>(mesh.slices, mesh.active.box());
      // Without loss the mesh has the original samples.
      const auto* values = reinterpret_cast<const T*>(mesh.values.data());
      const std::span<const T> points = mesh.values.empty()
                                            ? std::span<const T>(original.values)
                                            : std::span<const T>(values, mesh.values.size() / sizeof(T));
      encoded.code->statistics.mesh_error = largest_mesh_error<T>(points, mesh.active, original.view,
                                                                  parameters_.bricks().owned_box(mesh.brick),
                                                                  parameters_.dims, parameters_.cube_size);
    });
    encoded.mesh.reset();
  }

 private:
  bool border_is_marked_anyway() const {
    return parameters_.bounds_interpolation() && mesh_bounds(parameters_).border < 0;
  }

  template <class T>
  struct Gathered {
    std::vector<T> values;
    Samples<T> view;
  };
  template <class T>
  Gathered<T> gathered(const SliceRange& slices, const Box& box) const {
    Gathered<T> result{std::vector<T>(static_cast<std::size_t>(box.count())), {}};
    gather(slices, parameters_.dims, box, result.values.data());
    result.view = {box, result.values.data()};
    return result;
  }

  const CodingParameters& parameters_;
  const EncodeSchedule& schedule_;
};

void build_and_run(const CodingParameters& parameters, const BrickRows& rows, const EncodeBudget& budget,
                   const EncodeStreams& streams, ClosedSamples* closed, bool measure) {
  EncodeSchedule schedule(parameters, rows, mark_halo(parameters));
  const Stages stages(parameters, schedule);
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
    SliceSamples slice = streams.read_slice(next_rows);
    ++next_rows.low.z, ++next_rows.high.z;
    return slice;
  });
  flow::limiter_node<Arrival, int> slices(
      graph, static_cast<std::size_t>(schedule.slices_needed() + budget.slices_ahead));
  Schedule plan(graph, flow::serial, [&](const Arrival& arrival, Schedule::output_ports_type& out) {
    if (const auto* slice = std::get_if<SliceSamples>(&arrival))
      for (MarkJob& job : schedule.add_slice(*slice)) std::get<0>(out).try_put(std::move(job));
    else
      for (BrickJob& job : schedule.add_marks(std::get<MarkedTile>(arrival)))
        std::get<1>(out).try_put(std::move(job));
  });
  flow::function_node<MarkJob, Arrival> curvature(
      graph, workers, [&](const MarkJob& job) -> Arrival { return stages.mark(job); });
  flow::queue_node<BrickJob> ready(graph);
  flow::limiter_node<BrickJob, int> bricks(graph, static_cast<std::size_t>(budget.bricks_in_flight));
  flow::function_node<BrickJob, SubdividedBrick> subdivide_node(
      graph, workers, [&](const BrickJob& job) { return stages.subdivide_brick(job); });
  flow::function_node<SubdividedBrick, EncodedBrick> encode(graph, workers,
                                                            [&](const SubdividedBrick& brick) {
                                                              EncodedBrick encoded = stages.encode(brick);
                                                              if (streams.brick_done)
                                                                streams.brick_done(encoded.id);
                                                              return encoded;
                                                            });
  const auto place = [&](const EncodedBrick& brick) {
    return static_cast<std::size_t>(brick.id - first_brick);
  };
  flow::sequencer_node<EncodedBrick> in_order(graph, place);
  flow::function_node<EncodedBrick, EncodedBrick> complete(graph, flow::serial, [&](EncodedBrick brick) {
    if (!brick.mesh) return brick;
    if (closed)
      brick.mesh->values = closed->complete(brick.mesh->brick, brick.code->decoded);
    else if (parameters.mode == FileMode::grid)
      brick.mesh->values = std::move(brick.code->decoded);
    brick.code->decoded = {};
    return brick;
  });
  flow::function_node<EncodedBrick, EncodedBrick> measure_node(graph, workers, [&](EncodedBrick brick) {
    if (measure) stages.measure_mesh(brick);
    return brick;
  });
  flow::sequencer_node<EncodedBrick> in_order_again(graph, place);
  Write write(graph, flow::serial, [&](const EncodedBrick& brick, Write::output_ports_type& out) {
    streams.write_brick(brick.id, std::move(*brick.code));
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
  flow::make_edge(subdivide_node, encode);
  flow::make_edge(encode, in_order);
  flow::make_edge(in_order, complete);
  flow::make_edge(complete, measure_node);
  flow::make_edge(measure_node, in_order_again);
  flow::make_edge(in_order_again, write);
  flow::make_edge(flow::output_port<0>(write), bricks.decrementer());
  flow::make_edge(flow::output_port<1>(write), slices.decrementer());

  read.activate();
  graph.wait_for_all();
}

}  // namespace

std::vector<BrickRows> rows_to_encode(const CodingParameters& parameters, const BrickRows& rows) {
  std::vector<BrickRows> all;
  if (mesh_needs_bricks_below(parameters)) all = rows_below(rows);
  all.push_back(rows);
  return all;
}

void run_encode_graph(const CodingParameters& parameters, const BrickRows& rows, const EncodeBudget& budget,
                      const EncodeStreams& streams) {
  oneapi::tbb::task_arena arena(budget.threads);
  arena.execute([&] {
    std::optional<ClosedSamples> closed;
    if (mesh_needs_bricks_below(parameters)) closed.emplace(parameters, rows);
    EncodeStreams unwritten = streams;
    unwritten.write_brick = [](std::int64_t, BrickCode) {};
    unwritten.brick_done = {};
    for (const BrickRows& r : rows_to_encode(parameters, rows))
      build_and_run(parameters, r, budget, r == rows ? streams : unwritten, closed ? &*closed : nullptr,
                    r == rows);
  });
}

}  // namespace tagrid
