#include "pipeline/meshes/coarsen_file.h"

#include "pipeline/decode/graph.h"
#include "pipeline/memory/of_bricks.h"
#include "pipeline/meshes/coarsened_grid.h"
#include "pipeline/threads/threads.h"

namespace tagrid {
namespace {

std::uint64_t bytes_beside_decoding(const CodingParameters& parameters, std::uint64_t taker_bytes,
                                    int threads) {
  const double bytes = static_cast<double>(CoarsenedGrid::working_bytes(parameters, threads)) +
                       static_cast<double>(CoarsenedGrid::bytes_of_brick(parameters)) +
                       static_cast<double>(taker_bytes);
  return static_cast<std::uint64_t>(std::min(bytes * heap_overhead, 4e18));
}

}  // namespace

CoarseningPlan plan_coarsening(const CodingParameters& parameters, std::uint64_t taker_bytes,
                               const Resources& resources) {
  const std::uint64_t least = bytes_beside_decoding(parameters, taker_bytes, 1);
  CoarseningPlan plan{plan_decoding(parameters, resources, DecodeUse::mesh, least), resources.threads};
  if (!resources.memory) return plan;
  const std::uint64_t decoding = plan.decoding.memory - least;
  while (plan.threads > 1 &&
         decoding + bytes_beside_decoding(parameters, taker_bytes, plan.threads) > *resources.memory)
    --plan.threads;
  plan.decoding.memory = decoding + bytes_beside_decoding(parameters, taker_bytes, plan.threads);
  return plan;
}

void coarsen_file(TagReader& reader, const MeshBound& bound, const Box& positions, const std::string& path,
                  std::uint64_t taker_bytes, const Resources& resources, const TakeCoarsened& take,
                  const Progress& progress) {
  const CodingParameters& parameters = reader.parameters();
  const CoarseningPlan plan = plan_coarsening(parameters, taker_bytes, resources);
  const BrickGrid bricks = parameters.bricks();
  // Half of the work is done when all samples are decoded.
  const std::uint64_t bytes =
      static_cast<std::uint64_t>(parameters.domain().volume().count()) * size_of(parameters.type);
  const Watch watch = watch_for(progress, 2 * bytes);
  Threads threads(plan.threads);
  CoarsenedGrid grid(parameters, bound, path);
  DecodeStreams streams;
  streams.bricks = reader.bricks();
  streams.write_rows = [&](const DecodedRows& layer) {
    threads.run([&] { grid.add_layer(layer); });
    watch.done(layer.bytes());
  };
  run_decode_graph(parameters, BrickRows::all(bricks), plan.decoding.budget, streams);
  threads.run([&] { grid.settle(); });

  std::uint64_t left = bytes;
  for (std::int64_t id = 0; id < bricks.count(); ++id) {
    const Index3 position = bricks.position(id);
    if (!positions.contains(position)) continue;
    const CoarsenedBrick brick = grid.brick(position);
    const Box& box = brick.active.box();
    take(position, brick.active, [&](Index3 p) {
      return brick.samples.data() + static_cast<std::size_t>(box.offset(p)) * size_of(parameters.type);
    });
    const auto done =
        static_cast<std::uint64_t>(bricks.owned_box(position).count()) * size_of(parameters.type);
    watch.done(done);
    left -= done;
  }
  watch.done(left);
}

}  // namespace tagrid
