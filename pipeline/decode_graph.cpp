#include "pipeline/decode_graph.h"

#include <oneapi/tbb/flow_graph.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <cstring>
#include <memory>
#include <vector>

#include "io/errors.h"
#include "stages/brick_codec.h"

namespace tagrid {
namespace {

namespace flow = oneapi::tbb::flow;

// The samples of one layer of bricks. Every brick writes those that it owns, and no others.
struct Layer {
  std::int64_t first_slice = 0;
  std::vector<std::byte> samples;
};

struct CodedBrick {
  std::shared_ptr<const BrickBytes> bytes;
  std::shared_ptr<Layer> layer;
};

struct BrickInLayer {
  std::int64_t id = 0;
  std::shared_ptr<Layer> layer;
  std::shared_ptr<const DecodedBrick> decoded;  ///< where somebody inspects it
};

std::shared_ptr<Layer> make_layer(const CodingParameters& parameters, Index3 brick) {
  const Box owned = parameters.bricks().owned_box({0, 0, brick.z});
  auto layer = std::make_shared<Layer>();
  layer->first_slice = owned.low.z;
  layer->samples.resize(static_cast<std::size_t>(owned.size().z * parameters.dims.x * parameters.dims.y) *
                        size_of(parameters.type));
  return layer;
}

template <class T>
void copy_to_layer(const CodingParameters& parameters, const Box& owned, const std::vector<T>& samples,
                   Layer& layer) {
  const auto row = static_cast<std::size_t>(owned.size().x);
  const T* from = samples.data();
  for (std::int64_t z = owned.low.z; z <= owned.high.z; ++z)
    for (std::int64_t y = owned.low.y; y <= owned.high.y; ++y, from += row) {
      const std::int64_t at =
          ((z - layer.first_slice) * parameters.dims.y + y) * parameters.dims.x + owned.low.x;
      std::memcpy(layer.samples.data() + static_cast<std::size_t>(at) * sizeof(T), from, row * sizeof(T));
    }
}

template <class T>
std::vector<std::byte> bytes_of(const std::vector<T>& values) {
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

BrickInLayer decode_into_layer(const CodingParameters& parameters, const CodedBrick& brick,
                               const std::string& name, bool keep) {
  const Index3 position = parameters.bricks().position(brick.bytes->id);
  auto decoded = std::make_shared<DecodedBrick>();
  decoded->id = brick.bytes->id;
  // Voxels are coded without a look at the grid, unless it selects their bound.
  const bool needs_activity = keep || parameters.mode == FileMode::grid || parameters.surface_error >= 0;
  Status status;
  if (needs_activity)
    status = decode_brick_activity(brick.bytes->activity, parameters, position, decoded->active);
  if (status.ok())
    with_sample_type(parameters.type, [&](auto type) {
      using T = decltype(type);
      std::vector<T> samples, points;
      status =
          decode_brick_values<T>(brick.bytes->values, decoded->active, parameters, position, samples, points);
      if (!status.ok()) return;
      copy_to_layer(parameters, parameters.bricks().owned_box(position), samples, *brick.layer);
      if (!keep) return;
      decoded->samples = bytes_of(samples);
      decoded->points = bytes_of(points);
    });
  if (!status.ok())
    throw BrokenInput((name.empty() ? "" : name + ": ") + "brick " + std::to_string(brick.bytes->id) + ": " +
                      status.what());
  if (!keep) decoded.reset();
  return {brick.bytes->id, brick.layer, std::move(decoded)};
}

void build_and_run(const CodingParameters& parameters, int threads, const DecodeStreams& streams) {
  const std::int64_t layer_bricks = parameters.bricks().layer_count();
  const bool keep = static_cast<bool>(streams.inspect_brick);
  std::shared_ptr<Layer> layer;

  using Write = flow::multifunction_node<BrickInLayer, std::tuple<int>>;

  flow::graph graph;
  flow::input_node<CodedBrick> read(graph, [&](oneapi::tbb::flow_control& control) -> CodedBrick {
    auto bytes = std::make_shared<BrickBytes>();
    if (!streams.read_brick(*bytes)) {
      layer.reset();
      control.stop();
      return {};
    }
    if (bytes->id % layer_bricks == 0)
      layer = make_layer(parameters, parameters.bricks().position(bytes->id));
    return {std::move(bytes), layer};
  });
  flow::limiter_node<CodedBrick, int> budget(graph, static_cast<std::size_t>(2 * layer_bricks));
  flow::function_node<CodedBrick, BrickInLayer> decode(
      graph, static_cast<std::size_t>(threads), [&](const CodedBrick& brick) {
        BrickInLayer decoded = decode_into_layer(parameters, brick, streams.name, keep);
        if (streams.brick_done) streams.brick_done(decoded.id);
        return decoded;
      });
  flow::sequencer_node<BrickInLayer> in_order(
      graph, [](const BrickInLayer& brick) { return static_cast<std::size_t>(brick.id); });
  Write write(graph, flow::serial, [&](const BrickInLayer& brick, Write::output_ports_type& out) {
    if (keep) streams.inspect_brick(*brick.decoded);
    if ((brick.id + 1) % layer_bricks != 0) return;
    streams.write_slices(brick.layer->samples);
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
